// SPDX-License-Identifier: MIT
// The filter's measurement of the heading.
//
// A heading is of a sensor in the needle, which points along R e3, or of a camera that sees the shaft, which ends in
// the direction in which the tip moves (bevel/model/motion_direction.hpp): h below is either.
//
// A heading R e3 moves with the error (v | omega) of the pose, in the body, by R (omega x e3): along R e1 by omega_y,
// along R e2 by -omega_x. Neither roll nor position moves it. The direction of motion depends on
// lambda1 and lambda2 besides.
//
// What is measured, z, is known along one or two axes n across it, and so taken as angles: the angle from the predicted
// heading h to z in the plane of z and n is -atan2(n.h, z.h). For small ones these are the parts of the rotation vector
// that takes h to z. A single camera's picture is such a plane, and its angle is right however far the needle points
// out of it: the parts of the rotation vector itself would be mixed with what the camera does not see.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include <bevel/model/motion_direction.hpp>
#include "measurement_update.hpp"

namespace bevel::estimator {
namespace {

struct Angles {
  SeenAxes seen;                                         // of the rows below
  Eigen::Matrix3d by_heading = Eigen::Matrix3d::Zero();  // of the predicted angles by h, a row each; across h
  Eigen::Vector3d residual_rad = Eigen::Vector3d::Zero();
  double cosine = 0;  // of the angle between z and h
};

Angles angles_of(const model::TipHeading& measurement, const Eigen::Vector3d& h) {
  const Eigen::Vector3d z = measurement.heading.normalized();
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = z.unitOrthogonal();
  across.col(1) = z.cross(across.col(0));
  // Two rows, turned by one angle: equal eigenvalues, the usual case, stay as exact as the matrix.
  const Eigen::Matrix2d W = across.transpose() * measurement.information_per_rad2 * across;
  Eigen::JacobiRotation<double> turn;
  turn.makeJacobi(W(0, 0), W(0, 1), W(1, 1));
  across.applyOnTheRight(0, 1, turn);
  Eigen::Vector2d values = (across.transpose() * measurement.information_per_rad2 * across).diagonal();
  if (values[0] > values[1]) {
    std::swap(values[0], values[1]);
    across.col(0).swap(across.col(1));
  }

  Angles angles;
  angles.cosine = z.dot(h);
  angles.seen.axes.setIdentity();
  for (const int i : {0, 1}) {
    if (!(values[i] > kRankTolerance * values[1])) continue;
    const Eigen::Vector3d n = across.col(i);
    const double sine = n.dot(h);
    angles.by_heading.row(i + 1) = (angles.cosine * n - sine * z) / (angles.cosine * angles.cosine + sine * sine);
    angles.residual_rad[i + 1] = -std::atan2(sine, angles.cosine);
    angles.seen.variance[i + 1] = 1 / values[i];
    ++angles.seen.rank;
  }
  return angles;
}

}  // namespace

// Directions are seen as the cameras see small shifts of the tip. How a shift of the tip along the axes of the body is
// seen stands in the first columns of what a position's reading has.
Eigen::Matrix3d NeedleFilter::seen_shift(const FilterState& state) const {
  if (config_.effects.empty()) return state.pose.R;
  return reading(state).D.leftCols<3>();
}

SeenHeading NeedleFilter::seen_heading(const FilterState& state) const {
  const Eigen::Matrix3d shift = seen_shift(state);
  const double length = shift.col(2).norm();
  SeenHeading seen;
  seen.along = shift.col(2) / length;
  const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - seen.along * seen.along.transpose()) / length;
  seen.by_error.setZero();
  seen.by_error.col(3) = -across * shift.col(1);
  seen.by_error.col(4) = across * shift.col(0);
  return seen;
}

std::optional<SeenHeading> NeedleFilter::seen_motion(const FilterState& state) const {
  model::MotionDirection motion;
  if (!model::motion_direction(state.pose.R, slip_of(state), motion)) return std::nullopt;
  const Eigen::Matrix3d shift = seen_shift(state);
  const Eigen::Vector3d moves = shift * motion.along;
  const double length = moves.norm();
  SeenHeading seen;
  seen.along = moves / length;
  const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - seen.along * seen.along.transpose()) / length * shift;
  seen.by_error.leftCols<3>().setZero();
  seen.by_error.rightCols<3>() = across * motion.by_turn;
  seen.by_slip = across * motion.by_slip;
  return seen;
}

