// SPDX-License-Identifier: MIT
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <bevel/estimator/error_state.hpp>
#include <bevel/estimator/propagate.hpp>
#include <bevel/model/motion_direction.hpp>

namespace bevel::estimator {

// A linear filter of the error (pose in the body frame | parameters) about a given path.
template <int kSize>
struct LinearFilter {
  Error<kSize> error;
  Covariance<kSize> covariance;
  double log_evidence = 0;  // of the measurements, up to what is the same for every path

  void predict(const model::NeedleJacobian& j, const Error<kSize>& added) {
    const Eigen::Matrix<double, 6, kSize - 6> G = j.needle.leftCols<kSize - 6>();
    const model::Vector6d moved = j.pose * error.template head<6>();
    error.template head<6>() = moved + G * error.template tail<kSize - 6>();
    propagate<kSize>(covariance, j.pose, G);
    covariance.diagonal() += added;
  }

  void update(const PastStep& step, const WalkedStep& walked, const model::SlipParameters& slip) {
    if (step.measured) update<true>(walked.R, step.point_mm, step.information_per_mm2, walked.residual_mm);
    if (step.heading.measured)
      update<false>(walked.R, Eigen::Vector3d::UnitZ() + step.heading.offset, step.heading.information_per_rad2,
                    walked.residual_rad);
    if (step.motion.measured) update_motion(step.motion, walked, slip);
  }

  // Of the way the tip moves, which depends on lambda too.
  void update_motion(const DirectionReading& reading, const WalkedStep& walked, const model::SlipParameters& slip) {
    model::MotionDirection motion;
    if (!model::motion_direction(walked.R, slip, motion)) return;
    const Eigen::Matrix3d by_turn = walked.R * (motion.by_turn - model::hat(reading.offset));
    const Eigen::Matrix<double, 3, 2> by_slip = walked.R * motion.by_slip;
    Eigen::Matrix<double, kSize, 3> PHt = covariance.template middleCols<3>(3).lazyProduct(by_turn.transpose());
    PHt.noalias() += covariance.template middleCols<2>(7).lazyProduct(by_slip.transpose());
    const Eigen::Matrix3d HPHt = by_turn * PHt.template middleRows<3>(3) + by_slip * PHt.template middleRows<2>(7);
    const Eigen::Vector3d moved = by_turn * error.template segment<3>(3) + by_slip * error.template segment<2>(7);
    take(PHt, HPHt, reading.information_per_rad2, walked.motion_residual_rad - moved);
  }

  // A point of the body moves by R (v + omega x arm) under a body perturbation, a direction without the v.
  // In information form on the seen axes, whatever the rank: S^-1 = (I + W H P H^T)^-1 W with W the information.
  template <bool kPoint>
  void update(const Eigen::Matrix3d& R, const Eigen::Vector3d& arm, const Eigen::Matrix3d& information,
              const Eigen::Vector3d& residual) {
    using Columns = Eigen::Matrix<double, kSize, 3>;
    const Eigen::Matrix3d lever = model::hat(arm);
    Columns by_body = Columns::Zero();
    if constexpr (kPoint) by_body = covariance.template leftCols<3>();
    by_body.noalias() += covariance.template middleCols<3>(3).lazyProduct(lever);
    const Columns PHt = by_body.lazyProduct(R.transpose());
    Eigen::Matrix3d HPHt = -lever * PHt.template middleRows<3>(3);
    Eigen::Vector3d moved = -lever * error.template segment<3>(3);
    if constexpr (kPoint) {
      HPHt += PHt.template topRows<3>();
      moved += error.template head<3>();
    }
    take(PHt, R * HPHt, information, residual - R * moved);
  }

  void take(const Eigen::Matrix<double, kSize, 3>& PHt, const Eigen::Matrix3d& HPHt, const Eigen::Matrix3d& information,
            const Eigen::Vector3d& innovation) {
    const Eigen::Matrix3d spread = Eigen::Matrix3d::Identity() + information * HPHt;
    const Eigen::Matrix3d weight = spread.inverse() * information;
    log_evidence -= 0.5 * (innovation.dot(weight * innovation) + std::log(spread.determinant()));
    const Eigen::Matrix<double, kSize, 3> gain = PHt.lazyProduct(weight);
    error += gain * innovation;
    Covariance<kSize> P = covariance;
    P.noalias() -= gain.lazyProduct(PHt.transpose());
    covariance = 0.5 * (P + P.transpose());
  }

