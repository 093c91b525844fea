// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Outcome of an insertion: the distance from the tip to the target, predicted and final, with its uncertainty.

namespace bevel::controller {

/// Standard deviations of a miss that count against a tolerance. If the covariance of the estimate is correct, about
/// one reported arrival in forty is outside its tolerance.
inline constexpr double kMissDeviations = 2;

/// Estimated distance from the tip to the target, or its prediction during insertion.
struct Miss {
  double distance_mm = 0;  ///< distance, mm
  /// Standard deviation, mm: of the estimated tip along its least certain axis, and of a moving target. During
  /// insertion also of the heading and of the remaining bend.
  double sd_mm = 0;
  double tolerance_mm = 0;  ///< tolerance of the target, mm, or SafetyLimits::arrival_tolerance_mm

  /// Returns whether the tip is within the tolerance, uncertainty included.
  /// @return distance + 2 sd <= tolerance
  bool is_within() const { return distance_mm + kMissDeviations * sd_mm <= tolerance_mm; }
  /// Returns whether the distance exceeds a limit by more than its uncertainty.
  /// @param limit_mm limit, mm
  /// @return distance - 2 sd > limit
  bool exceeds(double limit_mm) const { return distance_mm - kMissDeviations * sd_mm > limit_mm; }
};

}  // namespace bevel::controller
