// SPDX-License-Identifier: MIT
#pragma once
// Proposals of every form in every kind of component, over covariates of every kind between them.
#include <numbers>

#include <bevel/diagnosis/mismatch/effect_source.hpp>

namespace bevel::diagnosis::testing {

inline inference::Curve places_of(const ProposedForm& p) {
  inference::Curve curve{.component = "", .unit = "", .covariate = "", .at = {}, .periodic = p.periodic};
  for (int i = 0; i < 8; ++i) curve.at.push_back(p.low + p.range * i / 7);
  return curve;
}

inline std::vector<ProposedForm> proposed_cases() {
  using Component = model::DiscrepancyComponent;
  using Covariate = model::Covariate;
  struct Place {
    Component component;
    Covariate covariate;
    double low, range;
  };
  std::vector<ProposedForm> all;
  for (const Place& at : {Place{Component::curvature_bevel, Covariate::depth_mm, 0.5, 55},
                          Place{Component::advance, Covariate::depth_mm, 0.25, 60},
                          Place{Component::drift_across, Covariate::time_s, 0.125, 8},
                          Place{Component::y, Covariate::since_reversal_mm, -3.5, 20},
                          Place{Component::z, Covariate::since_speed_change_s, 0.1, 1.1},
                          Place{Component::curvature_across, Covariate::tip_yx_mm, -7.5, 7}})
    for (const auto form : {inference::Form::step, inference::Form::ramp, inference::Form::power,
                            inference::Form::exponential, inference::Form::saturation, inference::Form::sinusoid}) {
      ProposedForm p;
      p.component = at.component, p.covariate = at.covariate, p.form = form;
      p.low = at.low, p.range = at.range;
      p.equation = "as it would be";
      p.amplitude = (form == inference::Form::sinusoid ? -0.01 : 0.01) * info_of(at.component).largest;
      p.shapes = shape_grid(form, places_of(p));
      p.shape = p.shapes[p.shapes.size() / 2];
      p.phase_rad = 0.7;
      all.push_back(p);
    }
  // Round a circle, of which the period is no parameter.
  ProposedForm p;
  p.component = Component::turning_turning, p.covariate = Covariate::roll_rad, p.form = inference::Form::sinusoid;
  p.range = 2 * std::numbers::pi * 7 / 8, p.periodic = true;
  p.equation = "as it would be";
  p.amplitude = 0.05, p.shape = std::numbers::pi;
  p.shapes = shape_grid(p.form, places_of(p));
  all.push_back(p);
  return all;
}

}  // namespace bevel::diagnosis::testing