  // Given that the error along `normal` is zero. The evidence takes in how probable that was.
  void condition(const Error<kSize>& normal) {
    const Error<kSize> Pn = covariance * normal;
    const double variance = normal.dot(Pn), off = normal.dot(error);
    log_evidence -= 0.5 * (off * off / variance + std::log(variance));
    error -= Pn * (off / variance);
    covariance -= Pn * Pn.transpose() / variance;
  }

  // The covariance in other coordinates of the pose's error.
  void turn(const model::Matrix6d& by) {
    Covariance<kSize> T = Covariance<kSize>::Identity();
    T.template topLeftCorner<6, 6>() = by;
    const Covariance<kSize> P = T * covariance * T.transpose();
    covariance = 0.5 * (P + P.transpose());
  }
};

namespace {

constexpr double kKnown = 1e-12;  // variance against the prior's

Eigen::Vector3d heading_residual(const DirectionReading& reading, const Eigen::Matrix3d& R) {
  return reading.seen - R * (Eigen::Vector3d::UnitZ() + reading.offset);
}

// Outside the slip law's domain there is no answer, and the cost of such a path is none either.
Eigen::Vector3d motion_residual(const DirectionReading& reading, const Eigen::Matrix3d& R,
                                const model::SlipParameters& slip) {
  model::MotionDirection motion;
  if (!model::motion_direction(R, slip, motion))
    return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return reading.seen - R * (motion.along + reading.offset);
}

bool moves(const PastStep& step) { return step.insertion_mm != 0 || step.rotation_rad != 0; }

// Derivatives of a step from those of the step that undoes it.
model::NeedleJacobian inverse(const model::NeedleJacobian& back) {
  const Eigen::Matrix3d R = back.pose.topLeftCorner<3, 3>().transpose();
  const Eigen::Matrix3d Y = back.pose.bottomRightCorner<3, 3>().inverse();
  const Eigen::Matrix3d X = -(R * (back.pose.topRightCorner<3, 3>() * Y));
  model::NeedleJacobian forwards;
  forwards.pose << R, X, Eigen::Matrix3d::Zero(), Y;
  forwards.needle.topRows<3>() = -(R.lazyProduct(back.needle.topRows<3>()));
  forwards.needle.topRows<3>() -= X.lazyProduct(back.needle.bottomRows<3>());
  forwards.needle.bottomRows<3>() = -(Y.lazyProduct(back.needle.bottomRows<3>()));
  return forwards;
}

// Gauss and Hermite's rule of three for a unit normal density.
struct Place {
  double at, weight;
};
constexpr std::array<Place, 3> kPlaces{{{0, 2.0 / 3}, {1.7320508075688772, 1.0 / 6}, {-1.7320508075688772, 1.0 / 6}}};

// The directions in which the parameters are least known against their prior, one for nine states, with ell two: by
// `normal` a place along one is read off an error, `along` is the error that one standard deviation of it brings.
template <int kSize>
struct Ridge {
  static constexpr int kDirections = kSize - 8;
  Eigen::Matrix<double, kSize, kDirections> normal, along;
  int directions = 0;  // no more than there are unknown parameters
};

template <int kSize>
Ridge<kSize> find_ridge(const FilterState& state, const Prior& prior) {
  constexpr int kParameters = kSize - 6;
  using Vector = Eigen::Matrix<double, kParameters, 1>;
  Vector sd;
  sd.template head<3>() << insertion_curvature_sd_per_mm(prior), prior.lambda1_sd_per_rad, prior.lambda2_sd;
  if constexpr (kSize == 10) sd[3] = prior.wheelbase_sd_mm;
  const Vector scale = (sd.array() > 0).select(sd.cwiseInverse(), 0);
  const auto& P = covariance_of<kSize>(state);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, kParameters, kParameters>> eigen(
      scale.asDiagonal() * P.template bottomRightCorner<kParameters, kParameters>() * scale.asDiagonal());
  Ridge<kSize> ridge;
  ridge.normal.setZero();
  for (int i = 0; i < Ridge<kSize>::kDirections; ++i) {
    const double variance = eigen.eigenvalues()[kParameters - 1 - i];
    if (!(variance > kKnown)) break;
    ridge.normal.col(i).template tail<kParameters>() =
        scale.cwiseProduct(eigen.eigenvectors().col(kParameters - 1 - i));
    ridge.along.col(i) = P * ridge.normal.col(i) / std::sqrt(variance);
    ++ridge.directions;
  }
  return ridge;
}

}  // namespace

// Half the squares of what the path to `state` leaves of the measurements and of `start`; infinity where there is no
// path.
template <int kSize>
double NeedleFilter::path_cost(const FilterState& state, const FilterState& start,
                               std::span<const PastStep> steps) const {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const model::SlipParameters slip = slip_of(state);
  FilterState entry = state;
  double squares = 0;
  for (std::size_t i = steps.size(); i-- > 0;) {
    const PastStep& step = steps[i];
    if (step.measured) {
      const Eigen::Vector3d residual = step.position_mm - entry.pose.p_mm - entry.pose.R * step.point_mm;
      squares += residual.dot(step.information_per_mm2 * residual);
    }
    if (step.heading.measured) {
      const Eigen::Vector3d residual = heading_residual(step.heading, entry.pose.R);
      squares += residual.dot(step.heading.information_per_rad2 * residual);
    }
    if (step.motion.measured) {
      const Eigen::Vector3d residual = motion_residual(step.motion, entry.pose.R, slip);
      squares += residual.dot(step.motion.information_per_rad2 * residual);
    }
    if (!model::advance(entry.pose, {-step.insertion_mm, -step.rotation_rad, {state.curvature_per_mm, 0}}, slip))
      return kNone;
  }
  const Error<kSize> error = difference<kSize>(entry, start);
  return 0.5 * (squares + error.dot(covariance_of<kSize>(start).ldlt().solve(error)));
}

// The linear filter over the steps, about the path that leads to `about`, and that path's cost as above; false where
// there is none. The path is walked once, backwards, and leaves in `walked` what the filter needs on its way forwards.
template <int kSize>
bool NeedleFilter::run_again(const FilterState& about, const FilterState& start, std::span<const PastStep> steps,
                             std::span<WalkedStep> walked, LinearFilter<kSize>& linear, double& cost) const {
  const model::SlipParameters slip = slip_of(about);
  const Eigen::Vector2d curvature(about.curvature_per_mm, 0);
  FilterState entry = about;
  model::Pose& pose = entry.pose;
  double squares = 0;
  for (std::size_t i = steps.size(); i-- > 0;) {
    const PastStep& step = steps[i];
    WalkedStep& back = walked[i];
    if (step.has_reading()) back.R = pose.R;
    if (step.measured) {
      back.residual_mm = step.position_mm - pose.p_mm - pose.R * step.point_mm;
      squares += back.residual_mm.dot(step.information_per_mm2 * back.residual_mm);
    }
    if (step.heading.measured) {
      back.residual_rad = heading_residual(step.heading, pose.R);
      squares += back.residual_rad.dot(step.heading.information_per_rad2 * back.residual_rad);
    }
    if (step.motion.measured) {
      back.motion_residual_rad = motion_residual(step.motion, pose.R, slip);
      squares += back.motion_residual_rad.dot(step.motion.information_per_rad2 * back.motion_residual_rad);
    }
    if (moves(step) &&
        !model::advance_by_midpoint(pose, {-step.insertion_mm, -step.rotation_rad, curvature}, slip, back.backwards))
      return false;
  }
  pose.R = model::orthonormalised(pose.R);

  linear.error = difference<kSize>(entry, start);
  linear.covariance = covariance_of<kSize>(start);
  cost = 0.5 * (squares + linear.error.dot(linear.covariance.ldlt().solve(linear.error)));
  // The error of `start` is about its own pose; here it is counted from the path's.
  linear.turn(model::right_jacobian_se3(linear.error.template head<6>()).inverse());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const PastStep& step = steps[i];
    if (moves(step))
      linear.predict(inverse(walked[i].backwards),
                     process_variance<kSize>(linear.covariance, step.insertion_mm, step.rotation_rad));
    linear.update(step, walked[i], slip);
  }
  return linear.error.allFinite() && linear.covariance.allFinite() && std::isfinite(linear.log_evidence);
}

