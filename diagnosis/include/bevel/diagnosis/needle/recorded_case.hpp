#pragma once
// The recordings of one rig, as the mismatch tool sees them: the base's motion, and for each camera axis a series of
// readings. Everything later works on these.
#include <cmath>
#include <string>
#include <vector>

#include <bevel/diagnosis/inference/dataset.hpp>
#include <bevel/model/effects/open_loop.hpp>

namespace bevel::diagnosis {

// Variance of a channel's readings over that deep down: 1 + excess exp(-depth / length).
struct ScatterNearEntry {
  double excess = 0;
  double length_mm = 0;  // 0: as good everywhere
  double variance_at(double depth_mm) const { return length_mm > 0 ? 1 + excess * std::exp(-depth_mm / length_mm) : 1; }
  double sd_at_entry() const { return std::sqrt(variance_at(0)); }
};

// One direction in which one camera (or sensor) sees the tip's position, or the heading's unit vector. The information
// matrix gives them: its eigenvectors of nonzero information; of a heading, of its x and y components.
struct Channel {
  int camera = 0;
  Eigen::Vector3d axis;   // unit vector in {A}
  std::string name;       // "tip.y"; "tip[2].(0.71 0 0.71)" for a second camera or an oblique axis; "heading.x"
  double claimed_sd = 0;  // median of what the messages say, in the channel's unit
  bool heading = false;
  ScatterNearEntry scatter{};                                  // in the readings' claimed standard deviations already
  const char* unit() const { return heading ? "rad" : "mm"; }  // a small component of a unit vector is an angle
};

// One channel in one recording: message is an index into the recording's motion.at, measured is along the axis.
using inference::Series;

struct Recording {
  std::string name;
  model::Motion motion;
  std::vector<Series> series;                // one per channel of the case; may be empty
  std::vector<Eigen::Vector3d> position_mm;  // raw readings, one per motion.at, for pictures; NaN where it has none
  std::size_t skipped = 0;                   // measurements not used: status not 0, or no axis seen
  bool changed = false;                      // of the second group, where there are two
  double duration_s() const { return motion.nodes.back().time_s; }
};

struct RecordedCase {
  std::vector<Channel> channels;
  std::vector<Recording> recordings;
  double frame_s = 0;         // median time between readings of a channel
  bool has_clock = true;      // false: times are an order, and mean nothing else
  bool has_headings() const;  // of some channel
  bool two_groups() const;    // some recordings are of the second group
  double deepest_mm() const;  // of the base, in any recording
  /// Returns whether a recording retracts the needle by more than the smallest claimed standard deviation of a
  /// position.
  bool has_retraction() const;
  std::size_t measurements() const;  // scalar readings in use
};

struct RawRecording {
  std::string name;
  std::vector<model::ActuatorState> actuators;
  std::vector<model::TipMeasurement> tips;
  std::vector<model::TipHeading> headings{};
  bool has_clock = true;
  bool changed = false;
};

// Where one recording has no clock, none has: each different time of its readings is one stop, evenly apart, and the
// needle was guided by hand (scatter_near_entry.hpp).
// Throws std::invalid_argument, naming the recording and what is wrong: no usable tip measurement, no motion, clocks of
// camera and axes apart, fewer than two recordings, recordings of different rigs (cameras that see other axes, or frame
// periods or claimed noise that differ more than threefold).
RecordedCase make_case(std::vector<RawRecording> raw);

}  // namespace bevel::diagnosis
