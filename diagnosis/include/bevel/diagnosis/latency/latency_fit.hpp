// SPDX-License-Identifier: MIT
#pragma once
// How late the stamps of one camera are, from an insertion whose rate changes.
//
// A reading stamped t shows the needle of t - latency (effect camera_latency, model/src/effects/camera_latency.cpp).
// With p(t) the tip as the model has it from the axes, h the unit vector of its heading and d(t) the depth of
// insertion,
//
//   h . (y(t) - p(t - latency)) = c0 + c1 d + c2 d^2 + error,
//
// in which c0 takes up a depth that was registered wrong, c1 a needle that slips or a camera whose scale is off, and c2
// a curvature that is not the model's: all of them are functions of depth, as the whole path of a needle is, whereas
// the latency shows by -rate times latency. Where the rate never changes the two are one and nothing can be said.
//
// Least squares in (latency, c0, c1, c2): the latency by its profile on a grid, then by Gauss-Newton with the
// derivative -h . dp/dt. Errors of neighbouring frames are alike; they are taken as a first-order autoregression in
// time, whose correlation is found from the residuals. That is for the estimate; its standard error must hold for
// errors of another kind too, as for those of a tracker that change where the bevel is turned at rest and then stay. So
// the readings are cut in the middle of each rest, and each of these stretches is left out in turn (jackknife of
// groups: Efron and Tibshirani, An Introduction to the Bootstrap, 1993, ch. 11): errors may be alike in any way within
// one.
//
// Of the log what comes before the first withdrawal is used: after one the play of the insertion looks like a delay.
#include <cstdint>
#include <span>
#include <string>

#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::diagnosis {

struct LatencyFit {
  std::string refusal;      // why nothing can be said and what to record; the rest is then what led to it. Empty if ok
  double latency_s = 0;     // positive: stamped later than taken, by the clock of the axes' stamps
  double sd_s = 0;          // standard error
  double within_95_s = 0;   // half of the interval in which the latency is with 95 %
  int stretches = 0;        // of readings whose errors are taken as independent; the interval is Student's
  double inflation = 1;     // of its variance by c0, c1 and c2 not being known: large where the rate hardly changes
  int readings = 0;         // used
  double rms_mm = 0;        // of the errors along the needle
  double correlation = 0;   // of the errors of readings that follow each other, 0 to 1
  double spacing_s = 0;     // of those, median
  double slowest_mm_s = 0;  // of the axis at the readings: 5th and
  double fastest_mm_s = 0;  // 95th percentile
};

inline constexpr double kLatencyLowest_s = -0.2, kLatencyHighest_s = 1.0;  // where it is looked for
inline constexpr double kLatencyWorst_s = 0.01;  // what is not known to this (within_95_s) is refused

// `needle` without a camera_latency of its own. `tips` of one camera, those whose status is 0; in any order. Throws
// ArgumentError for fewer than two actuator samples and DomainError where the model's needle leaves the
// domain of the slip law.
LatencyFit fit_latency(const model::AugmentedNeedle& needle, std::span<const model::ActuatorState> actuators,
                       std::span<const model::TipMeasurement> tips);

}  // namespace bevel::diagnosis
