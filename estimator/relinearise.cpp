#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "estimator/needle_filter.hpp"
#include "estimator/propagate.hpp"

namespace bevel::estimator {
namespace {

using model::Matrix6d;
using model::Vector6d;

// A linear filter of the error (pose in the body frame | parameters) about a given path.
struct LinearFilter {
  Vector9d error;
  Matrix9d covariance;

  void predict(const model::NeedleJacobian& j, const Vector9d& added) {
    const Vector6d moved = j.pose * error.head<6>();
    error.head<6>() = moved + j.needle.leftCols<3>() * error.tail<3>();
    propagate<9>(covariance, j.pose, j.needle.leftCols<3>());
    covariance.diagonal() += added;
  }

  // In information form on the seen axes, whatever the rank: S^-1 = (I + W H P H^T)^-1 W with W the information.
  void update(const Eigen::Matrix3d& R, const Eigen::Vector3d& residual, const Eigen::Matrix3d& information) {
    const Eigen::Matrix<double, 9, 3> PHt = covariance.leftCols<3>().lazyProduct(R.transpose());
    const Eigen::Matrix3d HPHt = R * PHt.topRows<3>();
    const Eigen::Matrix3d weight = (Eigen::Matrix3d::Identity() + information * HPHt).inverse() * information;
    error += PHt * (weight * (residual - R * error.head<3>()));
    const Eigen::Matrix<double, 9, 3> gain = PHt * weight;
    Matrix9d P = covariance;
    P.noalias() -= gain.lazyProduct(PHt.transpose());
    covariance = 0.5 * (P + P.transpose());
  }
};

}  // namespace

// Half the squares of what the path to `state` leaves of the measurements and of `start`; infinity where there is no
// path. `entry` is the pose at its beginning.
double NeedleFilter::path_cost(const FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                               model::Pose& entry) const {
  model::SlipParameters slip = slip_;
  slip.lambda1_per_rad = state.lambda1_per_rad;
  slip.lambda2 = state.lambda2;
  const Eigen::Vector2d curvature(state.curvature_per_mm, 0);
  entry = state.pose;
  double squares = 0;
  for (std::size_t i = steps.size(); i-- > 0;) {
    const PastStep& step = steps[i];
    if (step.measured) {
      const Eigen::Vector3d residual = step.position_mm - entry.p_mm;
      squares += residual.dot(step.information_per_mm2 * residual);
    }
    if (!model::advance(entry, {-step.insertion_mm, -step.rotation_rad, curvature}, slip))
      return std::numeric_limits<double>::infinity();
  }
  entry.R = model::orthonormalised(entry.R);
  Vector9d error;
  error << model::log_se3(start.pose.inverse() * entry), state.curvature_per_mm - start.curvature_per_mm,
      state.lambda1_per_rad - start.lambda1_per_rad, state.lambda2 - start.lambda2;
  return 0.5 * (squares + error.dot(start.covariance.ldlt().solve(error)));
}

bool NeedleFilter::relinearise(FilterState& state, const FilterState& start, std::span<const PastStep> steps) const {
  model::Pose pose;
  const double cost_before = path_cost(state, start, steps, pose);
  if (!std::isfinite(cost_before)) return false;
  model::SlipParameters slip = slip_;
  slip.lambda1_per_rad = state.lambda1_per_rad;
  slip.lambda2 = state.lambda2;
  const Eigen::Vector2d curvature(state.curvature_per_mm, 0);

  LinearFilter linear;
  linear.error << model::log_se3(pose.inverse() * start.pose), start.curvature_per_mm - state.curvature_per_mm,
      start.lambda1_per_rad - state.lambda1_per_rad, start.lambda2 - state.lambda2;
  // The error of `start` is about its own pose; here it is counted from the path's.
  Matrix9d to_path = Matrix9d::Identity();
  to_path.topLeftCorner<6, 6>() = model::right_jacobian_se3(linear.error.head<6>()).inverse();
  linear.covariance = to_path * start.covariance * to_path.transpose();
  for (const PastStep& step : steps) {
    model::NeedleJacobian jacobian;
    if (step.insertion_mm != 0 || step.rotation_rad != 0) {
      if (!model::advance(pose, {step.insertion_mm, step.rotation_rad, curvature}, slip, jacobian)) return false;
      linear.predict(jacobian, process_variance(linear.covariance, step.insertion_mm, step.rotation_rad));
    }
    if (step.measured) linear.update(pose.R, step.position_mm - pose.p_mm, step.information_per_mm2);
  }
  if (!linear.error.allFinite() || !linear.covariance.allFinite()) return false;

  // Half the way, and half of that, where the whole step overshoots. Rounding, and process noise, for which a path
  // without it is no minimum, may raise the cost a little.
  for (int halving = 0; halving < 4; ++halving, linear.error *= 0.5) {
    FilterState moved = state;
    moved.pose = pose * model::exp_se3(linear.error.head<6>());
    moved.pose.R = model::orthonormalised(moved.pose.R);
    moved.curvature_per_mm += linear.error[6];
    moved.lambda1_per_rad += linear.error[7];
    moved.lambda2 += linear.error[8];
    Matrix9d to_pose = Matrix9d::Identity();
    to_pose.topLeftCorner<6, 6>() = model::right_jacobian_se3(linear.error.head<6>());
    const Matrix9d P = to_pose * linear.covariance * to_pose.transpose();
    moved.covariance = 0.5 * (P + P.transpose());
    keep_in_domain(moved);
    model::Pose entry;
    if (!(path_cost(moved, start, steps, entry) <= 1.05 * cost_before + 1)) continue;
    state = moved;
    return true;
  }
  return false;
}

}  // namespace bevel::estimator
