#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "estimator/needle_filter.hpp"
#include "estimator/propagate.hpp"

namespace bevel::estimator {
namespace {

using model::Vector6d;

constexpr double kSmallStep = 0.25;  // squared, in standard deviations

// A linear filter of the error (pose in the body frame | parameters) about a given path, and of what the path's bend
// adds to it: the same filter, with the bend for its residuals.
struct LinearFilter {
  Vector9d error;
  Vector9d bend;
  Matrix9d covariance;

  void predict(const model::NeedleJacobian& j, const Vector9d& added) {
    const Eigen::Matrix<double, 6, 3> G = j.needle.leftCols<3>();
    for (Vector9d* e : {&error, &bend}) {
      const Vector6d moved = j.pose * e->head<6>();
      e->head<6>() = moved + G * e->tail<3>();
    }
    propagate<9>(covariance, j.pose, G);
    covariance.diagonal() += added;
  }

  // In information form on the seen axes, whatever the rank: S^-1 = (I + W H P H^T)^-1 W with W the information.
  void update(const Eigen::Matrix3d& R, const PastStep& step, const Eigen::Vector3d& residual,
              const Eigen::Vector3d& residual_of_bend) {
    // The point moves by R (v + omega x point) under a body perturbation.
    const Eigen::Matrix3d lever = model::hat(step.point_mm);
    Eigen::Matrix<double, 9, 3> by_body = covariance.leftCols<3>();
    by_body.noalias() += covariance.middleCols<3>(3).lazyProduct(lever);
    const Eigen::Matrix<double, 9, 3> PHt = by_body.lazyProduct(R.transpose());
    const Eigen::Matrix3d HPHt = R * (PHt.topRows<3>() - lever * PHt.middleRows<3>(3));
    const Eigen::Matrix3d weight =
        (Eigen::Matrix3d::Identity() + step.information_per_mm2 * HPHt).inverse() * step.information_per_mm2;
    const Eigen::Matrix<double, 9, 3> gain = PHt.lazyProduct(weight);
    const auto seen = [&](const Vector9d& e) -> Eigen::Vector3d { return R * (e.head<3>() - lever * e.segment<3>(3)); };
    error += gain * (residual - seen(error));
    bend += gain * (residual_of_bend - seen(bend));
    Matrix9d P = covariance;
    P.noalias() -= gain.lazyProduct(PHt.transpose());
    covariance = 0.5 * (P + P.transpose());
  }
};

Vector9d error_of_start(const FilterState& start, const FilterState& state, const model::Pose& entry) {
  Vector9d error;
  error << model::log_se3(entry.inverse() * start.pose), start.curvature_per_mm - state.curvature_per_mm,
      start.lambda1_per_rad - state.lambda1_per_rad, start.lambda2 - state.lambda2;
  return error;
}

}  // namespace

// Moves an estimate by an error in its body frame; the covariance is that of the error.
void NeedleFilter::shift(FilterState& state, const Vector9d& error, const Matrix9d& covariance) const {
  state.pose = state.pose * model::exp_se3(error.head<6>());
  state.pose.R = model::orthonormalised(state.pose.R);
  state.curvature_per_mm += error[6];
  state.lambda1_per_rad += error[7];
  state.lambda2 += error[8];
  Matrix9d to_pose = Matrix9d::Identity();
  to_pose.topLeftCorner<6, 6>() = model::right_jacobian_se3(error.head<6>());
  const Matrix9d P = to_pose * covariance * to_pose.transpose();
  state.covariance = 0.5 * (P + P.transpose());
}

// The path that leads to `state`, from its end: visit(index, step, pose) for each step that was measured.
template <class Visit>
bool NeedleFilter::walk_back(const FilterState& state, std::span<const PastStep> steps, model::Pose& entry,
                             Visit&& visit) const {
  model::SlipParameters slip = slip_;
  slip.lambda1_per_rad = state.lambda1_per_rad;
  slip.lambda2 = state.lambda2;
  const Eigen::Vector2d curvature(state.curvature_per_mm, 0);
  entry = state.pose;
  for (std::size_t i = steps.size(); i-- > 0;) {
    if (steps[i].measured) visit(i, steps[i], entry);
    if (!model::advance(entry, {-steps[i].insertion_mm, -steps[i].rotation_rad, curvature}, slip)) return false;
  }
  entry.R = model::orthonormalised(entry.R);
  return true;
}

// Half the squares of what the path to `state` leaves of the measurements and of `start`; infinity where there is no
// path. `entry` is the pose at its beginning.
double NeedleFilter::path_cost(const FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                               model::Pose& entry) const {
  double squares = 0;
  const auto add = [&squares](std::size_t, const PastStep& step, const model::Pose& pose) {
    const Eigen::Vector3d residual = step.position_mm - pose.p_mm - pose.R * step.point_mm;
    squares += residual.dot(step.information_per_mm2 * residual);
  };
  if (!walk_back(state, steps, entry, add)) return std::numeric_limits<double>::infinity();
  const Vector9d error = error_of_start(start, state, entry);
  return 0.5 * (squares + error.dot(start.covariance.ldlt().solve(error)));
}

// The direction `along` in which k and lambda are least known against their prior, one standard deviation of the end
// state long, and how the path bends there: room[i] is half the second difference of what step i measures, start_bend
// that of the error at the start.
bool NeedleFilter::bend(const FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                        std::span<Eigen::Vector3d> room, Vector9d& along, Vector9d& start_bend) const {
  const Prior& prior = config_.prior;
  const Eigen::Vector3d sd(prior.curvature_sd_per_mm, prior.lambda1_sd_per_rad, prior.lambda2_sd);
  const Eigen::Vector3d scale = (sd.array() > 0).select(sd.cwiseInverse(), 0);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(scale.asDiagonal() * state.covariance.bottomRightCorner<3, 3>() * scale.asDiagonal());
  const double variance = eigen.eigenvalues()[2];
  if (!(variance > 0)) return false;
  along = state.covariance.rightCols<3>() * scale.cwiseProduct(eigen.eigenvectors().col(2)) / std::sqrt(variance);

  start_bend.setZero();
  for (const double side : {1.0, -1.0}) {
    FilterState moved = state;
    moved.pose = moved.pose * model::exp_se3(side * along.head<6>());
    moved.curvature_per_mm += side * along[6];
    moved.lambda1_per_rad += side * along[7];
    moved.lambda2 += side * along[8];
    model::Pose entry;
    const auto add = [&room](std::size_t i, const PastStep& step, const model::Pose& pose) {
      room[i] += 0.5 * (pose.p_mm + pose.R * step.point_mm);
    };
    if (!walk_back(moved, steps, entry, add)) return false;
    start_bend += 0.5 * error_of_start(start, moved, entry);
  }
  return true;
}

bool NeedleFilter::relinearise(FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                               std::span<Eigen::Vector3d> room) const {
  model::Pose pose;
  const double cost_before = path_cost(state, start, steps, pose);
  if (!std::isfinite(cost_before)) return false;
  std::fill(room.begin(), room.begin() + static_cast<std::ptrdiff_t>(steps.size()), Eigen::Vector3d::Zero());
  Vector9d along, start_bend;
  const bool bent = bend(state, start, steps, room, along, start_bend);
  model::SlipParameters slip = slip_;
  slip.lambda1_per_rad = state.lambda1_per_rad;
  slip.lambda2 = state.lambda2;
  const Eigen::Vector2d curvature(state.curvature_per_mm, 0);

  LinearFilter linear;
  linear.error = error_of_start(start, state, pose);
  linear.bend = bent ? Vector9d(start_bend - linear.error) : Vector9d::Zero();
  // The error of `start` is about its own pose; here it is counted from the path's.
  Matrix9d to_path = Matrix9d::Identity();
  to_path.topLeftCorner<6, 6>() = model::right_jacobian_se3(linear.error.head<6>()).inverse();
  linear.covariance = to_path * start.covariance * to_path.transpose();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const PastStep& step = steps[i];
    model::NeedleJacobian jacobian;
    if (step.insertion_mm != 0 || step.rotation_rad != 0) {
      if (!model::advance(pose, {step.insertion_mm, step.rotation_rad, curvature}, slip, jacobian)) return false;
      linear.predict(jacobian, process_variance(linear.covariance, step.insertion_mm, step.rotation_rad));
    }
    if (!step.measured) continue;
    const Eigen::Vector3d point = pose.p_mm + pose.R * step.point_mm;
    linear.update(pose.R, step, step.position_mm - point,
                  bent ? Eigen::Vector3d(point - room[i]) : Eigen::Vector3d::Zero());
  }
  if (!linear.error.allFinite() || !linear.covariance.allFinite() || !linear.bend.allFinite()) return false;

  // Along the ridge u is unit normal, and the ridge lies off by bend u^2: mean and variance of that.
  Vector9d across = linear.bend;
  const Eigen::LDLT<Matrix9d> information(linear.covariance);
  across -= along * (along.dot(information.solve(across)) / along.dot(information.solve(along)));
  if (!across.allFinite()) across.setZero();
  const Matrix9d bent_covariance = linear.covariance + 2 * across * across.transpose();

  // Half the way, and half of that, where the whole step overshoots. Rounding, and process noise, for which a path
  // without it is no minimum, may raise the cost a little.
  for (int halving = 0; halving < 4; ++halving, linear.error *= 0.5) {
    FilterState moved = state;
    shift(moved, linear.error, bent_covariance);
    keep_in_domain(moved);
    // A step well within what is known is small against any bend, and needs no look at where it led.
    model::Pose entry;
    if (!(linear.error.dot(information.solve(linear.error)) < kSmallStep) &&
        !(path_cost(moved, start, steps, entry) <= 1.05 * cost_before + 1))
      continue;
    shift(moved, linear.bend, moved.covariance);
    keep_in_domain(moved);
    state = moved;
    return true;
  }
  return false;
}

}  // namespace bevel::estimator
