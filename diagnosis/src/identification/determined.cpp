// SPDX-License-Identifier: MIT
// A fit that holds the parameters that the recordings do not determine.
#include <algorithm>
#include <cstdio>

#include <bevel/diagnosis/identification/fit_statistics.hpp>
#include <bevel/diagnosis/identification/trajectory_fit.hpp>

namespace bevel::diagnosis {
namespace {

double& value_of(model::NeedleParameters& needle, Parameter parameter) {
  return parameter == kNeedleLambda1   ? needle.lambda1_per_rad
         : parameter == kNeedleLambda2 ? needle.lambda2
                                       : needle.wheelbase_mm;
}

void hold(Parameter parameter, const std::string& reason, FitOptions& options, std::vector<HeldParameter>& held) {
  double& value = value_of(options.start, parameter);
  const auto& prior = options.priors[parameter];
  if (prior) value = prior->mean;
  options.fitted[parameter] = false;
  held.push_back({parameter, value, prior.has_value(), reason});
}

double widest_roll_rad(const std::vector<Insertion>& insertions) {
  double widest_rad = 0;
  for (const Insertion& one : insertions) widest_rad = std::max(widest_rad, roll_range_rad(one));
  return widest_rad;
}

// The fitted parameter that the data determine least of those that they determine less than its prior does; null if
// that set is empty. A parameter at a bound has no standard error to judge by.
const FittedParameter* least_determined(const FitResult& fit, const FitOptions& options, double& prior_sd) {
  const FittedParameter* least = nullptr;
  double largest = 1;
  for (const FittedParameter& p : fit.parameters) {
    if (p.parameter == kNeedleCurvature || p.at_bound) continue;
    const auto& prior = options.priors[p.parameter];
    const double sd = prior ? prior->sigma : kPlausibleRange[p.parameter];
    if (!(p.data_std_error > largest * sd)) continue;
    largest = p.data_std_error / sd, prior_sd = sd, least = &p;
  }
  return least;
}

}  // namespace

bool separate_slip(const std::vector<Insertion>& insertions) {
  return widest_roll_rad(insertions) >= kSeparatingRoll_rad;
}

FitResult fit_determined(const std::vector<Insertion>& insertions, const FitOptions& options) {
  FitOptions now = options;
  std::vector<HeldParameter> held;
  char text[160];
  if (!options.fit_slip_in_plane && !separate_slip(insertions))
    for (const Parameter lambda : {kNeedleLambda1, kNeedleLambda2}) {
      if (!options.fitted[lambda]) continue;
      std::snprintf(text, sizeof text, "the shaft rotates by %.2g rad while it inserts; %.2g rad are required",
                    widest_roll_rad(insertions), kSeparatingRoll_rad);
      hold(lambda, text, now, held);
    }
  while (true) {
    FitResult fit = fit_from_many_starts(insertions, now);
    double prior_sd = 0;
    const FittedParameter* least = least_determined(fit, now, prior_sd);
    if (least == nullptr) {
      fit.held = std::move(held);
      return fit;
    }
    const bool has_prior = now.priors[least->parameter].has_value();
    std::snprintf(text, sizeof text, "the standard error by the data alone, %.2g, exceeds the %s of %.2g",
                  least->data_std_error, has_prior ? "prior's" : "plausible range", prior_sd);
    hold(least->parameter, text, now, held);
  }
}

}  // namespace bevel::diagnosis
