// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/curved_fit.hpp>

#include <cmath>
#include <limits>

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kLinear = 0.5;  // of the cost: so near the linear model has to be
constexpr int kDamped = 12;      // steps; the next fit goes on

// What a fit's curves are there, without columns: derivatives by their values are not asked for.
std::shared_ptr<const CurveTangent> values_only(const Discrepancy& discrepancy, const Fit& fit) {
  auto out = std::make_shared<CurveTangent>();
  out->about = values_by_curve(discrepancy, fit.scales.curves, fit.curve_values);
  out->values = fit.curve_values;
  return out;
}

// What the nonlinear model says, where the curves have a fit's values.
double nonlinear_cost(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& fit,
                      const CurveColumns& curve) {
  CurveColumns about;
  about.covariance = curve.covariance;
  about.tangent = values_only(discrepancy, fit);
  return cost_at(likelihood, fit, about);
}

}  // namespace

VectorXd log_over_priors(const Discrepancy& discrepancy, const Fit& fit, const CurveColumns& curve, std::size_t which) {
  const auto blocks = linearise(*fit.likelihood, fit, curve);
  const auto log_with = [&](const CurvePrior& prior) {
    CurveColumns with = curve;
    discrepancy.set_prior(fit.scales.curves, which, prior, with.covariance);
    const ArrowSolution solution = solve_about(fit, blocks, with, std::vector<Index>{});
    return solution.valid ? -0.5 * (solution.least + solution.log_volume_ratio)
                          : -std::numeric_limits<double>::infinity();
  };
  VectorXd out = VectorXd::Constant(std::ssize(kCurveScales) * std::ssize(kCurveLengths),
                                    -std::numeric_limits<double>::infinity());
  if (blocks.empty()) return out;
  const CurvePrior& now = fit.scales.curves[which];
  const double here = log_with(now);
  Index i = 0;
  for (const double scale : kCurveScales)
    for (const double length : kCurveLengths) out[i++] = log_with({now.curve, scale, length}) - here;
  return out;
}

std::vector<CurvePrior> likeliest_priors(const Discrepancy& discrepancy, const Fit& fit, CurveColumns curve,
                                         double least_gain) {
  Fit now = fit;
  for (std::size_t k = 0; k < now.scales.curves.size(); ++k) {
    Index best = 0;
    if (!(log_over_priors(discrepancy, now, curve, k).maxCoeff(&best) > least_gain)) continue;
    now.scales.curves[k].scale = kCurveScales[best / std::ssize(kCurveLengths)];
    now.scales.curves[k].length = kCurveLengths[best % std::ssize(kCurveLengths)];
    discrepancy.set_prior(now.scales.curves, k, now.scales.curves[k], curve.covariance);
  }
  return now.scales.curves;
}

std::vector<CurveValues> values_by_curve(const Discrepancy& discrepancy, std::span<const CurvePrior> curves,
                                         const VectorXd& values) {
  std::vector<CurveValues> out;
  const auto at = discrepancy.places(curves);
  for (std::size_t i = 0; i < curves.size(); ++i)
    out.push_back({curves[i].curve, values.segment(at[i], at[i + 1] - at[i])});
  return out;
}

std::shared_ptr<const CurveTangent> tangent_about(const Discrepancy& discrepancy, const Fit& fit) {
  return make_tangent(fit.layout.system(), {fit.layout.set(), fit.shared, fit.local},
                      values_by_curve(discrepancy, fit.scales.curves, fit.curve_values));
}

CurveAt about_values(const Discrepancy& discrepancy, const Likelihood& likelihood, std::vector<CurvePrior> curves) {
  return [&discrepancy, &likelihood, curves = std::move(curves)](
             const Fit& at, bool derivatives) -> std::shared_ptr<const CurveColumns> {
    if (!derivatives) {
      CurveColumns there;
      there.tangent = values_only(discrepancy, at);
      return std::make_shared<const CurveColumns>(std::move(there));
    }
    auto about = tangent_about(discrepancy, at);
    if (!about) return nullptr;
    return std::make_shared<const CurveColumns>(discrepancy.columns(likelihood, curves, std::move(about)));
  };
}

Fit fit_beside_curves(const Likelihood& likelihood, const Discrepancy& discrepancy, const Layout& layout,
                      const VectorXd& shared, const std::vector<VectorXd>& local, const Scales& scales,
                      std::shared_ptr<const CurveTangent> tangent) {
  Fit here(layout);
  here.scales = scales;
  here.shared = shared, here.local = local;
  if (tangent) {
    here.curve_values = tangent->values;
  } else {
    const CurveColumns curve = discrepancy.columns(likelihood, scales.curves);
    Fit next = fit(likelihood, layout, shared, local, scales, curve);
    if (likelihood.system().is_linear_in_curves() || !next.valid) return next;
    const double cost = nonlinear_cost(likelihood, discrepancy, next, curve);
    if (std::abs(cost - next.cost) <= kLinear) return next;
    here.curve_values = VectorXd::Zero(curve.covariance.rows());
    // Where recordings do not differ, they do not at the beginning.
    for (VectorXd& own : here.local)
      for (std::size_t i = 0; i < likelihood.system().nuisances().size(); ++i)
        if (scales.nuisance_sd[static_cast<Index>(likelihood.system().nuisances()[i].group)] == 0)
          own[static_cast<Index>(i)] = 0;
    if (cost < nonlinear_cost(likelihood, discrepancy, here, curve)) here = std::move(next);
  }
  return fit_from(likelihood, std::move(here), about_values(discrepancy, likelihood, scales.curves),
                  {.max_iterations = kDamped});
}

}  // namespace bevel::inference
