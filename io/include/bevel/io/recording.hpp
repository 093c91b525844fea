// SPDX-License-Identifier: MIT
/// \file
/// A complete log in memory as plain structures: decoded, checked, and compared sample by sample with its neighbours.
/// All programs that evaluate a log read it with read_recording().
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

/// Number of rejected messages of one channel, indexed by DecodeFault.
using RejectCounts = std::array<std::int64_t, kDecodeFaultCount>;

/// Position of a message in the order of arrival across channels.
struct Arrival {
  /// Channel of the message.
  enum class Channel : std::uint8_t {
    tip,      ///< TIP_MEASUREMENT
    heading,  ///< TIP_HEADING
    actuator  ///< ACTUATOR_STATE
  };
  Channel channel;    ///< channel of the message
  std::size_t index;  ///< index into Recording::tips, Recording::headings or Recording::actuators
};

/// Contents of one log.
///
/// The samples are in the order of the log. This is the order of arrival and can differ from the order of `utime`.
/// Implausible samples (plausibility.hpp) are not in the lists.
struct Recording {
  std::vector<model::TipMeasurement> tips;      ///< TIP_MEASUREMENT, tip positions in {A}, mm
  std::vector<model::TipHeading> headings;      ///< TIP_HEADING, unit vectors in {A}
  std::vector<model::ActuatorState> actuators;  ///< ACTUATOR_STATE, mm and rad
  std::vector<model::MotionCommand> commands;   ///< MOTION_COMMAND, mm/s and rad/s
  std::vector<steering_target_t> targets;       ///< STEERING_TARGET
  std::vector<needle_state_t> estimates;        ///< NEEDLE_STATE
  std::vector<needle_state_t> truths;           ///< NEEDLE_TRUTH
  std::string config;                           ///< text of the last CONFIG; "" if the log has none

  std::vector<Arrival> arrivals;  ///< order of arrival of tips, headings and actuators together

  std::map<std::string, RejectCounts> rejects;           ///< by channel; only channels with rejected messages
  std::map<std::string, std::int64_t> skipped_channels;  ///< messages of channels that this reader does not decode
  std::vector<Oddity> tip_oddities,  ///< implausible tip measurements that were removed, and jumps that persist
      heading_oddities,              ///< implausible headings that were removed, and jumps that persist
      actuator_oddities;             ///< implausible actuator states that were removed, and jumps that persist
  Coverage coverage;                 ///< times of tips and headings relative to those of the actuators
  std::string file_change;           ///< how the file changed while it was read; "" if it did not
  LogDamage damage;                  ///< bytes of the log that are not events
  std::int64_t out_of_order = 0;     ///< events that followed later ones of other channels; they are sorted by time
  std::int64_t events = 0;           ///< number of events on all channels
  std::int64_t bytes = 0;            ///< size of the log

  /// Returns the number of rejected messages on all channels.
  /// @return sum over all channels and faults
  std::int64_t rejected() const;
  /// Returns whether the recording is complete. Events that were sorted by time are not damage.
  /// @return true if nothing is damaged, rejected or implausible, and if no camera has more than kLargestShareOutside
  /// of its measurements outside the time of the actuators
  bool intact() const {
    return damage.intact() && rejected() == 0 && tip_oddities.empty() && heading_oddities.empty() &&
           actuator_oddities.empty() && coverage.faults.empty() && file_change.empty();
  }
  /// Lists the faults, one line for each kind.
  /// @return lines that end with a line feed; "" if the recording is intact
  std::string describe_faults() const;
  /// Formats describe_faults() for stderr.
  /// @param name  name of the log, at the start of each line
  /// @return "" if the recording is intact
  std::string remarks(const std::string& name) const;
  /// Reports how many events were sorted by time. No data are lost by sorting.
  /// @param name  name of the log, at the start of the line
  /// @return one line; "" if no event was sorted
  std::string order_note(const std::string& name) const;
  /// Returns the reason why the recording is unusable.
  ///
  /// Reasons are: no event; no usable message; an actuator motion beyond the bounds of plausibility.hpp that persists;
  /// no measurement within the time of the actuators; more than 20 % of a channel's samples implausible.
  /// @return "" if the recording is usable
  std::string refusal() const;
};

/// Reads a log from memory.
///
/// Damaged parts, rejected messages and implausible samples are left out and reported in the result. A log that another
/// tool sorted by channel is sorted by time of receipt, or by event time if that tool replaced the times of
/// receipt. A log counts as sorted by channel if each channel is in order and an event follows one of another channel
/// that is more than 1 s later.
/// @param log  bytes of the LCM log
/// @return the recording; Recording::refusal() tells whether it is usable
Recording read_recording(std::span<const std::uint8_t> log);
/// Reads a log file. Damage in the file is reported in the result.
/// @param path  a regular file of at most kLargestLog_bytes
/// @return the recording; Recording::refusal() tells whether it is usable
/// @throws IoError if the file cannot be read
Recording read_recording(const std::string& path);
/// Checks that a recording is usable.
/// @param name  name of the log for the error message
/// @param recording  recording to check
/// @throws ParseError with \p name and Recording::refusal() if the recording is unusable
void require_usable(const std::string& name, const Recording& recording);

}  // namespace bevel::io
