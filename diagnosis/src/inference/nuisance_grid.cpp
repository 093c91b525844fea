// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/nuisance_grid.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::inference {

using Eigen::Index;

NuisanceGrid nuisance_grid(const System& system) {
  const auto& groups = system.nuisance_groups();
  Index count = 1;
  for (const auto& group : groups) count *= static_cast<Index>(group.standard_deviations.size());
  NuisanceGrid out{.standard_deviations = Eigen::MatrixXd(static_cast<Index>(groups.size()), count),
                   .log_prior = Eigen::VectorXd::Zero(count)};
  for (Index k = 0; k < count; ++k) {
    Index rest = k;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const auto& values = groups[g].standard_deviations;
      out.standard_deviations(static_cast<Index>(g), k) = values[static_cast<std::size_t>(rest) % values.size()];
      rest /= static_cast<Index>(values.size());
    }
    out.log_prior[k] = log_prior_of_spread(system, out.standard_deviations.col(k));
  }
  return out;
}

double negligible_of(const Eigen::VectorXd& weights) {
  constexpr double kNegligible = 1e-3;
  return weights.size() > 0 ? kNegligible * weights.maxCoeff() : 0;
}

double log_prior_of_spread(const System& system, const Eigen::VectorXd& nuisance_sd) {
  constexpr double kDiffer = 0.5;
  double share = kDiffer;
  for (const auto& group : system.nuisance_groups()) share /= static_cast<double>(group.standard_deviations.size());
  return std::log(nuisance_sd.isZero(0) ? 1 - kDiffer + share : share);
}

Eigen::VectorXd middle_nuisance_sd(const System& system) {
  Eigen::VectorXd out(static_cast<Index>(system.nuisance_groups().size()));
  for (Index g = 0; g < out.size(); ++g) {
    const auto& values = system.nuisance_groups()[static_cast<std::size_t>(g)].standard_deviations;
    out[g] = values[(values.size() - 1) / 2];
  }
  return out;
}

std::vector<Eigen::VectorXd> less_spread(const Eigen::VectorXd& nuisance_sd) {
  std::vector<Eigen::VectorXd> out;
  for (Index g = 0; g < nuisance_sd.size(); ++g) {
    if (nuisance_sd[g] == 0) continue;
    out.push_back(nuisance_sd);
    out.back()[g] = 0;
  }
  if (out.size() > 1) out.emplace_back(Eigen::VectorXd::Zero(nuisance_sd.size()));
  return out;
}

std::vector<Eigen::VectorXd> one_step_less_spread(const System& system, const Eigen::VectorXd& nuisance_sd) {
  std::vector<Eigen::VectorXd> out;
  for (Index g = 0; g < nuisance_sd.size(); ++g) {
    double smaller = -1;
    for (const double value : system.nuisance_groups()[static_cast<std::size_t>(g)].standard_deviations)
      if (value < nuisance_sd[g]) smaller = std::max(smaller, value);
    if (smaller < 0) continue;
    out.push_back(nuisance_sd);
    out.back()[g] = smaller;
  }
  return out;
}

Index column_of(const System& system, const Eigen::VectorXd& nuisance_sd) {
  const auto& groups = system.nuisance_groups();
  Index column = 0, stride = 1;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto& values = groups[g].standard_deviations;
    const auto at = std::find(values.begin(), values.end(), nuisance_sd[static_cast<Index>(g)]);
    if (at != values.end()) column += stride * (at - values.begin());
    stride *= static_cast<Index>(values.size());
  }
  return column;
}

Index apart(const System& system, Index a, Index b) {
  Index most = 0;
  for (const auto& group : system.nuisance_groups()) {
    const auto size = static_cast<Index>(group.standard_deviations.size());
    most = std::max(most, std::abs(a % size - b % size));
    a /= size, b /= size;
  }
  return most;
}

Eigen::VectorXd over_likely(const System& system, Index start, double far_below,
                            const std::function<double(Index)>& log_at) {
  std::vector<Index> sizes;
  Index count = 1;
  for (const auto& group : system.nuisance_groups()) {
    sizes.push_back(static_cast<Index>(group.standard_deviations.size()));
    count *= sizes.back();
  }
  constexpr double kNever = -std::numeric_limits<double>::infinity();
  Eigen::VectorXd out = Eigen::VectorXd::Constant(count, kNever);
  std::vector<bool> asked(static_cast<std::size_t>(count));
  std::vector<Index> next;
  for (const Index k : {start, Index{0}, column_of(system, middle_nuisance_sd(system))})
    if (!asked[static_cast<std::size_t>(k)]) next.push_back(k), asked[static_cast<std::size_t>(k)] = true;
  double most = kNever;
  while (!next.empty()) {
    for (const Index k : next) out[k] = log_at(k), most = std::max(most, out[k]);
    if (most == kNever) break;
    // What came too low before may not be so far below one that is known only now.
    next.clear();
    for (Index k = 0; k < count; ++k) {
      if (!asked[static_cast<std::size_t>(k)] || !(out[k] >= most - far_below)) continue;
      Index stride = 1;
      for (const Index size : sizes) {
        const Index which = k / stride % size;
        for (const Index step : {Index{-1}, Index{1}}) {
          const Index beside = k + step * stride;
          if (which + step < 0 || which + step >= size || asked[static_cast<std::size_t>(beside)]) continue;
          asked[static_cast<std::size_t>(beside)] = true;
          next.push_back(beside);
        }
        stride *= size;
      }
    }
  }
  return out;
}

}  // namespace bevel::inference
