#pragma once
// How often the 95 % intervals contain the truth, over simulated data sets.
#include <array>
#include <cmath>
#include <vector>

#include "diagnosis/identification/trajectory_fit.hpp"
#include "tests/identification/simulated_insertion.hpp"

namespace bevel::diagnosis {

struct Coverage {
  Parameter parameter;
  int inside = 0;
  int sets = 0;
  std::vector<double> z;  // (estimate - truth) / standard error, per set

  [[nodiscard]] double share() const { return static_cast<double>(inside) / sets; }
  // Wilson's 95 % interval of the share (Wilson 1927).
  [[nodiscard]] std::array<double, 2> wilson() const {
    constexpr double z2 = 1.96 * 1.96;
    const double n = sets;
    const double centre = (share() + z2 / (2 * n)) / (1 + z2 / n);
    const double half = 1.96 / (1 + z2 / n) * std::sqrt(share() * (1 - share()) / n + z2 / (4 * n * n));
    return {centre - half, centre + half};
  }
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
      for (const auto& p : fit.parameters) all.push_back({p.parameter, 0, 0, {}});
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto& p = fit.parameters[i];
      const double truth_value = values[p.parameter];
      all[i].inside += p.low95 <= truth_value && truth_value <= p.high95 ? 1 : 0;
      ++all[i].sets;
      all[i].z.push_back((p.value - truth_value) / p.std_error);
    }
  }
  return all;
}

}  // namespace bevel::diagnosis
