// SPDX-License-Identifier: MIT
/// \file
/// Order of the messages of a recording in a log: tips, headings and actuator states in the order of arrival, all other
/// messages at their times.
#pragma once

#include <cstdint>
#include <vector>

#include <bevel/io/recording.hpp>

namespace bevel::io {

/// One message with its place in a log.
struct Placed {
  /// Channel of the message.
  enum class Channel : std::uint8_t {
    tip,       ///< TIP_MEASUREMENT
    heading,   ///< TIP_HEADING
    actuator,  ///< ACTUATOR_STATE
    command,   ///< MOTION_COMMAND
    estimate,  ///< NEEDLE_STATE
    truth      ///< NEEDLE_TRUTH
  };
  /// Assumed time of receipt, us since the epoch: the time of the message, or that of the message before it on its
  /// channel if that is later. Tips, headings and actuator states count as one channel.
  std::int64_t time_us = 0;
  Channel channel = Channel::tip;  ///< channel of the message
  std::size_t index = 0;           ///< index into the recording's samples of the channel
};

/// Computes the order of the messages in a log. Steering targets are not included.
/// @param recording  recording with its order of arrival
/// @return the messages in the order of time; at equal times those of Recording::arrivals come first, in their order,
/// then commands, estimates and truths
std::vector<Placed> log_order(const Recording& recording);

/// Positions of samples in the order of arrival of tips, headings and actuator states, from 0.
struct ArrivalNumbers {
  /// Computes the positions.
  /// @param recording  recording with its order of arrival
  explicit ArrivalNumbers(const Recording& recording);
  std::vector<std::size_t> tips,  ///< position of each tip measurement
      headings,                   ///< position of each heading
      actuators;                  ///< position of each actuator state
};

/// Computes Recording::arrivals from samples that are read channel by channel with their positions.
class ArrivalsByNumber {
 public:
  /// Adds a sample.
  /// @param number  position in the order of arrival
  /// @param utime  time of the sample, us since the epoch
  /// @param where  channel and index of the sample
  void add(std::int64_t number, std::int64_t utime, Arrival where) { numbered_.push_back({number, utime, where}); }
  /// Sorts the samples by position, then by time, then by the order of the calls of add().
  /// @return the value of Recording::arrivals
  std::vector<Arrival> sorted();

 private:
  struct Numbered {
    std::int64_t number, utime;
    Arrival where;
  };
  std::vector<Numbered> numbered_;
};

}  // namespace bevel::io
