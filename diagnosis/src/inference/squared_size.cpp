// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/squared_size.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

namespace bevel::inference {

SquaredSize::SquaredSize(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance,
                         const Eigen::MatrixXd& square) {
  const Eigen::LLT<Eigen::MatrixXd> root(covariance);
  const Eigen::MatrixXd inner = root.matrixU() * square * root.matrixL();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(inner);
  const Eigen::VectorXd turned = eigen.eigenvectors().transpose() * root.matrixL().solve(mean);
  for (Eigen::Index i = 0; i < turned.size(); ++i) add(std::max(0.0, eigen.eigenvalues()[i]), turned[i] * turned[i]);
}

void SquaredSize::add(double weight, double squared_mean) {
  double power = 1;
  for (std::size_t k = 0; k < cumulants_.size(); ++k) {
    power *= weight;
    cumulants_[k] += power * (1 + static_cast<double>(k + 1) * squared_mean);
  }
}

double SquaredSize::above(double value) const {
  constexpr double kManyDegrees = 1e4;  // from where on it is a normal one, to a hundredth
  const auto& [c1, c2, c3, c4] = cumulants_;
  if (!(c2 > 0)) return 0;
  const double skewness = c3 / std::pow(c2, 1.5), kurtosis = c4 / (c2 * c2);  // over sqrt(8) and 12
  const bool both = skewness * skewness > kurtosis;
  const double a = both ? 1 / (skewness - std::sqrt(skewness * skewness - kurtosis)) : 1 / skewness;
  const double noncentrality = both ? skewness * a * a * a - a * a : 0;
  const double degrees = both ? a * a - 2 * noncentrality : 1 / (skewness * skewness);
  if (degrees + noncentrality > kManyDegrees)
    return boost::math::cdf(boost::math::complement(boost::math::normal(c1, std::sqrt(2 * c2)), value));
  const double there = (value - c1) / std::sqrt(c2) * a + degrees + noncentrality;
  if (!(there > 0)) return 1;
  if (noncentrality > 0)
    return boost::math::cdf(
        boost::math::complement(boost::math::non_central_chi_squared(degrees, noncentrality), there));
  return boost::math::cdf(boost::math::complement(boost::math::chi_squared(degrees), there));
}

}  // namespace bevel::inference
