// SPDX-License-Identifier: MIT
/// @file
/// Simplest equation of one covariate that replaces a discrepancy curve: d(x) = a f(x; shape).
///
/// The amplitude is integrated exactly with the prior of a curve (discrepancy.hpp); the shape is averaged over a grid.
/// Each combination of a curve's component and covariate with a form is one hypothesis.
#pragma once
#include <string_view>

#include <bevel/diagnosis/inference/discrepancy.hpp>

namespace bevel::inference {

/// Form of the equation. x is in the covariate's unit; low and range are those of the curve's nodes. Below low all
/// forms but the sinusoid keep their value at low.
enum class Form {
  step,         ///< 1 from x = shape on.
  ramp,         ///< max(0, x - shape) / range.
  power,        ///< ((x - low) / range)^shape.
  exponential,  ///< exp(-(x - low) / shape).
  saturation,   ///< 1 - exp(-(x - low) / shape).
  sinusoid,     ///< sin(2 pi x / shape + phase).
};
/// Returns the name of a form.
/// @param form Form.
/// @return Name.
std::string_view name_of(Form form);

/// Equation fitted in place of one curve.
struct FormFit {
  std::size_t curve = 0;        ///< Curve whose component and covariate the equation has.
  Form form = Form::step;       ///< Form.
  double amplitude = 0,         ///< Amplitude averaged over the shapes, in the component's unit.
      amplitude_sd = 0;         ///< Standard deviation of the amplitude, in the component's unit.
  double shape = 0,             ///< Most likely shape.
      shape_low = 0,            ///< Lower end of the shape's 95 % interval.
      shape_high = 0;           ///< Upper end of the shape's 95 % interval.
  double phase_rad = 0;         ///< Phase of a sinusoid, in rad.
  double log_bayes_factor = 0;  ///< Natural log Bayes factor against no discrepancy.
};

/// Computes f(x; shape).
/// @param form Form.
/// @param curve Curve that defines low and range.
/// @param shape Shape.
/// @param phase_rad Phase of a sinusoid, in rad.
/// @param x Covariate, in its unit.
/// @return Value, dimensionless.
double value_of(Form form, const Curve& curve, double shape, double phase_rad, double x);
/// Lists the shapes over which a form is averaged.
/// @param form Form.
/// @param curve Curve.
/// @return Shapes; empty if the form does not fit the circle of a periodic covariate.
std::vector<double> shape_grid(Form form, const Curve& curve);

/// Fits every form to every curve.
/// @param system Model.
/// @param discrepancy Prepared curves.
/// @param beside Marginal about the fit that the equation joins.
/// @return Fits, the most likely first.
std::vector<FormFit> fit_forms(const System& system, const Discrepancy& discrepancy, const Marginal& beside);

/// Computes the log Bayes factor of any of the given equations, equally likely a priori, against no discrepancy.
/// @param forms Fitted equations.
/// @return Natural log.
double log_bayes_factor(const std::vector<FormFit>& forms);
/// Computes the log Bayes factor of any of the given curves, equally likely a priori, against no discrepancy.
/// @param curves Curves.
/// @return Natural log.
double log_bayes_factor(const std::vector<CurveFactor>& curves);

}  // namespace bevel::inference
