// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <bevel/diagnosis/identification/trajectory_fit.hpp>
#include <bevel/error.hpp>

namespace bevel::diagnosis {

FitResult fit_from_many_starts(const std::vector<Insertion>& insertions, const FitOptions& options) {
  std::vector<FitResult> fits;
  std::string refusal;
  const auto attempt = [&](const FitOptions& from) {
    try {
      fits.push_back(fit_trajectory(insertions, from));
    } catch (const ArgumentError& e) {
      refusal = e.what();
    }
  };
  attempt(options);
  if (fits.empty() && options.fitted[kNeedleCurvature]) {  // a needle as curved as the start leaves the domain of (25)
    FitOptions straight = options;
    straight.start.curvature_per_mm = 0;
    attempt(straight);
  }
  if (options.fitted[kNeedleLambda1] && options.fitted[kNeedleLambda2])
    for (const auto& priors : {table_one_agar(), table_one_plastisol()}) {
      FitOptions from = options;
      from.start.lambda1_per_rad = priors[kNeedleLambda1]->mean;
      from.start.lambda2 = priors[kNeedleLambda2]->mean;
      attempt(from);
    }
  // The bicycle is a corner of the extended model's domain: what it fits, the extended model must fit as well.
  if (options.fitted[kNeedleCurvature] && options.fitted[kNeedleLambda1]) {
    FitOptions bicycle = options;
    bicycle.start.lambda1_per_rad = bicycle.start.lambda2 = 0;
    bicycle.fitted[kNeedleLambda1] = bicycle.fitted[kNeedleLambda2] = bicycle.fitted[kNeedleWheelbase] = false;
    bicycle.start.curvature_per_mm = 0;
    FitOptions from = options;
    from.start.curvature_per_mm = fit_trajectory(insertions, bicycle).needle.curvature_per_mm;
    from.start.lambda1_per_rad = 0.01;
    if (options.fitted[kNeedleLambda2]) from.start.lambda2 = 0;
    if (!model::find_domain_violation(from.start)) attempt(from);
  }
  if (fits.empty()) throw ArgumentError(refusal);
  // Correlated residuals count less against the priors; by how much is taken from the least correlated fit, for all.
  double rho = 1;
  for (const auto& fit : fits) rho = std::min(rho, std::max(fit.lag1_correlation, 0.0));
  const auto badness = [&](const FitResult& f) { return f.deviance * (1 - rho) / (1 + rho) + f.prior_cost; };
  return *std::min_element(fits.begin(), fits.end(),
                           [&](const FitResult& a, const FitResult& b) { return badness(a) < badness(b); });
}

namespace {
Priors table_one(double lambda1, double lambda2) {
  Priors priors;
  priors[kNeedleLambda1] = Prior{lambda1, 0.173};
  priors[kNeedleLambda2] = Prior{lambda2, 0.094};
  return priors;
}
}  // namespace

Priors table_one_agar() { return table_one(0.49, 0.22); }
Priors table_one_plastisol() { return table_one(0.144, 0.032); }

}  // namespace bevel::diagnosis
