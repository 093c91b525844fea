#include "io/csv_stops.hpp"

#include <algorithm>
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

// The row about which half of the rows lie closest; the first of equals, since a depth is noted when it is reached.
const StopRow& most_crowded(const std::vector<const StopRow*>& rows, Eigen::Index still) {
  const StopRow* best = rows.front();
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> apart(rows.size());
  for (const StopRow* row : rows) {
    for (std::size_t k = 0; k < rows.size(); ++k) apart[k] = (rows[k]->reading - row->reading).head(still).norm();
    std::ranges::sort(apart);
    if (apart[(rows.size() - 1) / 2] < least) least = apart[(rows.size() - 1) / 2], best = row;
  }
  return *best;
}

}  // namespace

// Of one or two rows it is their mean; of many its variance is pi/2 times a mean's.
double Stop::information_share() const {
  const auto n = static_cast<double>(count);
  return count < 3 ? n : n * 2 / std::numbers::pi;
}

std::vector<Stop> find_stops(const std::vector<StopRow>& rows, Eigen::Index still, int& left_out) {
  std::vector<std::vector<const StopRow*>> groups;
  for (const StopRow& row : rows) {
    if (groups.empty() || groups.back().front()->depth_mm != row.depth_mm) groups.emplace_back();
    groups.back().push_back(&row);
  }
  std::vector<Eigen::VectorXd> centres;
  for (const auto& group : groups) centres.push_back(most_crowded(group, still).reading);
  std::vector<Stop> out;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    double step = std::numeric_limits<double>::infinity();
    for (const std::size_t other : {g - 1, g + 1})
      if (other < groups.size()) step = std::min(step, (centres[other] - centres[g]).head(still).norm());
    std::vector<const StopRow*> kept;
    for (const StopRow* row : groups[g])
      if ((row->reading - centres[g]).head(still).norm() <= kShareOfStep * step) kept.push_back(row);
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
