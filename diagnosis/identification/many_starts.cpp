#include <cmath>
#include <stdexcept>

#include "diagnosis/identification/trajectory_fit.hpp"

namespace bevel::diagnosis {

FitResult fit_from_many_starts(const std::vector<Insertion>& insertions, const FitOptions& options) {
  std::optional<FitResult> best;
  std::string refusal;
  const auto attempt = [&](const FitOptions& from) {
    try {
      FitResult r = fit_trajectory(insertions, from);
      // The scale is fitted too: compare by likelihood, n log s + cost.
      const auto badness = [](const FitResult& f) { return f.residual_count * std::log(f.noise_scale) + f.cost; };
      if (!best || badness(r) < badness(*best)) best = std::move(r);
    } catch (const std::invalid_argument& e) {
      refusal = e.what();
    }
  };
  attempt(options);
  if (options.fitted[kLambda1] && options.fitted[kLambda2])
    for (const auto& priors : {table_one_agar(), table_one_plastisol()}) {
      FitOptions from = options;
      from.start.lambda1_per_rad = priors[kLambda1]->mean;
      from.start.lambda2 = priors[kLambda2]->mean;
      attempt(from);
    }
  if (!best) throw std::invalid_argument(refusal);
  return *best;
}

namespace {
Priors table_one(double lambda1, double lambda2) {
  Priors priors;
  priors[kLambda1] = Prior{lambda1, 0.173};
  priors[kLambda2] = Prior{lambda2, 0.094};
  return priors;
}
}  // namespace

Priors table_one_agar() { return table_one(0.49, 0.22); }
Priors table_one_plastisol() { return table_one(0.144, 0.032); }

}  // namespace bevel::diagnosis
