// SPDX-License-Identifier: MIT
#pragma once
// The discrepancy that nobody has a name for: a sum of curves, each a Gaussian process of one covariate in one
// component (Kennedy and O'Hagan 2001, J. R. Stat. Soc. B 63), linear through the sensitivities, beside any set of
// effects.
#include <span>

#include <bevel/diagnosis/inference/marginal.hpp>
#include <bevel/diagnosis/inference/squared_size.hpp>

namespace bevel::inference {

// Scales and lengths that are integrated over.
inline constexpr double kCurveScales[] = {0.25, 0.5, 1, 2, 4, 8, 16, 32, 64};
inline constexpr double kCurveLengths[] = {1.0, 0.2};

struct CurveFactor {
  CurvePrior prior;
  double log_bayes_factor = 0;  // against none, or none more
  // What of it the unknowns beside it do not absorb, squared, in variances of the noise, summed over all readings.
  SquaredSize visible;
};

class Discrepancy {
 public:
  // About a fit of the base alone.
  Discrepancy(const Likelihood& likelihood, const Fit& base);

  // Side by side, whitened by the noise of this likelihood, which may be another, about a tangent's values or none.
  // None of none.
  CurveColumns columns(const Likelihood& likelihood, std::span<const CurvePrior> curves,
                       std::shared_ptr<const CurveTangent> tangent = nullptr) const;
  // Those of a fit.
  CurveColumns columns(const Likelihood& likelihood, const Fit& fit) const {
    return columns(likelihood, fit.scales.curves, fit.tangent);
  }
  // The block of one of several curves in their values' covariance, by a prior.
  void set_prior(std::span<const CurvePrior> curves, std::size_t which, const CurvePrior& prior,
                 Eigen::MatrixXd& covariance) const;
  // Where the values of each of several curves begin among those of all, and at the end how many there are.
  std::vector<Eigen::Index> places(std::span<const CurvePrior> curves) const;
  // All curves at all scales and lengths beside a fit (with its own curves integrated out, if it has any), by the
  // linear model and the noise that this was made with: the likeliest first.
  std::vector<CurveFactor> scan(const Marginal& beside) const;
  // The likelihood of each curve's values beside a fit.
  std::vector<Marginal::Added> added(const Marginal& beside) const;
  std::size_t choices() const { return first_.size() * std::size(kCurveScales) * std::size(kCurveLengths); }
  // The root mean square over the readings, in standard deviations of the noise, of the part of a sum of curves, by all
  // their values, that the base's own parameters do not absorb.
  double visible_size(std::span<const CurvePrior> curves, const Eigen::VectorXd& values) const;
  double visible_size(std::size_t curve, const Eigen::VectorXd& values) const;

 private:
  Eigen::MatrixXd unit_covariance(std::size_t curve, double length) const;
  // Mean product over readings of the visible parts of two curves, as a bilinear form.
  Eigen::MatrixXd visible_together(std::size_t one, std::size_t other) const;

  const System* system_;
  std::vector<Eigen::Index> first_, size_;    // columns of each curve
  std::vector<Eigen::MatrixXf> raw_, white_;  // per recording, of all curves; raw_: with the outliers
  std::vector<Eigen::MatrixXf> square_;       // per recording: inner products within each curve, side by side
  std::vector<Eigen::MatrixXd> visible_;      // per curve: mean square over readings, as a quadratic form
  std::vector<Eigen::VectorXd> per_sd_;  // per recording: of its rows, 1 / standard deviation of the noise; outliers: 0
  Eigen::MatrixXd absorbed_, absorbing_;  // by the base's parameters: (J'J)^-1 J'C and J'C, of all curves
  double rows_ = 0;
};

}  // namespace bevel::inference
