// SPDX-License-Identifier: MIT
#include <bevel/io/second_insertion.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <vector>

#include <bevel/error.hpp>

namespace bevel::io {

std::optional<std::size_t> second_insertion(std::span<const model::ActuatorState> actuators) {
  if (actuators.empty()) return std::nullopt;
  const double entry_mm = actuators.front().insertion_mm;
  bool was_inserted = false;
  std::optional<std::size_t> withdrawn;
  for (std::size_t i = 0; i < actuators.size(); ++i) {
    const double depth_mm = actuators[i].insertion_mm - entry_mm;
    if (depth_mm >= kInserted_mm && withdrawn) return withdrawn;
    was_inserted = was_inserted || depth_mm >= kInserted_mm;
    if (was_inserted && depth_mm <= kWithdrawn_mm &&
        (!withdrawn || actuators[i].insertion_mm <= actuators[*withdrawn].insertion_mm))
      withdrawn = i;
  }
  return std::nullopt;
}

void require_one_insertion(const std::string& name, std::span<const model::ActuatorState> actuators) {
  std::vector<model::ActuatorState> sorted(actuators.begin(), actuators.end());
  std::ranges::stable_sort(sorted, {}, &model::ActuatorState::utime);
  const auto second = second_insertion(sorted);
  if (!second) return;
  const double at_s = static_cast<double>(sorted[*second].utime - sorted.front().utime) * 1e-6;
  std::array<char, 400> text{};
  std::snprintf(
      text.data(), text.size(),
      ": holds more than one insertion: the needle is back at the entry point %.3f s after the first "
      "ACTUATOR_STATE, and is inserted again by more than %g mm. Allowed: one insertion in each log. Cut it with "
      "lcm-logfilter -c '.*' and -e %.3f or -s %.3f, which count from the log's first message",
      at_s, kInserted_mm, at_s, at_s);
  throw ParseError(name + text.data());
}

}  // namespace bevel::io
