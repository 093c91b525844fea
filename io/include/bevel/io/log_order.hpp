// SPDX-License-Identifier: MIT
// In which order a recording's messages stand in a log: tips, headings and axes as they came, the others where their
// times put them.
#pragma once

#include <cstdint>
#include <vector>

#include <bevel/io/recording.hpp>

namespace bevel::io {

struct Placed {
  enum class Channel : std::uint8_t { tip, heading, actuator, command, estimate, truth };
  std::int64_t time_us = 0;  // of receipt, of which a recording knows no more: the message's own, but none before the
                             // one before it on its channel (tips, headings and axes together)
  Channel channel = Channel::tip;
  std::size_t index = 0;  // into the recording's samples of that channel
};

// In order of time; of equal times in the order of Channel.
std::vector<Placed> log_order(const Recording& recording);

// The number of each sample's arrival among tips, headings and axes.
struct ArrivalNumbers {
  explicit ArrivalNumbers(const Recording& recording);
  std::vector<std::size_t> tips, headings, actuators;
};

// Collects samples read channel by channel, each with its number of arrival, into recording.arrivals.
class ArrivalsByNumber {
 public:
  void add(std::int64_t number, std::int64_t utime, Arrival where) { numbered_.push_back({number, utime, where}); }
  // Of equal number by time, and of equal times as they were added.
  std::vector<Arrival> sorted();

 private:
  struct Numbered {
    std::int64_t number, utime;
    Arrival where;
  };
  std::vector<Numbered> numbered_;
};

}  // namespace bevel::io
