// SPDX-License-Identifier: MIT
#pragma once
// The simplest equation of one covariate that does for a discrepancy what its curve does:
//   d(x) = a f(x; shape)
// with the amplitude integrated exactly, under the prior that a curve has (discrepancy.hpp), and the shape averaged
// over a grid. Each curve's component and covariate with each form is one hypothesis.
#include <string_view>

#include <bevel/diagnosis/inference/discrepancy.hpp>

namespace bevel::inference {

// x in the covariate's unit; low and range of the curve's places. Below low all but the sinusoid are as they are there.
enum class Form {
  step,         // 1 from x = shape on
  ramp,         // max(0, x - shape) / range
  power,        // ((x - low) / range)^shape
  exponential,  // exp(-(x - low) / shape)
  saturation,   // 1 - exp(-(x - low) / shape)
  sinusoid,     // sin(2 pi x / shape + phase)
};
std::string_view name_of(Form form);

struct FormFit {
  std::size_t curve = 0;  // whose component and covariate
  Form form = Form::step;
  double amplitude = 0, amplitude_sd = 0;           // in the component's unit, over the shapes
  double shape = 0, shape_low = 0, shape_high = 0;  // the likeliest, and 95 %
  double phase_rad = 0;                             // of a sinusoid
  double log_bayes_factor = 0;                      // against no discrepancy
};

double value_of(Form form, const Curve& curve, double shape, double phase_rad, double x);
// The shapes over which a form is averaged; none where it does not go round the curve's circle.
std::vector<double> shape_grid(Form form, const Curve& curve);

// Every form over every curve, the likeliest first. `beside`: what the readings leave to a discrepancy.
std::vector<FormFit> fit_forms(const System& system, const Discrepancy& discrepancy, const Marginal& beside);

// log Bayes factor of "one of these forms", each as likely beforehand, against no discrepancy; of "one of these
// curves".
double log_bayes_factor(const std::vector<FormFit>& forms);
double log_bayes_factor(const std::vector<CurveFactor>& curves);

}  // namespace bevel::inference
