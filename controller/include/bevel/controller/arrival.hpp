// SPDX-License-Identifier: MIT
#pragma once
// Outcome of an insertion: the distance from the tip to the target, predicted and final, with its uncertainty.

namespace bevel::controller {

/// Standard deviations of a miss that count against a tolerance: about one arrival in forty that is reported lies
/// outside its tolerance, if the covariance of the estimate is right.
inline constexpr double kMissDeviations = 2;

/// Distance from the tip to the target by the estimate, or its prediction during insertion.
struct Miss {
  double distance_mm = 0;
  /// Standard deviation, mm: of the estimated tip along its least certain axis, and of a target that moves. During
  /// insertion also of the heading and of what remains to bend.
  double sd_mm = 0;
  double tolerance_mm = 0;  ///< of the target, else SafetyLimits::arrival_tolerance_mm

  /// Returns whether the tip is within the tolerance with its uncertainty: distance + 2 sd <= tolerance.
  bool is_within() const { return distance_mm + kMissDeviations * sd_mm <= tolerance_mm; }
  /// Returns whether the tip is farther off than \p limit_mm by more than its uncertainty: distance - 2 sd > limit.
  bool exceeds(double limit_mm) const { return distance_mm - kMissDeviations * sd_mm > limit_mm; }
};

}  // namespace bevel::controller
