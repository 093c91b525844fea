// SPDX-License-Identifier: MIT
/// \file
/// Plausibility checks of decoded samples. LCM logs have no checksum: a flipped bit that leaves a message finite and
/// within the limits of its type is visible only by comparison with the neighbours of the sample.
///
/// A sample is left out where this is safe: a single sample between two neighbours that agree with each other. A jump
/// that persists is reported and not removed, since either side of it may be wrong. The limits are wide: camera
/// outliers, dropped frames and stepwise insertions are not damage.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <bevel/model/samples.hpp>

namespace bevel::io {

/// Largest insertion rate (mm/s): that of a fast manual insertion. No ball screw on a bench moves faster.
inline constexpr double kFastestInsertion_mm_s = 250;
/// Largest rotation rate (rad/s): 1500 revolutions per minute, above which a stepper motor has no torque. Needles
/// rotate at a few revolutions per second.
inline constexpr double kFastestRotation_rad_s = 157;
/// Largest insertion (mm). No needle is longer than a metre; the zero of an axis may be in air.
inline constexpr double kFarthestInsertion_mm = 1000;
/// Insertion jump (mm) that is always allowed, since time stamps and encoder counts are not taken simultaneously.
inline constexpr double kUnsure_mm = 0.5;
/// Rotation jump (rad) that is always allowed, for the same reason.
inline constexpr double kUnsure_rad = 0.2;
/// Longest pause (s) between two samples. An insertion takes minutes; a stepwise insertion by hand has pauses.
inline constexpr double kLongestPause_s = 3600;
/// Largest distance (mm) of a camera outlier from its neighbours: the width of the imaged workspace.
inline constexpr double kFarthestOutlier_mm = 100;
/// Largest ratio of the information of a frame to that of its neighbours; 10 in standard deviation.
inline constexpr double kSurerByRatio = 100;

/// Time (s) before the first or after the last actuator state from which on a measurement is outside the recorded
/// motion. Measurements arrive up to 0.5 s after their time, and programs of one rig start within a second.
inline constexpr double kOutsideAxes_s = 1;
/// Share of a camera's measurements outside the recorded motion above which the recording counts as damaged. With a
/// smaller share, the camera ran before or after the drives.
inline constexpr double kLargestShareOutside = 0.2;

/// One implausible sample, or a jump that persists.
struct Oddity {
  /// Kinds of implausibility.
  enum class Kind {
    time,    ///< `utime` differs from that of the neighbour by more than kLongestPause_s
    order,   ///< `seq` decreases or repeats while `utime` increases
    motion,  ///< an axis exceeds its largest rate or position, or moves out and back between two samples
    reading  ///< the tip jumps away and back, the information is implausibly large, or a camera occurs once
  };
  Kind kind = Kind::time;  ///< kind of implausibility
  std::int64_t utime = 0;  ///< time of the sample, us since the epoch
  bool left_out = true;    ///< true: the sample is left out; false: the jump persists
  std::string what;        ///< "insertion jumps by 812 mm in 0.01 s; allowed 3 mm"
};

/// Result of judge().
struct Judgement {
  std::vector<bool> left_out;    ///< for each sample in the order given: true if it is left out
  std::vector<Oddity> oddities;  ///< samples that are left out, and jumps that persist
};

/// Checks time stamps, numbers and motion of actuator states. The samples are compared in the order of `utime`.
/// @param actuators  in any order
/// @return the samples to leave out, and the reasons
Judgement judge(std::span<const model::ActuatorState> actuators);
/// Checks time stamps, numbers, jumps and information of tip measurements, separately for each camera.
/// @param tips  in any order
/// @param actuators  those not left out, in the order of `utime`; without any, jumps are not checked
/// @return the samples to leave out, and the reasons
Judgement judge(std::span<const model::TipMeasurement> tips, std::span<const model::ActuatorState> actuators);
/// Checks time stamps, numbers and information of headings, separately for each camera. Directions are not checked: a
/// single reversed heading is an error of the tracker, which the gate of the estimator rejects.
/// @param headings  in any order
/// @return the samples to leave out, and the reasons
Judgement judge(std::span<const model::TipHeading> headings);

/// Times of measurements relative to those of the actuator states.
struct Coverage {
  std::size_t inside = 0,  ///< number of measurements within the time of the actuator states
      outside = 0;         ///< number of measurements more than kOutsideAxes_s outside
  std::string faults;      ///< one line for each camera whose share outside exceeds kLargestShareOutside
};

/// Compares the times of one channel's measurements with those of the actuator states.
/// @param utimes  time of each measurement (us), by camera number
/// @param actuators  in any order; without any, all measurements count as inside
/// @param channel  name of the channel for the lines: "TIP_MEASUREMENT"
/// @return the numbers of measurements inside and outside, and the faults
Coverage compare_times(const std::map<int, std::vector<std::int64_t>>& utimes,
                       std::span<const model::ActuatorState> actuators, const std::string& channel);

/// Describes oddities, one line for each kind: "1 ACTUATOR_STATE at 3.21 s: ...; left out".
/// @param oddities  in any order; each line contains the earliest of its kind
/// @param channel  name of the channel
/// @param start_utime  time from which the times in the lines count, us since the epoch
/// @return lines that end with a line feed; "" without oddities
std::string describe(const std::vector<Oddity>& oddities, const std::string& channel, std::int64_t start_utime);

}  // namespace bevel::io
