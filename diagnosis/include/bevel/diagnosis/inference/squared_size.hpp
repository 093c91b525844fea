// SPDX-License-Identifier: MIT
/// @file
/// Size of a curve that is known with errors: distribution of a sum of squares of normal variables.
///
/// The sum is sum_i w_i (z_i + m_i)^2 with independent standard normal z_i. Its first four cumulants define a
/// noncentral chi-square of the same skewness and the nearest kurtosis (Liu, Tang and Zhang 2009, Computational
/// Statistics and Data Analysis 53, 853).
#pragma once
#include <Eigen/Core>
#include <array>

namespace bevel::inference {

/// Distribution of a weighted sum of squares.
class SquaredSize {
 public:
  SquaredSize() = default;
  /// Makes the distribution of v' square v for a normal vector v.
  /// @param mean Mean of v.
  /// @param covariance Covariance of v, positive definite.
  /// @param square Quadratic form.
  SquaredSize(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& square);

  /// Adds a term to the sum.
  /// @param weight Weight w_i, not negative.
  /// @param squared_mean m_i^2.
  void add(double weight, double squared_mean);
  /// Returns the mean of the sum.
  /// @return Mean.
  double mean() const { return cumulants_[0]; }
  /// Computes the probability that the sum exceeds a value.
  /// @param value Value, not negative.
  /// @return Probability, in [0, 1].
  double above(double value) const;

 private:
  std::array<double, 4> cumulants_{};  // the k-th is sum_i w_i^k (1 + k m_i^2): without the factors 2^(k - 1) (k - 1)!
};

}  // namespace bevel::inference
