// SPDX-License-Identifier: MIT
#include "proof/insertion_variation.hpp"

#include <Eigen/SVD>
#include <array>
#include <numbers>

namespace bevel::proof {

double& InsertionVariation::operator[](int i) {
  const std::array<double*, kCount> all{&curvature_share, &about_x_rad, &about_y_rad,
                                        &entry_x_mm,      &entry_y_mm,  &roll_rad};
  return *all.at(static_cast<std::size_t>(i));
}

double VariationSpread::operator[](int i) const {
  const std::array<double, InsertionVariation::kCount> all{curvature_share, entry_rad,       entry_rad,
                                                           registration_mm, registration_mm, roll_rad};
  return all.at(static_cast<std::size_t>(i));
}

VariationSpread draw_spread(Random& random) {
  const double degree = std::numbers::pi / 180;
  return {random.log_uniform(0.02, 0.15), random.log_uniform(0.2, 0.7) * degree, random.log_uniform(0.05, 0.4),
          random.log_uniform(0.01, 0.06)};
}

InsertionVariation draw_variation(const VariationSpread& spread, Random& random) {
  InsertionVariation out;
  for (int i = 0; i < InsertionVariation::kCount; ++i) out[i] = spread[i] * random.normal();
  return out;
}

Absorber::Absorber(const Eigen::MatrixXd& directions) {
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(directions, Eigen::ComputeThinU);
  basis_ = svd.matrixU();
  shrink_ = (1.0 + svd.singularValues().array().square()).rsqrt();
}

Eigen::VectorXd Absorber::operator()(const Eigen::VectorXd& whitened) const {
  if (basis_.size() == 0) return whitened;
  const Eigen::VectorXd along = basis_.transpose() * whitened;
  return whitened + basis_ * ((shrink_.array() - 1.0) * along.array()).matrix();
}

}  // namespace bevel::proof
