// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Recordings of one rig in the form that the mismatch diagnosis uses: the actuator motion, and a series of
/// measurements for each axis of each camera.
#include <cmath>
#include <string>
#include <vector>

#include <bevel/diagnosis/inference/dataset.hpp>
#include <bevel/model/effects/open_loop.hpp>

namespace bevel::diagnosis {

/// Excess variance of a channel's measurements near the entry, relative to the variance at large depth.
struct ScatterNearEntry {
  double excess = 0;     ///< excess of the variance ratio at the entry
  double length_mm = 0;  ///< decay length, mm; 0: the variance does not depend on depth
  /// Computes the variance ratio 1 + excess exp(-depth / length).
  /// @param depth_mm depth of insertion, mm
  /// @return variance relative to that at large depth; 1 if length_mm is 0
  double variance_at(double depth_mm) const { return length_mm > 0 ? 1 + excess * std::exp(-depth_mm / length_mm) : 1; }
  /// Computes the standard deviation at the entry.
  /// @return standard deviation relative to that at large depth
  double sd_at_entry() const { return std::sqrt(variance_at(0)); }
};

/// One direction in which one camera or sensor measures the tip's position or the heading's unit vector. The directions
/// are the eigenvectors of the information matrix with nonzero information, and the coordinate axes where these
/// suffice; of a heading, its x and y components.
struct Channel {
  int camera = 0;              ///< number of the camera
  Eigen::Vector3d axis;        ///< unit vector in {A}
  std::string name;            ///< "tip.y"; "tip[2].(0.71 0 0.71)" for camera 2 and an oblique axis; "heading.x"
  double claimed_sd = 0;       ///< median standard deviation that the messages state, in the channel's unit
  bool heading = false;        ///< whether the channel measures a heading; false: a position
  ScatterNearEntry scatter{};  ///< excess near the entry; the claimed standard deviations already include it
  /// Returns the unit of the channel.
  /// @return "rad" for a heading, because a small component of a unit vector is an angle; "mm" for a position
  const char* unit() const { return heading ? "rad" : "mm"; }
};

/// Measurements of one channel in one recording. Series::message is an index into Motion::at of the recording;
/// Series::measured is the component along the channel's axis.
using inference::Series;

/// One recorded insertion.
struct Recording {
  std::string name;                          ///< name, for example of the log file
  model::Motion motion;                      ///< actuator motion, with the nodes at which measurements exist
  std::vector<Series> series;                ///< one per channel of the case; may be empty
  std::vector<Eigen::Vector3d> position_mm;  ///< raw measurements in {A}, one per motion.at; NaN: no position
  std::size_t skipped = 0;                   ///< measurements not used: status not 0, or no information along any axis
  bool changed = false;                      ///< whether it belongs to the second of two groups
  /// Returns the duration of the motion.
  /// @return time of the last node, s
  double duration_s() const { return motion.nodes.back().time_s; }
};

/// Recordings of one rig with identical channels.
struct RecordedCase {
  std::vector<Channel> channels;      ///< channels of the rig
  std::vector<Recording> recordings;  ///< recordings, each with one series per channel
  double frame_s = 0;                 ///< median time between measurements of a channel, s
  bool has_clock = true;              ///< false: recordings without time stamps; times give the order of the stops only
  /// Returns whether a channel measures a heading.
  /// @return true if at least one does
  bool has_headings() const;
  /// Returns whether the recordings form two groups.
  /// @return true if at least one recording belongs to the second group
  bool two_groups() const;
  /// Computes the largest depth of insertion.
  /// @return maximum of the actuator position over all recordings, mm; at least 0
  double deepest_mm() const;
  /// Returns whether a recording retracts the needle by more than the smallest claimed standard deviation of a
  /// position.
  /// @return true if at least one does
  bool has_retraction() const;
  /// Counts the measurements in use.
  /// @return number of scalar measurements over all recordings and channels
  std::size_t measurements() const;
};

/// Messages of one log, input of make_case().
struct RawRecording {
  std::string name;                             ///< name of the recording
  std::vector<model::ActuatorState> actuators;  ///< actuator states, in any order
  std::vector<model::TipMeasurement> tips;      ///< tip positions in {A}, in any order
  std::vector<model::TipHeading> headings{};    ///< tip headings in {A}, in any order
  bool has_clock = true;                        ///< false: no time stamps, utime gives the order only
  bool changed = false;                         ///< whether it belongs to the second of two groups
};

/// Converts logs to a case for diagnose().
///
/// If one recording has no time stamps, all are treated as recordings without time stamps: each distinct time is one
/// stop, stops have equal intervals, and the needle is assumed to be guided by hand (scatter_near_entry.hpp).
/// @param raw messages of each recording; at least two recordings
/// @return recordings of one rig with identical channels
/// @throws bevel::ArgumentError with the name of the recording and the fault: no usable tip measurement, no motion,
///   clocks of camera and axes apart, fewer than two recordings, or recordings of different rigs (cameras that see
///   different axes, or frame periods or claimed noise that differ more than threefold). Also for a channel with fewer
///   than five measurements in its longest recording.
RecordedCase make_case(std::vector<RawRecording> raw);

}  // namespace bevel::diagnosis
