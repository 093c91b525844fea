// SPDX-License-Identifier: MIT
#include <bevel/estimator/past.hpp>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "measurement_update.hpp"

namespace bevel::estimator {
namespace {

constexpr double kLongest_mm = 2.5;
constexpr double kLongest_rad = 0.25;
constexpr double kSkew_mm_rad = 0.01;  // turns the heading by k times half of this

bool in_proportion(double insertion_mm, double rotation_rad, const PastStep& step) {
  return insertion_mm * step.insertion_mm >= 0 && rotation_rad * step.rotation_rad >= 0 &&
         std::abs(insertion_mm * step.rotation_rad - rotation_rad * step.insertion_mm) <= kSkew_mm_rad;
}

// Inverse along the axes that are seen, zero along the others.
Eigen::Matrix3d inverse_of_seen(const Eigen::Matrix3d& information) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.compute(information);  // a camera that turned little sees along its rays almost nothing, but that exactly
  Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i)
    if (eigen.eigenvalues()[i] > kRankTolerance * eigen.eigenvalues()[2]) inverse[i] = 1 / eigen.eigenvalues()[i];
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

bool diagonal(const Eigen::Matrix3d& W) { return W(0, 1) == 0 && W(0, 2) == 0 && W(1, 2) == 0; }

}  // namespace

Past::Past(std::size_t room) { steps_.reserve(room); }

void Past::restart(const FilterState& start) {
  start_ = start;
  steps_.clear();
  has_open_ = false;
  complete_ = true;
}

bool Past::joins(const PastStep& step) const {
  return in_proportion(open_.insertion_mm, open_.rotation_rad, step) &&
         std::abs(open_.insertion_mm + step.insertion_mm) <= kLongest_mm &&
         std::abs(open_.rotation_rad + step.rotation_rad) <= kLongest_rad;
}

void Past::add(const FilterState& before, const PastStep& step, const FilterState& after, const Moved& moved,
               const NeedleFilter& filter) {
  if (has_open_ && !joins(step)) close(before, filter);
  if (!has_open_) {
    open_ = step;
    has_open_ = true;
    progress_ = measured_at_ = std::abs(step.insertion_mm) + std::abs(step.rotation_rad);
    return;
  }
  progress_ += std::abs(step.insertion_mm) + std::abs(step.rotation_rad);
  open_.insertion_mm += step.insertion_mm;
  open_.rotation_rad += step.rotation_rad;
  // From the new end to where the tip was, in {A}; then the mean with the new reading, whose tip is the end itself.
  Eigen::Vector3d offset_mm = Eigen::Vector3d::Zero();
  if (open_.measured) offset_mm = before.pose.R * open_.point_mm - moved.tip_mm;
  if (step.measured && !(diagonal(open_.information_per_mm2) && diagonal(step.information_per_mm2))) {
    // Of cameras that look along no axis of {A}: sums of information, and the mean along the axes that either sees.
    const Eigen::Matrix3d had = open_.information_per_mm2;
    const Eigen::Matrix3d sum = had + step.information_per_mm2;
    const Eigen::Matrix3d inverse = inverse_of_seen(sum);
    open_.position_mm += inverse * (step.information_per_mm2 * (step.position_mm - open_.position_mm));
    offset_mm = inverse * (had * offset_mm);
    open_.information_per_mm2 = sum;
    measured_at_ += (progress_ - measured_at_) * step.information_per_mm2.trace() / sum.trace();
    open_.measured = true;
  } else if (step.measured) {
    const Eigen::Vector3d had = open_.information_per_mm2.diagonal();
    const Eigen::Vector3d comes = step.information_per_mm2.diagonal();
    for (int i = 0; i < 3; ++i) {
      if (!(had[i] + comes[i] > 0)) continue;
      const double share = had[i] / (had[i] + comes[i]);
      open_.position_mm[i] = share * open_.position_mm[i] + (1 - share) * step.position_mm[i];
      offset_mm[i] *= share;
    }
    open_.information_per_mm2.diagonal() = had + comes;
    measured_at_ += (progress_ - measured_at_) * comes.sum() / (had + comes).sum();
    open_.measured = true;
  }
  open_.point_mm = after.pose.R.transpose() * offset_mm;

  // The same for the directions, as points at unit distance ahead.
  const auto take = [&](const DirectionReading& comes, const Eigen::Vector3d& ahead, const Eigen::Vector3d& by_model,
                        DirectionReading& open) {
    if (!open.measured && !comes.measured) return;
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    if (open.measured) offset = before.pose.R * open.offset - by_model;
    if (comes.measured) join(comes, ahead, open, offset);
    open.offset = after.pose.R.transpose() * offset;
  };
  take(step.heading, after.pose.R.col(2), moved.heading, open_.heading);
  if (open_.motion.measured || step.motion.measured)
    take(step.motion, filter.motion_of(after), moved.motion, open_.motion);
}

