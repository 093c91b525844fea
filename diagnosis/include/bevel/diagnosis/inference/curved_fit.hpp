// SPDX-License-Identifier: MIT
#pragma once
// The mode of a set beside a discrepancy that may be too large for the linear model about none.
#include <bevel/diagnosis/inference/discrepancy.hpp>

namespace bevel::inference {

// By the linear model about none; where the readings are not those that this says, or from a tangent's values on, by
// Levenberg and Marquardt's steps in the curves' values too. The fit's tangent is what it is linear about; null: none,
// which is enough where curves are small, and all there is where the system is linear in them.
Fit fit_beside_curves(const Likelihood& likelihood, const Discrepancy& discrepancy, const Layout& layout,
                      const Eigen::VectorXd& shared, const std::vector<Eigen::VectorXd>& local, const Scales& scales,
                      std::shared_ptr<const CurveTangent> tangent);

// Of curves with these priors, what fit_from() asks for: their columns about a fit's values.
CurveAt about_values(const Discrepancy& discrepancy, const Likelihood& likelihood, std::vector<CurvePrior> curves);

// Log evidence about a fit with each of kCurveScales x kCurveLengths (lengths the faster) for one of its curves, less
// that with those it has, by the linear model about the fit; what the linear model does not have is -infinity.
Eigen::VectorXd log_over_priors(const Discrepancy& discrepancy, const Fit& fit, const CurveColumns& curve,
                                std::size_t which);
// The best of them for every curve in turn, where one promises more than least_gain; else those of the fit.
std::vector<CurvePrior> likeliest_priors(const Discrepancy& discrepancy, const Fit& fit, CurveColumns curve,
                                         double least_gain);

// These values of these curves, one after the other, each by itself.
std::vector<CurveValues> values_by_curve(const Discrepancy& discrepancy, std::span<const CurvePrior> curves,
                                         const Eigen::VectorXd& values);
// About a fit's curve values, beside its unknowns. Null outside the model's domain.
std::shared_ptr<const CurveTangent> tangent_about(const Discrepancy& discrepancy, const Fit& fit);

}  // namespace bevel::inference
