// SPDX-License-Identifier: MIT
// What a message about a configuration says: numbers, ranges, and the name that was probably meant.
#include <algorithm>
#include <charconv>
#include <cmath>

#include <bevel/io/config.hpp>

namespace bevel::io {

std::string format_number(double value) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return error == std::errc() ? std::string(buffer.data(), end) : std::to_string(value);
}

// Optimal string alignment: three rows of the usual table, the third for swapped neighbours.
std::size_t edit_distance(std::string_view given, std::string_view candidate) {
  std::vector<std::size_t> before_last(candidate.size() + 1);
  std::vector<std::size_t> last(candidate.size() + 1);
  std::vector<std::size_t> row(candidate.size() + 1);
  for (std::size_t j = 0; j <= candidate.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= given.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= candidate.size(); ++j) {
      const std::size_t replace = last[j - 1] + (given[i - 1] == candidate[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, replace});
      if (i > 1 && j > 1 && given[i - 1] == candidate[j - 2] && given[i - 2] == candidate[j - 1]) {
        row[j] = std::min(row[j], before_last[j - 2] + 1);
      }
    }
    before_last = last;
    last = row;
  }
  return last.back();
}

std::string nearest_name(std::string_view given, const std::vector<std::string>& candidates) {
  const auto nearest =
      std::ranges::min_element(candidates, {}, [&](const auto& candidate) { return edit_distance(given, candidate); });
  return nearest == candidates.end() ? "" : *nearest;
}

bool Range::contains(double value) const {
  if (!std::isfinite(value)) return false;
  return (lowest_open ? value > lowest : value >= lowest) && (highest_open ? value < highest : value <= highest);
}

std::string Range::describe() const { return describe_limits() + (reason ? std::string(": ") + reason : ""); }

std::string Range::describe_limits() const {
  const bool bounded_below = std::isfinite(lowest);
  const bool bounded_above = std::isfinite(highest);
  if (!bounded_below && !bounded_above) return "any finite number";
  const std::string low = format_number(lowest);
  const std::string high = format_number(highest);
  if (!bounded_above) return (lowest_open ? "above " : "at least ") + low;
  if (!bounded_below) return (highest_open ? "below " : "at most ") + high;
  if (lowest == highest) return "exactly " + low;
  return "from " + low + (lowest_open ? " (excluded)" : "") + " to " + high + (highest_open ? " (excluded)" : "");
}

}  // namespace bevel::io
