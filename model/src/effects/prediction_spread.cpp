// SPDX-License-Identifier: MIT
#include <bevel/model/effects/prediction_spread.hpp>

#include <bevel/error.hpp>

namespace bevel::model {
namespace {

// Adds J diag(sd^2) J^T of each reading.
void add(const AugmentedNeedle& needle, const Motion& motion, const Eigen::VectorXd& sd, OpenLoop& path,
         std::vector<Eigen::Matrix3d>& sum) {
  if (!predict(needle, motion, path)) throw DomainError("the needle leaves the domain of the slip law (25)");
  for (std::size_t r = 0; r < sum.size(); ++r) {
    const Eigen::Matrix3Xd J = path.jacobian.middleRows<3>(static_cast<Eigen::Index>(3 * r)) * sd.asDiagonal();
    sum[r] += J * J.transpose();
  }
}

}  // namespace

std::vector<Eigen::Matrix3d> reading_covariances(const NeedleParameters& needle,
                                                 const std::vector<ActiveEffect>& effects,
                                                 const std::vector<DiscrepancyCurve>& discrepancies,
                                                 const Variation& variation, const Motion& motion) {
  std::vector<Eigen::Matrix3d> sum(motion.at.size(), Eigen::Matrix3d::Zero());
  std::vector<ActiveEffect> all = effects;
  for (const auto& curve : discrepancies) all.push_back(active_discrepancy(curve));
  OpenLoop path;

  Eigen::VectorXd sd(6);
  sd << variation.curvature_relative * std::abs(needle.curvature_per_mm), variation.entry_angle_rad,
      variation.entry_angle_rad, variation.roll_rad, variation.entry_point_mm, variation.entry_point_mm;
  const NeedleColumns own{.curvature = 0, .tilt_x = 1, .tilt_y = 2, .roll = 3, .entry_x = 4, .entry_y = 5};
  add(AugmentedNeedle(needle, all, 6, own), motion, sd, path, sum);

  for (std::size_t d = 0; d < discrepancies.size(); ++d) {
    const DiscrepancyCurve& curve = discrepancies[d];
    for (std::size_t first = 0; first < curve.at.size(); first += kKnotsOfPart) {
      const std::size_t knots = std::min(kKnotsOfPart, curve.at.size() - first);
      std::vector<ActiveEffect> with_part = all;
      ActiveEffect& part = with_part[effects.size() + d];
      part.owned = make_discrepancy(curve, first);
      part.effect = part.owned.get();
      sd.resize(static_cast<Eigen::Index>(knots));
      for (std::size_t k = 0; k < knots; ++k) {
        part.parameters[k] = Dual::unknown(0, static_cast<int>(k));
        sd[static_cast<Eigen::Index>(k)] = curve.std_errors[first + k];
      }
      add(AugmentedNeedle(needle, std::move(with_part), static_cast<int>(knots)), motion, sd, path, sum);
    }
  }
  return sum;
}

}  // namespace bevel::model
