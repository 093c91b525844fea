// SPDX-License-Identifier: MIT
// The filter's slowly known states of the rig (nuisance.hpp).
//
// Wind-up: friction holds the inserted shaft, so that the tip's roll follows the base's with a play of half width
// w (L / 100 mm)^2 (model/src/effects/torsional_windup.cpp; Reed, Okamura and Cowan 2009, IEEE TBME 56(12)). The lag is
// a function of w and of what the base did, both in the state; with it goes its derivative by w. A turn of the tip by
// drho moves a stiff shaft's tip by r drho along e1 beside, r = K b^2 / 2 g (stiff_shaft.cpp): on the error of the pose
// it is drho (r, 0, 0, 0, 0, 1), and so is what w errs by on the turn.
//
// Camera c reads p - v tau_c of a tip at p that moves at v: to first order in the latency tau, which is seen where the
// rate changes.
#include <algorithm>
#include <cmath>

#include "measurement_update.hpp"

namespace bevel::estimator {
namespace {
constexpr int kOwnStates = kOwn<kAllStates>, kBefore = kFiltered<kAllStates>;
using ToSeen = Eigen::Matrix<double, 3, kAllStates>;

double square(double x) { return x * x; }
}  // namespace

Covariance<kAllStates> get_covariance(const FilterState& state, std::integral_constant<int, kAllStates>) {
  const Nuisance& nuisance = state.nuisance;
  Covariance<kAllStates> P;
  P.topLeftCorner<kBefore, kBefore>() = covariance_of<kBefore>(state);
  P.block<kOwnStates, kNuisance>(0, kBefore) = nuisance.with_state;
  P.block<kSharedErrors, kNuisance>(kOwnStates, kBefore) = nuisance.with_shared;
  P.bottomLeftCorner<kNuisance, kBefore>() = P.topRightCorner<kBefore, kNuisance>().transpose();
  P.bottomRightCorner<kNuisance, kNuisance>() = nuisance.covariance;
  return P;
}

void set_all_covariance(FilterState& state, const Covariance<kAllStates>& P) {
  set_covariance<kBefore>(state, P.topLeftCorner<kBefore, kBefore>());
  state.nuisance.with_state = P.block<kOwnStates, kNuisance>(0, kBefore);
  state.nuisance.with_shared = P.block<kSharedErrors, kNuisance>(kOwnStates, kBefore);
  state.nuisance.covariance = P.bottomRightCorner<kNuisance, kNuisance>();
}

Update update_all(FilterState& state, const Eigen::Matrix<double, 3, 10>& by_state, const ByNuisance& by_nuisance,
                  const SeenAxes& seen, const Eigen::Vector3d& residual, const std::array<double, 3>& gate) {
  const int rank = seen.rank, unseen = 3 - rank;
  Eigen::Matrix3d axes = seen.axes.transpose();
  axes.topRows(unseen).setZero();
  Eigen::Vector3d variance = seen.variance;
  variance.head(unseen).setOnes();
  const Eigen::Matrix3d by_errors = seen.coloured.cwiseSqrt().asDiagonal() * axes;
  ToSeen H = ToSeen::Zero();
  H.leftCols<kOwnStates>() = axes * by_state;
  H.middleCols<3>(kOwnStates + seen.first_error) = by_errors;
  H.rightCols<kNuisance>() = axes * by_nuisance;
  Covariance<kAllStates> P = covariance_of<kAllStates>(state);
  const Eigen::Matrix<double, kAllStates, 3> PHt = P * H.transpose();
  Eigen::Matrix3d S = H * PHt;
  S.diagonal() += variance;
  const Eigen::LLT<Eigen::Matrix3d> llt(S);
  const Eigen::Vector3d y = axes * residual - by_errors * state.shared.mean.segment<3>(seen.first_error);
  const Eigen::Vector3d whitened = llt.matrixL().solve(y);

  Update result;
  result.rank = rank;
  result.mahalanobis2 = whitened.squaredNorm();
  result.test_ratio = result.mahalanobis2 / gate.at(static_cast<std::size_t>(rank - 1));
  result.innovation.head(rank) = y.tail(rank);
  result.innovation_whitened.head(rank) = whitened.tail(rank);
  result.accepted = result.test_ratio <= 1;  // false for a NaN too
  if (!result.accepted) return result;

  const Eigen::Matrix<double, kAllStates, 3> K = llt.solve(PHt.transpose()).transpose();
  // Joseph form, as update_rank().
  P.noalias() -= K * PHt.transpose();
  const Eigen::Matrix<double, kAllStates, 3> left = P * H.transpose() - K * variance.asDiagonal();
  P.noalias() -= left * K.transpose();
  set_all_covariance(state, 0.5 * (P + P.transpose()));
  move<kAllStates>(state, K * y);
  state.pose.R = model::orthonormalised(state.pose.R);
  return result;
}

void NeedleFilter::begin_nuisance(FilterState& state) const {
  const NuisancePrior& prior = config_.nuisance;
  Nuisance& nuisance = state.nuisance;
  nuisance.with_state.setZero();
  nuisance.with_shared.setZero();
  nuisance.covariance.setZero();
  nuisance.covariance(kWindup, kWindup) = square(prior.windup_sd_rad);
  for (int camera = 0; camera < kLateCameras; ++camera)
    nuisance.covariance(latency_of(camera), latency_of(camera)) = square(prior.latency_sd_s);
}

NeedleFilter::TipTurn NeedleFilter::follow_windup(FilterState& state, double insertion_mm, double rotation_rad) const {
  Nuisance& nuisance = state.nuisance;
  nuisance.inserted_mm += insertion_mm;
  if (!(config_.nuisance.windup_sd_rad > 0)) return {rotation_rad, 0};
  const double by_windup = square(std::max(nuisance.inserted_mm, 0.0) / 100);
  const double most_rad = std::max(nuisance.mean[kWindup], 0.0) * by_windup;
  const double before_rad = nuisance.lag_rad, before_by_windup = nuisance.lag_by_windup;
  nuisance.lag_rad += rotation_rad;
  // Of no wind-up too: on its bound the tip follows at once, and the derivative is that side's.
  if (nuisance.lag_rad > most_rad)
    nuisance.lag_rad = most_rad, nuisance.lag_by_windup = by_windup;
  else if (nuisance.lag_rad < -most_rad)
    nuisance.lag_rad = -most_rad, nuisance.lag_by_windup = -by_windup;
  return {rotation_rad - (nuisance.lag_rad - before_rad), before_by_windup - nuisance.lag_by_windup};
}

void NeedleFilter::spread_turn(FilterState& state, double by_windup) const {
  if (by_windup == 0) return;
  Nuisance& nuisance = state.nuisance;
  model::Vector6d turn = by_windup * model::Vector6d::Unit(5);
  if (stiff_) turn[0] = by_windup * swing_of(shaft_of(state)).to_middle_mm.y();
  const Vector9d with = nuisance.with_state.col(kWindup).head<9>();
  const double with_tenth = nuisance.with_state(9, kWindup), variance = nuisance.covariance(kWindup, kWindup);
  const Eigen::Matrix<double, 6, 9> moved = turn * with.transpose();
  state.covariance.topRows<6>() += moved;
  state.covariance.leftCols<6>() += moved.transpose();
  state.covariance.topLeftCorner<6, 6>() += variance * turn * turn.transpose();
  state.tenth_covariance.head<6>() += with_tenth * turn;
  state.shared.with_state.topRows<6>() += turn * nuisance.with_shared.col(kWindup).transpose();
  nuisance.with_state.topRows<6>() += turn * nuisance.covariance.row(kWindup);
}

Eigen::Vector3d NeedleFilter::seen_by_camera(const FilterState& state, int camera, const Eigen::Vector3d& tip_mm,
                                             Eigen::Matrix<double, 3, kNuisance>& by_nuisance) const {
  by_nuisance.setZero();
  if (camera < 0 || camera >= kLateCameras) return tip_mm;
  const Nuisance& nuisance = state.nuisance;
  by_nuisance.col(latency_of(camera)) = -nuisance.tip_velocity_mm_s;
  return tip_mm - nuisance.mean[latency_of(camera)] * nuisance.tip_velocity_mm_s;
}

}  // namespace bevel::estimator