// The mean reading leaves of the direction what the two leave, each by its information. That is taken across one and
// the same direction: two that each know nothing along their own would together know where along it they cross, at
// length zero.
void Past::join(const DirectionReading& comes, const Eigen::Vector3d& ahead, DirectionReading& open,
                Eigen::Vector3d& offset) {
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ahead * ahead.transpose();
  const Eigen::Matrix3d had = across * open.information_per_rad2 * across;
  const Eigen::Matrix3d sum = had + comes.information_per_rad2;
  const double share = had.trace() / sum.trace();
  const Eigen::Vector3d left = had * (open.seen - ahead - offset) + comes.information_per_rad2 * (comes.seen - ahead);
  offset *= share;
  open.seen = ahead + offset + solve_across(sum, ahead, left);
  open.information_per_rad2 = sum;
  if (!open_.measured) measured_at_ += (progress_ - measured_at_) * (1 - share);
  open.measured = true;
}

void Past::append(double insertion_mm, double rotation_rad) {
  if (insertion_mm == 0 && rotation_rad == 0) return;
  if (!steps_.empty() && !steps_.back().has_reading() && in_proportion(insertion_mm, rotation_rad, steps_.back())) {
    steps_.back().insertion_mm += insertion_mm;
    steps_.back().rotation_rad += rotation_rad;
  } else {
    steps_.push_back({.insertion_mm = insertion_mm, .rotation_rad = rotation_rad});
  }
}

void Past::close(const FilterState& end, const NeedleFilter& filter) {
  if (!has_open_) return;
  has_open_ = false;
  // The stretch up to the reading, the reading, and what is left of the stretch.
  if (!complete_ || steps_.size() + 3 > steps_.capacity()) {
    complete_ = false;
    return;
  }
  if (!open_.has_reading()) return append(open_.insertion_mm, open_.rotation_rad);
  const double share = progress_ > 0 ? measured_at_ / progress_ : 1;
  append(share * open_.insertion_mm, share * open_.rotation_rad);
  if (steps_.empty() || steps_.back().has_reading()) steps_.emplace_back();
  FilterState there = end;
  filter.predict_cutting(there, (share - 1) * open_.insertion_mm, (share - 1) * open_.rotation_rad);
  PastStep& step = steps_.back();
  step.measured = open_.measured;
  step.position_mm = open_.position_mm;
  step.information_per_mm2 = open_.information_per_mm2;
  step.point_mm = there.pose.R.transpose() * (end.pose.p_mm + end.pose.R * open_.point_mm - there.pose.p_mm);
  const Eigen::Matrix3d back = there.pose.R.transpose();
  step.heading = open_.heading;
  step.heading.offset = back * (end.pose.R * open_.heading.offset + end.pose.R.col(2) - there.pose.R.col(2));
  step.motion = open_.motion;
  if (step.motion.measured)
    step.motion.offset = back * (end.pose.R * open_.motion.offset + filter.motion_of(end) - filter.motion_of(there));
  append((1 - share) * open_.insertion_mm, (1 - share) * open_.rotation_rad);
}

}  // namespace bevel::estimator
