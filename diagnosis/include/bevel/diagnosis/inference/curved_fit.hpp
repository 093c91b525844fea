// SPDX-License-Identifier: MIT
/// @file
/// Mode of a candidate model with a discrepancy that may be too large for the linear model about zero.
#pragma once
#include <bevel/diagnosis/inference/discrepancy.hpp>

namespace bevel::inference {

/// Finds the mode by the linear model about zero curve values. If the nonlinear predictions differ from it, or a
/// tangent is given, Levenberg-Marquardt steps adjust the curve values too.
/// @param likelihood Likelihood.
/// @param discrepancy Prepared curves.
/// @param layout Layout of the candidate model.
/// @param shared Start values of the shared unknowns.
/// @param local Start values of the local unknowns, per recording.
/// @param scales Hyperparameters with the curves' priors.
/// @param tangent Tangent with the start values of the curves; null: zero.
/// @return Fit; its tangent is null where the linear model about zero suffices.
Fit fit_beside_curves(const Likelihood& likelihood, const Discrepancy& discrepancy, const Layout& layout,
                      const Eigen::VectorXd& shared, const std::vector<Eigen::VectorXd>& local, const Scales& scales,
                      std::shared_ptr<const CurveTangent> tangent);

/// Makes the function for fit_from() that computes the columns about a fit's curve values.
/// @param discrepancy Prepared curves; must outlive the result.
/// @param likelihood Likelihood that whitens the columns; must outlive the result.
/// @param curves Priors of the curves.
/// @return Function.
CurveAt about_values(const Discrepancy& discrepancy, const Likelihood& likelihood, std::vector<CurvePrior> curves);

/// Computes the log evidence for each scale and length of one curve minus that for its current prior, by the linear
/// model about a fit.
/// @param discrepancy Prepared curves.
/// @param fit Fit with its likelihood.
/// @param curve Columns of the fit's curves.
/// @param which Index into the fit's Scales::curves.
/// @return One natural log per combination of kCurveScales and kCurveLengths, lengths fastest; -infinity where the
/// linear model has no solution.
Eigen::VectorXd log_over_priors(const Discrepancy& discrepancy, const Fit& fit, const CurveColumns& curve,
                                std::size_t which);
/// Chooses the best scale and length of each curve in turn.
/// @param discrepancy Prepared curves.
/// @param fit Fit with its likelihood.
/// @param curve Columns of the fit's curves.
/// @param least_gain Gain in log evidence above which a prior changes.
/// @return Priors of all curves; those without enough gain are unchanged.
std::vector<CurvePrior> likeliest_priors(const Discrepancy& discrepancy, const Fit& fit, CurveColumns curve,
                                         double least_gain);

/// Splits a vector of curve values by curve.
/// @param discrepancy Prepared curves.
/// @param curves Priors of the curves.
/// @param values Values of all curves, curve after curve.
/// @return One entry per curve.
std::vector<CurveValues> values_by_curve(const Discrepancy& discrepancy, std::span<const CurvePrior> curves,
                                         const Eigen::VectorXd& values);
/// Computes the tangent about a fit's curve values and unknowns.
/// @param discrepancy Prepared curves.
/// @param fit Fit with curves.
/// @return Tangent; null outside the model's domain.
std::shared_ptr<const CurveTangent> tangent_about(const Discrepancy& discrepancy, const Fit& fit);

}  // namespace bevel::inference
