// SPDX-License-Identifier: MIT
// Declared resets of the filter: the pose is no longer trusted, and its covariance is widened accordingly.
#include <algorithm>
#include <cmath>
#include <tuple>

#include <bevel/estimator/error_state.hpp>

namespace bevel::estimator {
namespace {

constexpr double kSureOfSide = 3;  // standard deviations: then a bevel mounted wrong is the likelier

double square(double x) { return x * x; }

}  // namespace

// A needle that bent by at most k to any side, in any order, from the entry to its depth L: its end lies up to
// k L^2 / 2 aside and k^2 L^3 / 6 short, and is inclined by up to k L. Offset and inclination along one axis of {A} are
// integrals of the same bend u(l), |u| <= 1,
//     offset = k int (L - l) u dl,   inclination = k int u dl,
// so they are correlated: by 1 for a bend to one side and by sqrt(3) / 2 for a direction that is white along the path
// (L^2 / 2 over the root of L times L^3 / 3). The smaller is taken. Given the offset, the largest inclination left is
// then 0.41 k L (a bend that changes its side once), within the standard deviation of 0.5 k L that remains.
void NeedleFilter::widen_by_bend(FilterState& state, double inserted_mm) const {
  const double length_mm = std::abs(inserted_mm);
  const double k = std::abs(config_.prior.needle.curvature_per_mm) + insertion_curvature_sd_per_mm(config_.prior);
  const double bend_rad = k * length_mm;
  const double aside_mm = 0.5 * bend_rad * length_mm, short_mm = square(bend_rad) * length_mm / 6;
  widen_pose(state, {square(aside_mm), 0.5 * std::sqrt(3.0) * aside_mm * bend_rad, square(bend_rad), square(short_mm)});
}

// In {B}, an inclination toward x is a turn by +omega_y and one toward y a turn by -omega_x.
void NeedleFilter::widen_pose(FilterState& state, const Widening& by) {
  Matrix9d& P = state.covariance;
  for (const auto& [offset, turn, sign] : {std::tuple(0, 4, 1.0), std::tuple(1, 3, -1.0)}) {
    P(offset, offset) += by.aside_mm2;
    P(turn, turn) += by.tilt_rad2;
    P(offset, turn) += sign * by.aside_with_tilt_mm_rad;
    P(turn, offset) = P(offset, turn);
  }
  P(2, 2) += by.along_mm2;
}

// Measurements that take k to straight, so far from what the prior has, show that the bevel is on the other side; where
// the prior is wider than that, or once the bevel was turned over, they show that the needle hardly bends.
bool NeedleFilter::bends_to_the_other_side(const FilterState& state) const {
  const double side = side_of_bend();
  return side != 0 && !state.turned_over && side * state.curvature_per_mm <= kStraight_per_mm &&
         std::abs(config_.prior.needle.curvature_per_mm) > kSureOfSide * insertion_curvature_sd_per_mm(config_.prior);
}

void NeedleFilter::declare_reset(FilterState& state, double reach_mm, std::int64_t utime) const {
  // The pose is no longer trusted. The parameters are, but less: their prior widths come back, correlations go.
  const FilterState prior = initial();
  const Gate& gate = config_.gate;
  ResetCause cause = ResetCause::measurements_rejected;
  if (bends_to_the_other_side(state)) {
    state.pose.R = state.pose.R * Eigen::Vector3d(-1, -1, 1).asDiagonal();
    state.curvature_per_mm = prior.curvature_per_mm;
    state.turned_over = true;
    cause = ResetCause::bevel_turned_over;
  }
  state.covariance = prior.covariance;
  state.tenth_covariance.setZero();
  state.tenth_variance = prior.tenth_variance;
  state.covariance.diagonal().head<6>() << Eigen::Vector3d::Constant(
      square(std::max(gate.reset_position_sd_mm, reach_mm))),
      square(gate.reset_tilt_sd_rad), square(gate.reset_tilt_sd_rad),
      std::max(square(gate.reset_tilt_sd_rad), prior.covariance(5, 5));
  widen_by_bend(state, state.pose.p_mm.z());
  state.shared = {};
  begin_nuisance(state);
  begin_reset(state, cause, utime);
}

void NeedleFilter::begin_reset(FilterState& state, ResetCause cause, std::int64_t utime) {
  state.rejects_in_row = 0;
  state.camera_rejects_in_row = {};
  state.heading_rejects_in_row = 0;
  state.measurement_utime = 0;
  ++state.reset_count;
  state.reset_cause = cause;
  state.reset_utime = utime;
}

bool NeedleFilter::is_forgotten(std::int64_t heard_utime, std::int64_t utime) const {
  return static_cast<double>(utime - heard_utime) * 1e-6 > config_.limits.rejects_forgotten_s;
}

}  // namespace bevel::estimator
