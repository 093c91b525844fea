// SPDX-License-Identifier: MIT
#include <bevel/io/held_values.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bevel::io {
namespace {

// Intervals between changes, and the share of them that has to match a multiple of the period. Dropped updates and one
// late row are tolerated; an axis without a period has intervals of any length.
constexpr std::size_t kFewestIntervals = 10;
constexpr double kMatchingShare = 0.9;
// Rows see an update up to one row late, so that intervals differ by one row; a tolerance of a third of the period
// would accept any interval.
constexpr double kToleranceShare = 0.3;
// Mean number of rows in a period from which most rows repeat a value.
constexpr double kFewestRows = 1.75;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

std::optional<HeldValues> find_held_values(std::span<const std::int64_t> times_us, const std::vector<bool>& is_new) {
  const auto seconds = [&](std::size_t from, std::size_t to) {
    return static_cast<double>(times_us[to] - times_us[from]) * 1e-6;
  };
  std::vector<std::size_t> changes;
  std::vector<double> rows_s, intervals_s;
  for (std::size_t i = 1; i < times_us.size(); ++i) {
    rows_s.push_back(seconds(i - 1, i));
    if (!is_new[i]) continue;
    if (!changes.empty()) intervals_s.push_back(seconds(changes.back(), i));
    changes.push_back(i);
  }
  if (intervals_s.size() < kFewestIntervals) return std::nullopt;
  HeldValues held{.row_interval_s = median(rows_s), .is_update = std::vector<bool>(times_us.size(), false)};
  const double typical_s = median(intervals_s);
  double sum_s = 0, count = 0;  // without the intervals in which an update brought the same value
  for (const double interval_s : intervals_s)
    if (interval_s <= 1.5 * typical_s) sum_s += interval_s, ++count;
  held.period_s = sum_s / count;
  if (held.period_s < kFewestRows * held.row_interval_s) return std::nullopt;
  const double tolerance_s = std::min(1.01 * held.row_interval_s, kToleranceShare * held.period_s);
  const auto matches = [&](double interval_s) {
    const double periods = std::max(1.0, std::round(interval_s / held.period_s));
    return std::abs(interval_s - periods * held.period_s) <= tolerance_s;
  };
  if (static_cast<double>(std::ranges::count_if(intervals_s, matches)) <
      kMatchingShare * static_cast<double>(intervals_s.size()))
    return std::nullopt;
  // The row nearest to each whole period before a change, back to the change before it.
  std::size_t last = times_us.size();
  const auto mark_between = [&](std::size_t begin, std::size_t end, double end_s) {
    for (int periods = 1;; ++periods) {
      const double at_s = end_s - periods * held.period_s;  // since row `begin`
      if (at_s < (begin == 0 ? -tolerance_s : 0.5 * held.period_s)) return;
      std::size_t nearest = begin;
      for (std::size_t i = begin; i < end; ++i)
        if (std::abs(seconds(begin, i) - at_s) < std::abs(seconds(begin, nearest) - at_s)) nearest = i;
      held.is_update[nearest] = true;
    }
  };
  for (auto change = changes.rbegin(); change != changes.rend(); ++change) {
    // After the last change the next update is the first that the recording does not have.
    const bool is_last = last == times_us.size();
    const double end_s =
        is_last ? (std::floor(seconds(*change, last - 1) / held.period_s) + 1) * held.period_s : seconds(*change, last);
    held.is_update[*change] = true;
    mark_between(*change, last, end_s);
    last = *change;
  }
  mark_between(0, changes.front(), seconds(0, changes.front()));
  held.repeated = static_cast<std::size_t>(std::ranges::count(held.is_update, false));
  return held;
}

}  // namespace bevel::io