template <int kSize>
bool NeedleFilter::relinearise_sized(FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                                     std::span<WalkedStep> walked) const {
  if (walked.size() < steps.size()) return false;
  constexpr std::size_t kMost = Ridge<kSize>::kDirections == 1 ? 3 : 9;
  const Ridge<kSize> ridge = find_ridge<kSize>(state, config_.prior);
  std::array<FilterState, kMost> at;
  std::array<LinearFilter<kSize>, kMost> linear;
  std::array<double, kMost> weight{};
  double cost_before = 0;
  std::size_t count = 1;
  for (int j = 0; j < ridge.directions; ++j) count *= kPlaces.size();
  for (std::size_t i = 0; i < count; ++i) {
    Error<kSize> offset = Error<kSize>::Zero();
    std::size_t rest = i;
    for (int j = 0; j < ridge.directions; ++j, rest /= kPlaces.size()) {
      const Place& place = kPlaces[rest % kPlaces.size()];
      offset += place.at * ridge.along.col(j);
      // The rule is for a density over the unit normal one.
      weight[i] += std::log(place.weight) + 0.5 * place.at * place.at;
    }
    at[i] = state;
    move<kSize>(at[i], offset);
    double cost = 0;
    if (!run_again<kSize>(at[i], start, steps, walked, linear[i], cost)) return false;
    if (i == 0) cost_before = cost;  // the first place is the state itself
    for (int j = 0; j < ridge.directions; ++j) linear[i].condition(ridge.normal.col(j));
    move<kSize>(at[i], linear[i].error);
    linear[i].turn(model::right_jacobian_se3(linear[i].error.template head<6>()));
    weight[i] += linear[i].log_evidence;
  }
  const auto best = static_cast<std::size_t>(
      std::max_element(weight.begin(), weight.begin() + static_cast<std::ptrdiff_t>(count)) - weight.begin());
  double sum = 0;
  const double largest = weight[best];
  for (std::size_t i = 0; i < count; ++i) sum += weight[i] = std::exp(weight[i] - largest);
  // Rounding, and process noise, for which a path without it is no minimum, may raise the cost a little.
  if (!(path_cost<kSize>(at[best], start, steps) <= 1.05 * cost_before + 1)) return false;

  FilterState mean = at[best];
  for (int pass = 0; pass < 2; ++pass) {
    Error<kSize> step = Error<kSize>::Zero();
    for (std::size_t i = 0; i < count; ++i) step += weight[i] / sum * difference<kSize>(mean, at[i]);
    move<kSize>(mean, step);
  }
  Covariance<kSize> P = Covariance<kSize>::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const Error<kSize> off = difference<kSize>(mean, at[i]);
    linear[i].turn(model::right_jacobian_se3(off.template head<6>()).inverse());
    P += weight[i] / sum * (linear[i].covariance + off * off.transpose());
  }
  set_covariance<kSize>(mean, 0.5 * (P + P.transpose()));
  mean.pose.R = model::orthonormalised(mean.pose.R);
  keep_in_domain<kSize>(mean);
  state = mean;
  return true;
}

