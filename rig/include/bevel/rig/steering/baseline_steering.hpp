// SPDX-License-Identifier: MIT
#pragma once
// Two laws of the literature, to measure the controller's by on the same targets; no rig is offered them.
//
// Duty-cycled spinning (Minhas et al., IEEE EMBC 2007; Wood et al., IEEE BioRob 2010): a needle that spins for a share
// D of what is inserted bends by (1 - D) of its curvature. In each cycle of insertion the bevel is turned by one turn
// more than what points it at the target, while the share
//     D = 1 - min(1, kappa / k),  kappa = 2 a / (a^2 + z^2)
// of the cycle goes in; for the rest it is kept. kappa is of the circle along the heading through the target, which
// lies z ahead and a aside.
//
// Bang-bang (a bevel that faces one side or the other, as in Reed et al., IEEE BioRob 2008): the bevel is kept until
// the target lies on the other side of the heading by more than a threshold, then turned to it with the needle at rest,
// and kept for some millimetres at least: where turning swings the tip, the target would change sides for ever.
//
// Both aim at where the target was said to be last, and know of the needle its pose and its curvature. Frame {A}, mm.
#include <Eigen/Core>
#include <optional>

#include <bevel/controller/supervisor.hpp>

namespace bevel::rig {

enum class BaselineLaw { duty_cycle, bang_bang };

// The target as it is seen from the tip: ahead along the heading, aside of it, and the turn that points the bevel at
// it.
struct Sight {
  double ahead_mm = 0, aside_mm = 0;
  double facing_rad = 0;  // in (-pi, pi]
};
Sight sight(const model::Pose& tip, double curvature_per_mm, const Eigen::Vector3d& target_mm);

// D. In [0, 1]; 0 where the target lies on the circle of the needle or inside it.
double duty(const Sight& sight, double curvature_per_mm);

class DutyCycle {
 public:
  // Of insertion: one turn at 8 rad/s takes 3.9 mm at 5 mm/s.
  static constexpr double kCycle_mm = 5;
  // What it would command now, without ramps; rotation_rad and inserted_mm of the axes.
  controller::Rates step(const Sight& sight, double curvature_per_mm, double rotation_rad, double inserted_mm,
                         const controller::SteeringLimits& limits);

 private:
  double next_mm_ = 0;  // of insertion: the next cycle
  std::optional<double> to_rad_;
  double spun_mm_per_rad_ = 0;
};

class BangBang {
 public:
  static constexpr double kThreshold_mm = 0.5;
  static constexpr double kKept_mm = 2;  // of insertion
  controller::Rates step(const Sight& sight, double rotation_rad, double inserted_mm,
                         const controller::SteeringLimits& limits);

 private:
  std::optional<double> turned_at_mm_;
  std::optional<double> to_rad_;
};

// Either under the limits and ramps of the controller: it comes to rest where the target is no longer ahead, for good
// where the estimate is lost, and for as long as it is unsure.
class BaselineSteering {
 public:
  BaselineSteering(BaselineLaw law, const controller::SteeringLimits& limits) : law_(law), limits_(limits) {}
  controller::Rates step(const controller::NeedleView& needle, const model::ActuatorState& axes,
                         const Eigen::Vector3d& target_mm, double dt_s);
  bool moves() const { return moves_; }
  bool arrived() const { return arrived_; }

 private:
  BaselineLaw law_;
  controller::SteeringLimits limits_;
  DutyCycle duty_cycle_;
  BangBang bang_bang_;
  controller::Rates rates_;
  bool moves_ = true, arrived_ = false;
};

}  // namespace bevel::rig
