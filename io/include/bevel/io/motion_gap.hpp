// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Intervals between two axis samples in which the motion of the axes is not known.

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include <bevel/model/samples.hpp>

namespace bevel::io {

/// An interval counts as a gap from this many typical intervals on. Sensors that report every 0.8 s have no gap in each
/// interval; three lost reports in a row are one.
inline constexpr double kGapPeriods = 4;
/// Shortest gap (s), for programs that fit the tip to the motion of the axes. A shorter interval of an axis that
/// accelerates by 10 mm/s^2 is interpolated with an error of at most 0.3 mm (acceleration times interval squared / 8).
inline constexpr double kShortestGap_s = 0.5;
inline constexpr double kMovedInGap_mm = 1.0,  ///< insertion within a gap that is allowed, mm: it bounds the path error
    kTurnedInGap_rad = 0.2;                    ///< rotation within a gap that is allowed, rad

/// Computes the longest interval between two samples that is not a gap.
/// @param actuators  in order of time
/// @param shortest_s  lower limit of the result (s)
/// @return \p shortest_s, or kGapPeriods times the median interval if that is longer, in s
double longest_interval_s(std::span<const model::ActuatorState> actuators, double shortest_s = kShortestGap_s);

/// A gap in which the axes moved.
struct MotionGap {
  std::size_t after = 0;     ///< index of the sample at the end of the gap
  double gap_s = 0;          ///< length of the gap, in s
  double since_first_s = 0;  ///< from the first sample to the beginning of the gap, in s
  double moved_mm = 0;       ///< insertion between both ends, in mm
  double turned_rad = 0;     ///< rotation between both ends, in rad
  double allowed_s = 0;      ///< longest interval that is not a gap, in s
  /// Describes the gap with its figures and the allowed values.
  /// @return text without a line end
  std::string what() const;
};

/// Finds the first gap in which the axes moved by more than kMovedInGap_mm or kTurnedInGap_rad. Import and diagnosis
/// use the same rule.
/// @param actuators  in order of time
/// @return nothing if there is no such gap
std::optional<MotionGap> find_motion_gap(std::span<const model::ActuatorState> actuators);

}  // namespace bevel::io
