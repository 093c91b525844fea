// The filter's measurement of the heading.
//
// A heading R e3 moves with the error (v | omega) of the pose, in the body, by R (omega x e3): along R e1 by omega_y,
// along R e2 by -omega_x. Neither roll nor position moves it.
#include <Eigen/Geometry>
#include <cmath>

#include "estimator/measurement_update.hpp"

namespace bevel::estimator {
namespace {

// The best seen axes across `along`, with the variance of an angle along each.
SeenAxes seen_across(const Eigen::Matrix3d& information, const Eigen::Vector3d& along, const Eigen::Vector3d& aside) {
  Eigen::Matrix<double, 3, 2> plane;
  plane.col(0) = (aside - along.dot(aside) * along).normalized();
  plane.col(1) = along.cross(plane.col(0));
  // Two rows, turned by one angle: equal eigenvalues, the usual case, stay as exact as the matrix.
  const Eigen::Matrix2d W = plane.transpose() * information * plane;
  Eigen::JacobiRotation<double> turn;
  turn.makeJacobi(W(0, 0), W(0, 1), W(1, 1));
  plane.applyOnTheRight(0, 1, turn);
  Eigen::Matrix2d diagonal = W;
  diagonal.applyOnTheLeft(0, 1, turn.adjoint());
  diagonal.applyOnTheRight(0, 1, turn);
  const int best = diagonal(0, 0) > diagonal(1, 1) ? 0 : 1;

  SeenAxes seen;
  seen.axes << along, plane.col(1 - best), plane.col(best);
  for (const int i : {1, 2}) {
    const int from = i == 2 ? best : 1 - best;
    if (!(diagonal(from, from) > kRankTolerance * diagonal(best, best))) continue;
    seen.variance[i] = 1 / diagonal(from, from);
    ++seen.rank;
  }
  return seen;
}

}  // namespace

SeenHeading NeedleFilter::seen_heading(const FilterState& state) const {
  // Directions are seen as the cameras see small shifts of the tip. How a shift of the tip along the axes of the body
  // is seen stands in the first columns of what a position's reading has.
  Eigen::Matrix3d shift = state.pose.R;
  if (!config_.effects.empty()) shift = reading(state).D.leftCols<3>();
  const double length = shift.col(2).norm();
  SeenHeading seen;
  seen.along = shift.col(2) / length;
  const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - seen.along * seen.along.transpose()) / length;
  seen.by_error.setZero();
  seen.by_error.col(3) = -across * shift.col(1);
  seen.by_error.col(4) = across * shift.col(0);
  return seen;
}

Update NeedleFilter::update(FilterState& state, const model::TipHeading& measurement) const {
  return wheelbase_estimated_ ? update_heading<10>(state, measurement) : update_heading<9>(state, measurement);
}

template <int kSize>
Update NeedleFilter::update_heading(FilterState& state, const model::TipHeading& measurement) const {
  const SeenHeading predicted = seen_heading(state);
  const SeenAxes seen = seen_across(measurement.information_per_rad2, predicted.along, state.pose.R.col(0));
  if (seen.rank == 0) return {};  // sees nothing: no rejection either
  const Eigen::Vector3d heading = measurement.heading.normalized();
  const double cosine = heading.dot(predicted.along);
  const Eigen::Vector3d aside = heading - cosine * predicted.along;
  const double sine = aside.norm();
  const double angle_rad = std::atan2(sine, cosine);

  Update result;
  if (cosine > 0) {
    const Eigen::Vector3d residual_rad = sine > 0 ? Eigen::Vector3d(angle_rad / sine * aside) : aside;
    result = update_seen<kSize, 6>(state, predicted.by_error, seen, residual_rad, gate_);
  } else {
    // Half way round and more, the shortest way there says little of the direction of an error, and exactly half way
    // nothing: an axis that is not seen would take it in without an innovation.
    result.rank = seen.rank;
    result.mahalanobis2 = angle_rad * angle_rad / seen.variance[2];
    result.test_ratio = std::max(2.0, result.mahalanobis2 / gate_.at(static_cast<std::size_t>(seen.rank - 1)));
  }
  if (!result.accepted) {
    ++state.heading_rejects_in_row;
    return result;
  }
  state.heading_rejects_in_row = 0;
  keep_in_domain<kSize>(state);
  return result;
}

}  // namespace bevel::estimator
