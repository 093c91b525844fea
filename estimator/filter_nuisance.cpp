// The filter's slowly known states of the rig (nuisance.hpp).
//
// Wind-up: friction holds the inserted shaft, so that the tip's roll follows the base's with a play of half width
// w (L / 100 mm)^2 (model/effects/torsional_windup.cpp; Reed, Okamura and Cowan 2009, IEEE TBME 56(12)). The lag is a
// function of w and of what the base did, both in the state; with it goes its derivative by w. A turn of the tip by
// drho moves a stiff shaft's tip by r drho along e1 beside, r = K b^2 / 2 g (stiff_shaft.cpp): on the error of the pose
// it is drho (r, 0, 0, 0, 0, 1), and so is what w errs by on the turn.
//
// Camera c reads exp(theta_c) (p - v tau_c) of a tip at p that moves at v: to first order in the latency tau, and in
// theta. What two cameras see of theta_c is what turns out of their pictures once the needle is aside; a slope that
// both share is told from the needle's own by the widths of the two beforehand alone. tau_c is seen where the rate
// changes.
#include <algorithm>
#include <cmath>

#include "estimator/error_state.hpp"

namespace bevel::estimator {
namespace {
double square(double x) { return x * x; }
}  // namespace

void NeedleFilter::begin_nuisance(FilterState& state) const {
  const NuisancePrior& prior = config_.nuisance;
  Nuisance& nuisance = state.nuisance;
  nuisance.with_state.setZero();
  nuisance.with_shared.setZero();
  nuisance.covariance.setZero();
  nuisance.covariance(kWindup, kWindup) = square(prior.windup_sd_rad);
  for (int camera = 0; camera < kCamerasInFrame; ++camera) {
    nuisance.covariance.diagonal().segment<3>(frame_of(camera)).setConstant(square(prior.frame_sd_rad));
    nuisance.covariance(latency_of(camera), latency_of(camera)) = square(prior.latency_sd_s);
  }
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

Eigen::Matrix3d NeedleFilter::frame_of_camera(const FilterState& state, int camera) const {
  if (camera < 0 || camera >= kCamerasInFrame) return Eigen::Matrix3d::Identity();
  return model::exp_so3(state.nuisance.mean.segment<3>(frame_of(camera)));
}

Eigen::Vector3d NeedleFilter::seen_by_camera(const FilterState& state, int camera, const Eigen::Vector3d& tip_mm,
                                             Eigen::Matrix<double, 3, kNuisance>& by_nuisance) const {
  by_nuisance.setZero();
  if (camera < 0 || camera >= kCamerasInFrame) return tip_mm;
  const Nuisance& nuisance = state.nuisance;
  const Eigen::Matrix3d frame = frame_of_camera(state, camera);
  const Eigen::Vector3d seen_mm = frame * (tip_mm - nuisance.mean[latency_of(camera)] * nuisance.tip_velocity_mm_s);
  by_nuisance.middleCols<3>(frame_of(camera)) = -model::hat(seen_mm);
  by_nuisance.col(latency_of(camera)) = -frame * nuisance.tip_velocity_mm_s;
  return seen_mm;
}

}  // namespace bevel::estimator
