// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <bevel/diagnosis/inference/forms.hpp>
#include <bevel/diagnosis/mismatch/found_effects.hpp>
#include <bevel/diagnosis/statistics/quantiles.hpp>

namespace bevel::diagnosis {

using inference::Form;

namespace {

constexpr std::size_t kProposals = 4;

std::string text(const char* format, double value) {
  char out[96];
  std::snprintf(out, sizeof out, format, value);
  return out;
}

std::string equation_of(const inference::FormFit& fit, const inference::Curve& curve) {
  const double low = curve.at.front(), range = curve.at.back() - low;
  const std::string from = text("(x - %.3g)", low);
  switch (fit.form) {
    case Form::step:
      return "a where x >= s, else 0";
    case Form::ramp:
      return "a max(0, x - s) / " + text("%.3g", range);
    case Form::power:
      return "a (" + from + " / " + text("%.3g", range) + ")^s";
    case Form::exponential:
      return "a exp(-" + from + " / s)";
    case Form::saturation:
      return "a (1 - exp(-" + from + " / s))";
    case Form::sinusoid:
      return "a sin(2 pi x / s + " + text("%.2f", fit.phase_rad) + ")";
  }
  return "";
}

// Whether the 95 % interval of the amplitude excludes none, and amplitude and value at each knot lie within what a
// model file may hold of the component.
bool is_possible(const inference::FormFit& fit, const inference::Curve& curve, model::DiscrepancyComponent component) {
  const double largest = info_of(component).largest;
  if (!(std::abs(fit.amplitude) > k95 * fit.amplitude_sd)) return false;
  if (!(std::abs(fit.amplitude) <= largest)) return false;
  return std::ranges::all_of(curve.at, [&](double x) {
    return std::abs(fit.amplitude * value_of(fit.form, curve, fit.shape, fit.phase_rad, x)) <= largest;
  });
}

}  // namespace

std::vector<ProposedForm> propose_forms(const NeedleSystem& system, const inference::Search& search,
                                        const ChosenModel& model) {
  std::vector<ProposedForm> out;
  const auto& curves = model.fit->scales.curves;
  for (std::size_t d = 0; d < curves.size(); ++d) {
    // About the needle, the effects and the other curves as they are beside this one, which is left to the forms.
    const inference::Fit beside = without_curve(search.discrepancy(), *model.fit, d);
    const inference::Marginal marginal(search.likelihood(), beside,
                                       search.discrepancy().columns(search.likelihood(), beside));
    const double all = log_bayes_factor(search.discrepancy().scan(marginal));
    std::size_t count = 0;
    for (const auto& fit : fit_forms(system, search.discrepancy(), marginal)) {
      const inference::Curve& curve = system.curves()[fit.curve];
      const model::DiscrepancyCurve model_curve = system.model_curve(fit.curve, {}, {});
      if (!is_possible(fit, curve, model_curve.component)) continue;
      if (count++ == kProposals) break;
      out.push_back({.component = model_curve.component,
                     .covariate = model_curve.covariate,
                     .form = fit.form,
                     .equation = equation_of(fit, curve),
                     .amplitude = fit.amplitude,
                     .amplitude_sd = fit.amplitude_sd,
                     .shape = fit.shape,
                     .shape_low = fit.shape_low,
                     .shape_high = fit.shape_high,
                     .log_bayes_factor = fit.log_bayes_factor - all,
                     .phase_rad = fit.phase_rad,
                     .low = curve.at.front(),
                     .range = curve.at.back() - curve.at.front(),
                     .periodic = curve.periodic,
                     .shapes = shape_grid(fit.form, curve),
                     .discrepancy = d});
    }
  }
  return out;
}

}  // namespace bevel::diagnosis