bool NeedleFilter::is_of_shaft(std::int32_t camera) const {
  return std::ranges::find(config_.shaft_cameras, camera) != config_.shaft_cameras.end();
}

Eigen::Vector3d NeedleFilter::motion_of(const FilterState& state) const {
  model::MotionDirection motion;
  if (config_.shaft_cameras.empty() || !model::motion_direction(state.pose.R, slip_of(state), motion))
    return Eigen::Vector3d::Zero();
  return state.pose.R * motion.along;
}

Update NeedleFilter::update(FilterState& state, const model::TipHeading& measurement) const {
  if (stiff_) return {};  // the inclination of the shaft's end is not in the derivatives below
  if (has_nuisance_) return update_heading<kAllStates>(state, measurement);
  if (coloured_)
    return wheelbase_estimated_ ? update_heading<16>(state, measurement) : update_heading<15>(state, measurement);
  return wheelbase_estimated_ ? update_heading<10>(state, measurement) : update_heading<9>(state, measurement);
}

template <int kSize>
Update NeedleFilter::update_heading(FilterState& state, const model::TipHeading& measurement) const {
  const bool of_shaft = is_of_shaft(measurement.camera);
  const std::optional<SeenHeading> of_motion = of_shaft ? seen_motion(state) : std::nullopt;
  if (of_shaft && !of_motion) return {};  // no model of what it sees
  const SeenHeading predicted = of_motion ? *of_motion : seen_heading(state);
  const Angles angles = angles_of(measurement, predicted.along);
  const int rank = angles.seen.rank;
  if (rank == 0) return {};  // sees nothing: no rejection either
  if (is_forgotten(state.heading_utime, measurement.utime)) state.heading_rejects_in_row = 0;
  state.heading_utime = std::max(state.heading_utime, measurement.utime);
  Update result;
  if (angles.cosine > 0) {
    if constexpr (kSize == kAllStates) {
      Eigen::Matrix<double, 3, 10> by_state = Eigen::Matrix<double, 3, 10>::Zero();
      by_state.leftCols<6>() = angles.by_heading * predicted.by_error;
      by_state.middleCols<2>(7) = angles.by_heading * predicted.by_slip;
      result = update_all(state, by_state, ByNuisance::Zero(), angles.seen, angles.residual_rad, gate_);
    } else if (of_shaft) {
      Eigen::Matrix<double, 3, 9> by_state = Eigen::Matrix<double, 3, 9>::Zero();
      by_state.leftCols<6>() = angles.by_heading * predicted.by_error;
      by_state.rightCols<2>() = angles.by_heading * predicted.by_slip;
      result = update_seen<kSize, 9>(state, by_state, angles.seen, angles.residual_rad, gate_);
    } else {
      const Eigen::Matrix<double, 3, 6> by_error = angles.by_heading * predicted.by_error;
      result = update_seen<kSize, 6>(state, by_error, angles.seen, angles.residual_rad, gate_);
    }
  } else {
    // Half way round, the angle in a camera's picture may be nothing, or anything.
    const double angle_rad = std::acos(std::max(angles.cosine, -1.0));
    result.rank = rank;
    result.mahalanobis2 = angle_rad * angle_rad / angles.seen.variance[2];
    result.test_ratio = std::max(2.0, result.mahalanobis2 / gate_.at(static_cast<std::size_t>(rank - 1)));
  }
  if (!result.accepted) {
    ++state.heading_rejects_in_row;
    return result;
  }
  state.heading_rejects_in_row = 0;
  keep_in_domain<kSize>(state);
  return result;
}

DirectionReading NeedleFilter::made_linear(const model::TipHeading& measurement, const FilterState& state) const {
  const bool of_shaft = is_of_shaft(measurement.camera);
  const Eigen::Vector3d h = of_shaft ? motion_of(state) : state.pose.R.col(2);
  DirectionReading made;
  if (h.isZero()) return made;
  const Angles angles = angles_of(measurement, h);
  Eigen::Vector3d left = Eigen::Vector3d::Zero();
  for (const int i : {1, 2}) {
    if (!(angles.seen.variance[i] > 0)) continue;
    const Eigen::Vector3d by_heading = angles.by_heading.row(i);
    made.information_per_rad2 += by_heading * by_heading.transpose() / angles.seen.variance[i];
    left += by_heading * (angles.residual_rad[i] / angles.seen.variance[i]);
  }
  made.measured = true;
  made.seen = h + solve_across(made.information_per_rad2, h, left);
  return made;
}

}  // namespace bevel::estimator
