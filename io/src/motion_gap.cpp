// SPDX-License-Identifier: MIT
#include <bevel/io/motion_gap.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

namespace bevel::io {
namespace {

double seconds(std::int64_t from_us, std::int64_t to_us) { return static_cast<double>(to_us - from_us) * 1e-6; }

}  // namespace

double longest_interval_s(std::span<const model::ActuatorState> actuators, double shortest_s) {
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < actuators.size(); ++i)
    if (const double interval_s = seconds(actuators[i - 1].utime, actuators[i].utime); interval_s > 0)
      intervals_s.push_back(interval_s);
  if (intervals_s.empty()) return shortest_s;
  const auto middle = intervals_s.begin() + static_cast<std::ptrdiff_t>(intervals_s.size() / 2);
  std::ranges::nth_element(intervals_s, middle);
  return std::max(shortest_s, kGapPeriods * *middle);
}

std::optional<MotionGap> find_motion_gap(std::span<const model::ActuatorState> actuators) {
  const double allowed_s = longest_interval_s(actuators);
  for (std::size_t i = 1; i < actuators.size(); ++i) {
    const model::ActuatorState &before = actuators[i - 1], &after = actuators[i];
    const MotionGap gap{.after = i,
                        .gap_s = seconds(before.utime, after.utime),
                        .since_first_s = seconds(actuators.front().utime, before.utime),
                        .moved_mm = std::abs(after.insertion_mm - before.insertion_mm),
                        .turned_rad = std::abs(after.rotation_rad - before.rotation_rad),
                        .allowed_s = allowed_s};
    if (gap.gap_s > allowed_s && (gap.moved_mm > kMovedInGap_mm || gap.turned_rad > kTurnedInGap_rad)) return gap;
  }
  return std::nullopt;
}

std::string MotionGap::what() const {
  std::array<char, 400> text;
  std::snprintf(
      text.data(), text.size(),
      "no ACTUATOR_STATE for %.4g s, %.4g s after the first, while the base moved by %.4g mm and %.4g rad. "
      "The motion within is not known, and would be taken for missing physics. Allowed: gaps up to %.4g s, or "
      "longer ones with less than %.4g mm and %.4g rad of motion",
      gap_s, since_first_s, moved_mm, turned_rad, allowed_s, kMovedInGap_mm, kTurnedInGap_rad);
  return text.data();
}

}  // namespace bevel::io
