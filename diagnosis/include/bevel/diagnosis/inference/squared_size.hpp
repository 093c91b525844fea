// SPDX-License-Identifier: MIT
#pragma once
// How large a curve is that is known with errors: the distribution of a sum of squares of normals, sum_i w_i (z_i +
// m_i)^2, z_i standard normal and independent, by its first four cumulants (Liu, Tang and Zhang 2009, Computational
// Statistics and Data Analysis 53, 853: the noncentral chi-square that has the same skewness and nearest kurtosis).
#include <Eigen/Core>
#include <array>

namespace bevel::inference {

class SquaredSize {
 public:
  SquaredSize() = default;
  // Of v' square v, v normal with this mean and covariance (positive definite).
  SquaredSize(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& square);

  // One more term: its weight w >= 0, and m^2.
  void add(double weight, double squared_mean);
  double mean() const { return cumulants_[0]; }
  // Probability that it is above a value >= 0.
  double above(double value) const;

 private:
  std::array<double, 4> cumulants_{};  // the k-th is sum_i w_i^k (1 + k m_i^2): without the factors 2^(k - 1) (k - 1)!
};

}  // namespace bevel::inference
