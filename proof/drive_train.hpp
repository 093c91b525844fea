// SPDX-License-Identifier: MIT
#pragma once
// From the axes' encoders to the tip: what the drives, the gears and the shaft do on the way.
#include <vector>

#include "proof/hidden_physics.hpp"

namespace bevel::proof {

// Periodic errors of the axes, which every real drive has: small against the camera's noise (see distribution.hpp).
struct DriveRipple {
  double insertion_mm = 0;
  double insertion_period_mm = 4;
  double insertion_phase_rad = 0;
  double rotation_rad = 0;
  double rotation_phase_rad = 0;  // two per turn, as of a bent coupling
};

// The shaft in torsion, as rotary elements in series: each carries the friction of its part of the tissue. The tip end
// follows from equilibrium, element by element.
class ShaftChain {
 public:
  ShaftChain(double lag_at_100mm_rad, double element_mm, double longest_mm);
  // Roll of the tip's end, rad. `inserted_mm` of the shaft are in tissue, measured back from the tip.
  double follow(double base_rad, double inserted_mm);

 private:
  double element_mm_;
  double slip_step_rad_;          // friction of an element over the stiffness between two
  std::vector<double> roll_rad_;  // [0] at the tip
};

// Gears with clearance `width` and teeth that give over `give` before they carry.
class LooseGear {
 public:
  LooseGear(double width, double give) : half_(0.5 * width), give_(give) {}
  double follow(double input);

 private:
  double half_;
  double give_;
  double last_input_ = 0;
  double output_ = 0;
};

class DriveTrain {
 public:
  DriveTrain(const HiddenPhysics& physics, const DriveRipple& ripple, int recording);
  struct Tip {
    double advance_mm;
    double roll_rad;
  };
  // One step of kStep_s. `depth_mm` is the tip's own, from the step before.
  Tip step(double time_s, double insertion_mm, double rotation_rad, double depth_mm);

 private:
  double lost_share(double time_s) const;
  double feed(double time_s, double base_mm);
  double membrane(double advance_mm, double depth_mm);
  double bow(double advance_mm);
  double creep(double advance_mm, double inserted_mm);
  double friction_hold(double advance_mm);
  double first_friction_hold(double advance_mm);
  double chuck(double roll_rad, double inserted_mm);

  HiddenPhysics physics_;
  DriveRipple ripple_;
  double lost_at_s_;
  LooseGear insertion_gear_;
  LooseGear rotation_gear_;
  ShaftChain chain_;
  double play_rad_ = 0;  // tip's roll by the plain form of windup
  double last_base_mm_ = 0;
  double fed_mm_ = 0;
  double last_advance_mm_ = 0;
  enum class Membrane { whole, loaded, open } membrane_ = Membrane::whole;
  double membrane_lag_mm_ = 0;
  double held_mm_ = 0;
  bool slipping_ = false;
  double slides_to_mm_ = 0;
  double creep_quick_mm_ = 0;
  double creep_slow_mm_ = 0;
  double last_fed_mm_ = 0;
  double bowed_ = 0;  // share of the bow at this depth
  double last_unbowed_mm_ = 0;
  double chuck_lost_rad_ = 0;
  double last_chucked_rad_ = 0;
};

}  // namespace bevel::proof
