// SPDX-License-Identifier: MIT
#include <bevel/io/log_order.hpp>

#include <algorithm>
#include <tuple>

namespace bevel::io {

std::vector<Placed> log_order(const Recording& recording) {
  std::vector<Placed> order;
  order.reserve(recording.arrivals.size() + recording.commands.size() + recording.estimates.size() +
                recording.truths.size());
  std::int64_t now_us = 0;
  const auto add = [&](std::int64_t utime, Placed::Channel channel, std::size_t index) {
    order.push_back({now_us = std::max(now_us, utime), channel, index});
  };
  for (const Arrival& a : recording.arrivals) {
    if (a.channel == Arrival::Channel::tip) add(recording.tips[a.index].utime, Placed::Channel::tip, a.index);
    if (a.channel == Arrival::Channel::heading)
      add(recording.headings[a.index].utime, Placed::Channel::heading, a.index);
    if (a.channel == Arrival::Channel::actuator)
      add(recording.actuators[a.index].utime, Placed::Channel::actuator, a.index);
  }
  const auto add_all = [&](const auto& messages, Placed::Channel channel) {
    now_us = 0;
    for (std::size_t i = 0; i < messages.size(); ++i) add(messages[i].utime, channel, i);
  };
  add_all(recording.commands, Placed::Channel::command);
  add_all(recording.estimates, Placed::Channel::estimate);
  add_all(recording.truths, Placed::Channel::truth);
  std::ranges::stable_sort(order, {}, &Placed::time_us);
  return order;
}

ArrivalNumbers::ArrivalNumbers(const Recording& recording)
    : tips(recording.tips.size()), headings(recording.headings.size()), actuators(recording.actuators.size()) {
  for (std::size_t i = 0; i < recording.arrivals.size(); ++i) {
    const auto [channel, index] = recording.arrivals[i];
    auto& numbers = channel == Arrival::Channel::tip       ? tips
                    : channel == Arrival::Channel::heading ? headings
                                                           : actuators;
    numbers.at(index) = i;
  }
}

std::vector<Arrival> ArrivalsByNumber::sorted() {
  std::ranges::stable_sort(numbered_, {}, [](const Numbered& n) { return std::tuple(n.number, n.utime); });
  std::vector<Arrival> arrivals;
  arrivals.reserve(numbered_.size());
  for (const Numbered& n : numbered_) arrivals.push_back(n.where);
  return arrivals;
}

}  // namespace bevel::io