// The past goes in as white readings of what its coloured ones are worth. What the newest of them said of the shared
// errors, given the state, still holds for the state as it is now: mean and covariance of that are taken over.
template <int kSize>
bool NeedleFilter::relinearise_coloured(FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                                        std::span<WalkedStep> walked) const {
  const FilterState before = state;
  if (!relinearise_sized<kSize>(state, start, steps, walked)) return false;
  const auto had = before.shared.with_state.topRows<kSize>();
  const Eigen::Matrix<double, kSharedErrors, kSize> by_state =
      covariance_of<kSize>(before).ldlt().solve(had).transpose();
  const Covariance<kSize> P = covariance_of<kSize>(state);
  SharedErrors& shared = state.shared;
  shared.mean = before.shared.mean + by_state * difference<kSize>(before, state);
  shared.with_state.topRows<kSize>() = P * by_state.transpose();
  const Eigen::Matrix<double, kSharedErrors, kSharedErrors> changed =
      by_state * (P - covariance_of<kSize>(before)) * by_state.transpose();
  shared.covariance = before.shared.covariance + 0.5 * (changed + changed.transpose());
  return true;
}

bool NeedleFilter::relinearise(FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                               std::span<WalkedStep> walked) const {
  if (coloured_)
    return wheelbase_estimated_ ? relinearise_coloured<10>(state, start, steps, walked)
                                : relinearise_coloured<9>(state, start, steps, walked);
  return wheelbase_estimated_ ? relinearise_sized<10>(state, start, steps, walked)
                              : relinearise_sized<9>(state, start, steps, walked);
}

}  // namespace bevel::estimator
