// SPDX-License-Identifier: MIT
// A whole log in memory, decoded, checked, and judged by its neighbours, as the plain structures of the core. Every
// tool that makes something of a log reads it here.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <bevel/io/checked_decode.hpp>
#include <bevel/io/log_reader.hpp>
#include <bevel/io/plausibility.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::io {

// Messages refused on one channel, by reason.
using RejectCounts = std::array<std::int64_t, kDecodeFaultCount>;

// Where a message of the log went: for what depends on the order of arrival across channels.
struct Arrival {
  enum class Channel : std::uint8_t { tip, heading, actuator };
  Channel channel;
  std::size_t index;  // into tips, headings or actuators
};

struct Recording {
  // Each in the order of the log, which is the order of arrival and need not be that of utime.
  std::vector<model::TipMeasurement> tips;
  std::vector<model::TipHeading> headings;
  std::vector<model::ActuatorState> actuators;
  std::vector<model::MotionCommand> commands;
  std::vector<steering_target_t> targets;
  std::vector<needle_state_t> estimates;  // NEEDLE_STATE
  std::vector<needle_state_t> truths;     // NEEDLE_TRUTH
  std::string config;                     // text of CONFIG; "" if the log has none

  std::vector<Arrival> arrivals;  // of tips, headings and actuators together

  std::map<std::string, RejectCounts> rejects;           // channel -> counts; only channels with rejects
  std::map<std::string, std::int64_t> skipped_channels;  // channels that this reader does not decode -> messages
  std::vector<Oddity> tip_oddities, heading_oddities, actuator_oddities;  // what was left out of each, and what lasts
  Coverage coverage;        // tips and headings relative to the time of the axes
  std::string file_change;  // how the file changed while it was read; "" if it did not
  LogDamage damage;
  std::int64_t out_of_order = 0;  // events that stood behind later ones of other channels; they are sorted by time
  std::int64_t events = 0;
  std::int64_t bytes = 0;

  std::int64_t rejected() const;
  bool intact() const {
    return damage.intact() && rejected() == 0 && tip_oddities.empty() && heading_oddities.empty() &&
           actuator_oddities.empty() && coverage.faults.empty() && file_change.empty();
  }
  std::string describe_faults() const;  // one line per kind of fault; "" if intact
  // The same for stderr: each line opens with the log's name.
  std::string remarks(const std::string& name) const;
  // A line on events that were sorted, "" if there are none. Nothing is lost by it: the recording counts as intact.
  std::string order_note(const std::string& name) const;
  // Why nothing can be made of it, "" if something can: no event, no usable message, a motion that no rig makes and
  // that lasts, no measurement within the time of the axes, or more than a fifth of a channel left out.
  std::string refusal() const;
};

Recording read_recording(std::span<const std::uint8_t> log);
// Throws IoError if the file cannot be read; damage inside it is reported in the result.
Recording read_recording(const std::string& path);
// Throws ParseError with the name and the refusal, if there is one.
void require_usable(const std::string& name, const Recording& recording);

}  // namespace bevel::io
