// SPDX-License-Identifier: MIT
#include "csv_stops.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace bevel::io {
namespace {

constexpr double kShareOfStep = 0.2;  // a row so far on the way to the next stop is moving; noise is a few times less

Eigen::VectorXd median_of(const std::vector<const StopRow*>& rows) {
  Eigen::VectorXd out(rows.front()->reading.size());
  std::vector<double> values(rows.size());
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    for (std::size_t k = 0; k < rows.size(); ++k) values[k] = rows[k]->reading[i];
    std::ranges::sort(values);
    out[i] = 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
  }
  return out;
}

using Group = std::vector<const StopRow*>;

// Of each row how far from it the nearest other of its group lies: where the needle lay still there are two, mostly; a
// row that is alone counts as half a step away.
std::vector<double> motions_of(const Group& group, Eigen::Index still, double step) {
  std::vector<double> out;
  for (const StopRow* row : group) {
    double nearest = group.size() > 1 ? 0.5 * step : 0;
    for (const StopRow* other : group)
      if (other != row) nearest = std::min(nearest, (other->reading - row->reading).head(still).norm());
    out.push_back(nearest);
  }
  return out;
}

// Of each group a row of its stop. Beside those there are rows on the way to the next and, since a depth is noted when
// the needle has reached it, rows that lie at the next already, at times more than at the stop itself. Of all ways to
// choose one row of each group, that in which they lie still and are as far apart as their depths, or nearly: least
// sum, by dynamic programming, of equals the first.
std::vector<const StopRow*> centres_of(const std::vector<Group>& groups, Eigen::Index still) {
  std::vector<std::vector<double>> least;      // of all groups up to this one, by this one's row
  std::vector<std::vector<std::size_t>> from;  // by which row of the group before
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const std::size_t other = g > 0 ? g - 1 : std::min(g + 1, groups.size() - 1);
    const double step = std::abs(groups[g].front()->depth_mm - groups[other].front()->depth_mm);
    least.push_back(motions_of(groups[g], still, step));
    from.emplace_back(groups[g].size(), 0);
    if (g == 0) continue;
    for (std::size_t i = 0; i < groups[g].size(); ++i) {
      double best = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < groups[g - 1].size(); ++j) {
        const double apart = (groups[g][i]->reading - groups[g - 1][j]->reading).head(still).norm();
        const double sum = least[g - 1][j] + std::max(0.0, std::abs(apart - step) - kShareOfStep * step);
        if (sum < best) best = sum, from[g][i] = j;
      }
      least[g][i] += best;
    }
  }
  std::vector<const StopRow*> out(groups.size());
  std::size_t at =
      groups.empty() ? 0 : static_cast<std::size_t>(std::ranges::min_element(least.back()) - least.back().begin());
  for (std::size_t g = groups.size(); g-- > 0; at = from[g][at]) out[g] = groups[g][at];
  return out;
}

}  // namespace

// Of one or two rows it is their mean; of many its variance is pi/2 times a mean's.
double Stop::information_share() const {
  const auto n = static_cast<double>(count);
  return count < 3 ? n : n * 2 / std::numbers::pi;
}

std::vector<Stop> find_stops(const std::vector<StopRow>& rows, Eigen::Index still, int& left_out) {
  std::vector<Group> groups;
  for (const StopRow& row : rows) {
    if (groups.empty() || groups.back().front()->depth_mm != row.depth_mm) groups.emplace_back();
    groups.back().push_back(&row);
  }
  const auto centres = centres_of(groups, still);
  std::vector<Stop> out;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    double step = std::numeric_limits<double>::infinity();
    for (const std::size_t other : {g - 1, g + 1})
      if (other < groups.size())
        step = std::min(step, (centres[other]->reading - centres[g]->reading).head(still).norm());
    Group kept;
    for (const StopRow* row : groups[g])
      if ((row->reading - centres[g]->reading).head(still).norm() <= kShareOfStep * step) kept.push_back(row);
    left_out += static_cast<int>(groups[g].size() - kept.size());
    if (kept.empty()) continue;
    out.push_back({.depth_mm = groups[g].front()->depth_mm,
                   .reading = median_of(kept),
                   .count = kept.size(),
                   .first_row = groups[g].front()->row});
  }
  return out;
}

}  // namespace bevel::io
