// SPDX-License-Identifier: MIT
/// @file
/// Unmodelled discrepancy: a sum of curves, each a Gaussian process of one covariate in one component (Kennedy and
/// O'Hagan 2001, J. R. Stat. Soc. B 63), linear through the sensitivities, in addition to any candidate model.
#pragma once
#include <span>

#include <bevel/diagnosis/inference/marginal.hpp>
#include <bevel/diagnosis/inference/squared_size.hpp>

namespace bevel::inference {

/// Scales that are integrated over (CurvePrior::scale), in standard deviations of the noise.
inline constexpr double kCurveScales[] = {0.25, 0.5, 1, 2, 4, 8, 16, 32, 64};
/// Correlation lengths that are integrated over (CurvePrior::length), as shares of the covariate's range.
inline constexpr double kCurveLengths[] = {1.0, 0.2};

/// Bayes factor of one curve.
struct CurveFactor {
  CurvePrior prior;             ///< Curve with its scale and length.
  double log_bayes_factor = 0;  ///< Natural log Bayes factor against no curve, or against no further curve.
  /// Squared signal-to-noise ratio of the curve after projection onto the orthogonal complement of the other unknowns,
  /// summed over all measurements.
  SquaredSize visible;
};

/// Curves of a system, prepared about a fit of the nominal model.
class Discrepancy {
 public:
  /// Computes the derivatives by all curves and their visible parts.
  /// @param likelihood Likelihood with the noise for scan().
  /// @param base Fit of the nominal model alone.
  Discrepancy(const Likelihood& likelihood, const Fit& base);

  /// Computes the columns of curves, curve after curve.
  /// @param likelihood Likelihood with the noise that whitens the columns; it may differ from that of the constructor.
  /// @param curves Priors of the curves.
  /// @param tangent Curve values about which the columns hold; null: zero.
  /// @return Columns; empty if \p curves is empty.
  CurveColumns columns(const Likelihood& likelihood, std::span<const CurvePrior> curves,
                       std::shared_ptr<const CurveTangent> tangent = nullptr) const;
  /// Computes the columns of a fit's curves.
  /// @param likelihood Likelihood with the noise that whitens the columns.
  /// @param fit Fit.
  /// @return Columns; empty if the fit has no curves.
  CurveColumns columns(const Likelihood& likelihood, const Fit& fit) const {
    return columns(likelihood, fit.scales.curves, fit.tangent);
  }
  /// Replaces one curve's block in the covariance of the values.
  /// @param curves Priors of all curves.
  /// @param which Index into \p curves.
  /// @param prior New prior of the curve.
  /// @param[in,out] covariance Covariance of all values.
  void set_prior(std::span<const CurvePrior> curves, std::size_t which, const CurvePrior& prior,
                 Eigen::MatrixXd& covariance) const;
  /// Computes the position of each curve's values among those of all curves.
  /// @param curves Priors of the curves.
  /// @return First index of each curve, then the number of values.
  std::vector<Eigen::Index> places(std::span<const CurvePrior> curves) const;
  /// Computes the Bayes factor of every curve at all scales and lengths, by the linear model and the constructor's
  /// noise.
  /// @param beside Marginal about the fit that the curve joins; its own curves are integrated out.
  /// @return Factors, the largest first; empty if \p beside is not valid or the system has no curves.
  std::vector<CurveFactor> scan(const Marginal& beside) const;
  /// Computes the likelihood of each curve's values in addition to a fit.
  /// @param beside Marginal about the fit.
  /// @return Quadratic log likelihood of each curve.
  std::vector<Marginal::Added> added(const Marginal& beside) const;
  /// Counts the combinations of curve, scale and length.
  /// @return Number of combinations.
  std::size_t choices() const { return first_.size() * std::size(kCurveScales) * std::size(kCurveLengths); }
  /// Computes the visible size of a sum of curves: the part that the nominal model's parameters do not absorb.
  /// @param curves Priors of the curves.
  /// @param values Values of all curves, curve after curve.
  /// @return Root mean square over the measurements, in standard deviations of the noise.
  double visible_size(std::span<const CurvePrior> curves, const Eigen::VectorXd& values) const;
  /// Computes the visible size of one curve.
  /// @param curve Index into System::curves().
  /// @param values Values of the curve.
  /// @return Root mean square over the measurements, in standard deviations of the noise.
  double visible_size(std::size_t curve, const Eigen::VectorXd& values) const;

 private:
  Eigen::MatrixXd unit_covariance(std::size_t curve, double length) const;
  // Mean product over measurements of the visible parts of two curves, as a bilinear form.
  Eigen::MatrixXd visible_together(std::size_t one, std::size_t other) const;

  const System* system_;
  std::vector<Eigen::Index> first_, size_;    // columns of each curve
  std::vector<Eigen::MatrixXf> raw_, white_;  // per recording, of all curves; raw_: with the outliers
  std::vector<Eigen::MatrixXf> square_;       // per recording: inner products within each curve, side by side
  std::vector<Eigen::MatrixXd> visible_;      // per curve: mean square over rows, as a quadratic form
  std::vector<Eigen::VectorXd> per_sd_;  // per recording: of its rows, 1 / standard deviation of the noise; outliers: 0
  Eigen::MatrixXd absorbed_, absorbing_;  // nominal parameters: (J'J)^-1 J'C and J'C of all curves
  double rows_ = 0;
};

}  // namespace bevel::inference
