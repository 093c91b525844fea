// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Estimates the latency of the time stamps of one camera from an insertion with changing speed.
///
/// A measurement with time stamp t shows the needle at t - latency (effect camera_latency,
/// model/src/effects/camera_latency.cpp). With p(t) the tip that the model predicts from the axes, h the unit vector of
/// its heading, y(t) the measured tip and d(t) the depth of insertion,
/// \code{.unparsed}
///   h . (y(t) - p(t - latency)) = c0 + c1 d + c2 d^2 + error
/// \endcode
/// c0 absorbs an error of the registered depth, c1 slip along the shaft or an error of the camera's scale, and c2 an
/// error of the model's curvature. All three are functions of depth, as is the whole path of a needle. The latency
/// contributes minus speed times latency. At constant speed latency and c0 are confounded and there is no estimate.
///
/// The method is least squares in (latency, c0, c1, c2). The latency follows from its profile on a grid, then from
/// Gauss-Newton steps with the derivative -h . dp/dt. Errors of successive frames are autocorrelated. The estimate
/// assumes a first-order autoregression in time, whose correlation is estimated from the residuals. The standard error
/// has to hold for other errors as well, for example of a tracker with an offset that changes when the bevel rotates
/// during a stop and then remains. It is therefore a delete-one-group jackknife (Efron and Tibshirani, An Introduction
/// to the Bootstrap, 1993, ch. 11). The groups are the stretches of measurements between the middles of successive
/// stops; errors can have any correlation within a group. Ten groups of equal size replace them if there are fewer than
/// five.
///
/// The method uses the log up to the first retraction. After a retraction, backlash of the insertion axis is confounded
/// with latency.
#include <cstdint>
#include <span>
#include <string>

#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::diagnosis {

/// Estimate of a camera's latency.
struct LatencyFit {
  std::string refusal;      ///< why there is no estimate, and what to record; empty: the estimate is valid
  double latency_s = 0;     ///< latency, s; positive: stamped later than captured, on the clock of the axes
  double sd_s = 0;          ///< standard error of latency_s, s
  double within_95_s = 0;   ///< half width of the 95 % interval by Student's distribution, s
  int stretches = 0;        ///< number of jackknife groups, whose errors are assumed independent
  double inflation = 1;     ///< variance inflation by estimating c0, c1 and c2; large if the speed hardly changes
  int readings = 0;         ///< number of measurements used
  double rms_mm = 0;        ///< root mean square residual along the needle, mm
  double correlation = 0;   ///< correlation of the errors of successive measurements, 0 to 1
  double spacing_s = 0;     ///< median interval between measurements, s
  double slowest_mm_s = 0;  ///< 5th percentile of the axis speed at the measurements, mm/s
  double fastest_mm_s = 0;  ///< 95th percentile of the axis speed at the measurements, mm/s
};

inline constexpr double kLatencyLowest_s = -0.2,  ///< lower limit of the search, s
    kLatencyHighest_s = 1.0;                      ///< upper limit of the search, s
/// Largest allowed LatencyFit::within_95_s, s; an estimate with a wider interval is refused.
inline constexpr double kLatencyWorst_s = 0.01;

/// Estimates the latency of one camera.
/// @param needle model of the needle, without a camera_latency effect
/// @param actuators actuator states, in any order
/// @param tips tip positions of one camera in {A}, in any order; those with status 0 are used
/// @return the estimate; if LatencyFit::refusal is not empty, the intermediate results that led to the refusal
/// @throws bevel::ArgumentError for fewer than two actuator samples before the first retraction
/// @throws bevel::DomainError if the model leaves the domain of the slip law
LatencyFit fit_latency(const model::AugmentedNeedle& needle, std::span<const model::ActuatorState> actuators,
                       std::span<const model::TipMeasurement> tips);

}  // namespace bevel::diagnosis
