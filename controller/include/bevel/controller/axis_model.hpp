// SPDX-License-Identifier: MIT
#pragma once
// Transmission between the axes and the tip by the effects of a model file. The law acts on the tip; AxisModel computes
// how far the axes have to move for it: through a dead band of the rotation (backlash, wind-up of the shaft), and to
// the place where a tip that advances by jumps (stick-slip, puncture) rests nearest to the target.
#include <array>
#include <vector>

#include <bevel/controller/config.hpp>
#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::controller {

class AxisModel {
 public:
  // Effects that do nothing between base and tip may be among them. Throws ArgumentError for more than
  // model::kMaxEffects.
  explicit AxisModel(std::vector<model::ActiveEffect> effects);

  // Whether anything among the effects can keep the tip from turning with the base.
  bool turns_late() const { return turns_late_; }
  /// Returns whether an effect makes the tip stick and jump while the base advances evenly.
  bool advances_by_jumps() const { return advances_by_jumps_; }

  // Follows the base; the first call is the entry, with nothing wound up. tip_depth_mm: z of the tip in {A}. Does not
  // allocate.
  void follow(const model::ActuatorState& actuator, double tip_depth_mm);

  // How far the base still has to turn, toward +1 or -1, until the tip turns with it. A dead band passes on what is
  // beyond it: what of a long turn does not arrive is the dead band.
  double take_up_rad(double direction) const;

  /// Computes the insertion of the base, mm, until the tip rests nearest to a point on its way.
  ///
  /// A tip that jumps rests only between two jumps; the nearest of these places may lie before or beyond the point.
  /// @param ahead_mm distance from the tip to the point along its way, positive
  /// @return 0 if the tip cannot come nearer by any insertion; \p ahead_mm if it does not advance by jumps. Does not
  ///     allocate.
  double insertion_to_nearest_mm(double ahead_mm) const;

 private:
  struct Tip {
    double rotation_rad = 0, insertion_mm = 0;
    std::array<model::EffectMemory, model::kMaxEffects> memory;
  };
  void move(Tip& tip, const model::BaseMotion& from, const model::BaseMotion& to, double tip_depth_mm) const;
  bool find_late_turn() const;
  bool find_jumps() const;

  std::vector<model::ActiveEffect> effects_;
  bool turns_late_ = false, advances_by_jumps_ = false;
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
