// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Time lag of the actuator positions relative to the tip measurements, estimated from an insertion.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <bevel/model/samples.hpp>

namespace bevel::io {

/// Largest lag (s) that is searched, in both directions. Median and averaging filters of trackers delay by up to a
/// second.
inline constexpr double kLargestLag_s = 2;

/// Time lag of the actuator positions.
struct BaseLag {
  double lag_s = 0;  ///< positive: the actuator's time stamps are later than the tip's for the same motion
  /// Standard error: the largest of that from leaving out each of ten parts in turn, that of the residuals with their
  /// autocorrelation, and a quarter of the range of lags that fit as well within two standard deviations.
  double sd_s = 0;
  double rms_mm = 0;        ///< root mean square of the residuals of the path length, in mm
  bool determined = false;  ///< the standard error is below kLargestLagSd_s and the optimum is inside the search range
  /// Returns whether the lag is determined and differs from zero by more than three standard errors.
  /// @return false if the lag is consistent with zero or not determined
  bool significant() const;
};

/// Standard error (s) from which on the motion does not determine the lag. At 10 mm/s it is a depth of 1 mm.
inline constexpr double kLargestLagSd_s = 0.1;

/// Estimates the lag of the actuator positions relative to the tip.
///
/// The tip's z at time t is modelled as a cubic polynomial of the insertion that the actuator reports at t + lag. The
/// polynomial covers entry tilt, curvature, scale and zero of the insertion; the lag minimises the sum of squared
/// residuals. At a constant insertion rate a lag is confounded with another zero of the insertion and is not
/// determined. A mechanical delay of the tip (friction, a compliant shaft) is confounded with a lag too.
/// @param actuators  insertion in mm, in order of time
/// @param tips  positions in {A}, mm, in order of time
/// @return the lag with its standard error; nothing for less than 4 s or 40 measurements, or if z was not measured
std::optional<BaseLag> estimate_base_lag(std::span<const model::ActuatorState> actuators,
                                         std::span<const model::TipMeasurement> tips);

}  // namespace bevel::io
