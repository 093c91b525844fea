// SPDX-License-Identifier: MIT
#pragma once
// What one insertion has of its own, as on any rig: no two start alike or meet quite the same tissue.
#include <Eigen/Core>
#include <vector>

#include "proof/random.hpp"

namespace bevel::proof {

struct InsertionVariation {
  double curvature_share = 0;  // of the needle's
  double about_x_rad = 0;      // of the heading at the entry
  double about_y_rad = 0;
  double entry_x_mm = 0;  // registration
  double entry_y_mm = 0;
  double roll_rad = 0;  // of the bevel at the start
  static constexpr int kCount = 6;
  double& operator[](int i);
};

// Standard deviations, of one rig.
struct VariationSpread {
  double curvature_share = 0, entry_rad = 0, registration_mm = 0, roll_rad = 0;
  double operator[](int i) const;  // in the order of InsertionVariation
  bool any() const { return curvature_share > 0; }
};
VariationSpread draw_spread(Random& random);
InsertionVariation draw_variation(const VariationSpread& spread, Random& random);

// Takes out of whitened differences what variation between insertions explains as well: (I + U U')^(-1/2) for
// directions U, each of one standard deviation of the variation.
class Absorber {
 public:
  Absorber() = default;
  explicit Absorber(const Eigen::MatrixXd& directions);
  Eigen::VectorXd operator()(const Eigen::VectorXd& whitened) const;

 private:
  Eigen::MatrixXd basis_;   // orthonormal
  Eigen::VectorXd shrink_;  // of what lies along each
};

}  // namespace bevel::proof
