// SPDX-License-Identifier: MIT
// What no rig does, said of decoded samples. LCM's logs carry no checksum: a flipped byte that leaves a message finite
// and within its type's bounds can only be told by its neighbours.
//
// A sample is left out where that is safe: alone between two neighbours that agree with each other. A jump that lasts
// is told and stays, since nobody knows which side of it is wrong. The bounds are wide: camera outliers, dropped frames
// and insertions recorded a step at a time are no damage.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <bevel/model/samples.hpp>

namespace bevel::io {

// No needle is inserted faster than a hand stabs, and no ball screw on a bench moves faster.
inline constexpr double kFastestInsertion_mm_s = 250;
// 1500 revolutions a minute: faster, a stepper has no torque left. Needles are spun at a few revolutions a second.
inline constexpr double kFastestRotation_rad_s = 157;
// No needle is longer than a metre; an axis may count from a place in air.
inline constexpr double kFarthestInsertion_mm = 1000;
// Stamps and encoder counts of one instant are not taken at one instant: a jump of less is never told.
inline constexpr double kUnsure_mm = 0.5;
inline constexpr double kUnsure_rad = 0.2;
// An insertion takes minutes; one recorded by hand, step by step, has pauses.
inline constexpr double kLongestPause_s = 3600;
// The farthest that a camera's outlier lies from its neighbours: across the picture of a workspace of this size.
inline constexpr double kFarthestOutlier_mm = 100;
// A camera that is surer of one frame than of those around it, by this ratio of information (10 in standard deviation).
inline constexpr double kSurerByRatio = 100;

// A measurement this long before the first or after the last axis sample is outside the recorded motion. Measurements
// arrive up to 0.5 s after their time, and programs of one rig start within a second.
inline constexpr double kOutsideAxes_s = 1;
// Share of a camera's measurements outside the recorded motion above which the recording counts as damaged. Below it, a
// camera ran before or after the drives.
inline constexpr double kLargestShareOutside = 0.2;

struct Oddity {
  enum class Kind {
    time,    // utime apart from its neighbours' by more than a pause
    order,   // seq falls back or is there twice, against the order of utime
    motion,  // an axis faster than any, or out and back between two samples
    reading  // the tip away and back, a claim of precision or a camera that occurs once
  };
  Kind kind = Kind::time;
  std::int64_t utime = 0;
  bool left_out = true;  // else the jump lasts
  std::string what;      // "insertion jumps by 812 mm in 0.01 s; allowed 3 mm"
};

struct Judgement {
  std::vector<bool> left_out;  // one for each sample, in the order given
  std::vector<Oddity> oddities;
};

// Samples in any order; they are looked at in that of utime.
Judgement judge(std::span<const model::ActuatorState> actuators);
// `actuators`: those not left out, in the order of utime.
Judgement judge(std::span<const model::TipMeasurement> tips, std::span<const model::ActuatorState> actuators);
// By stamps, cameras and claims of precision alone: a heading that is turned about for a frame is a tracker's mistake,
// and the estimator has its gate for it.
Judgement judge(std::span<const model::TipHeading> headings);

/// Time of measurements relative to that of the axes.
struct Coverage {
  std::size_t inside = 0,
              outside = 0;  ///< measurements within the time of the axes, and kOutsideAxes_s or more outside
  std::string faults;       ///< one line per camera with too large a share outside, possibly empty
};

/// Compares the times of one channel's measurements with those of the axes.
/// @param utimes  time of each measurement (us), by camera number
/// @param actuators  in any order; without any, everything counts as inside
/// @param channel  start of each line: "TIP_MEASUREMENT"
Coverage compare_times(const std::map<int, std::vector<std::int64_t>>& utimes,
                       std::span<const model::ActuatorState> actuators, const std::string& channel);

// A line for each kind, with the first of its kind: "1 ACTUATOR_STATE at 3.21 s: ...; left out". Times count from
// start_utime.
std::string describe(const std::vector<Oddity>& oddities, const std::string& channel, std::int64_t start_utime);

}  // namespace bevel::io
