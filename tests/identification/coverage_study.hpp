// SPDX-License-Identifier: MIT
#pragma once
// How often the 95 % intervals contain the truth, over simulated data sets.
#include <array>
#include <cmath>
#include <vector>

#include <bevel/diagnosis/identification/trajectory_fit.hpp>
#include "proof/intervals.hpp"
#include "tests/identification/simulated_insertion.hpp"

namespace bevel::diagnosis {

struct Coverage {
  Parameter parameter;
  proof::Share inside;
  std::vector<double> z;  // (estimate - truth) / standard error, per set
};

// Each set: three trials at 0.2 mm noise to depth, k, lambda1 and lambda2 fitted without priors from a wrong start.
inline std::vector<Coverage> coverage_study(const model::NeedleParameters& truth, int sets, std::uint64_t seed,
                                            const SimulatedInsertion& plan, int trials, const FitOptions& options) {
  std::mt19937_64 random(seed);
  std::vector<Coverage> all;
  const std::array<double, 4> values{truth.curvature_per_mm, truth.lambda1_per_rad, truth.lambda2, truth.wheelbase_mm};
  for (int k = 0; k < sets; ++k) {
    std::vector<Insertion> data;
    for (int i = 0; i < trials; ++i) data.push_back(simulate_insertion(truth, plan, random));
    const FitResult fit = fit_trajectory(data, options);
    if (all.empty())
      for (const auto& p : fit.parameters) all.push_back({p.parameter, {}, {}});
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto& p = fit.parameters[i];
      const double truth_value = values[p.parameter];
      all[i].inside.add(p.low95 <= truth_value && truth_value <= p.high95);
      all[i].z.push_back((p.value - truth_value) / p.std_error);
    }
  }
  return all;
}

}  // namespace bevel::diagnosis
