#pragma once
// What lies between the axes and the tip, by the effects of a model file: backlash, wind-up of the shaft. The law acts
// on the roll of the tip; here is how much the base has to turn before the tip does.
#include <array>
#include <vector>

#include "controller/config.hpp"
#include "model/effects/augmented_needle.hpp"
#include "model/samples.hpp"

namespace bevel::controller {

class AxisModel {
 public:
  // Effects that do nothing between base and tip may be among them. Throws std::invalid_argument for more than
  // model::kMaxEffects.
  explicit AxisModel(std::vector<model::ActiveEffect> effects);

  // Whether anything among the effects can keep the tip from turning with the base.
  bool turns_late() const { return turns_late_; }

  // Follows the base; the first call is the entry, with nothing wound up. tip_depth_mm: z of the tip in {A}. Does not
  // allocate.
  void follow(const model::ActuatorState& actuator, double tip_depth_mm);

  // How far the base still has to turn, toward +1 or -1, until the tip turns with it. A dead band passes on what is
  // beyond it: what of a long turn does not arrive is the dead band.
  double take_up_rad(double direction) const;

 private:
  struct Tip {
    double rotation_rad = 0;
    std::array<model::EffectMemory, model::kMaxEffects> memory;
  };
  void move(Tip& tip, const model::BaseMotion& to) const;

  std::vector<model::ActiveEffect> effects_;
  bool turns_late_ = false;
  bool entered_ = false;
  std::int64_t entry_utime_ = 0;
  model::BaseMotion entry_, base_;
  double tip_depth_mm_ = 0;
  Tip tip_;
};

// Rate of the base for a wanted rate of the tip: faster by as much as the axis can brake within what is to be taken up.
// share in [0, 1]: how much the law wants to turn; inside its boundary layer the dead band is crossed in proportion, so
// that noise in sigma does not throw the base from side to side.
double base_rate_rad_s(double tip_rate_rad_s, double take_up_rad, double share, const SteeringLimits& limits);

}  // namespace bevel::controller
