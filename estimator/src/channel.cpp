// SPDX-License-Identifier: MIT
#include <bevel/estimator/channel.hpp>

#include <algorithm>
#include <cmath>

namespace bevel::estimator {

Channel::Part Channel::next(double target_mm) const {
  const bool back = target_mm < inserted_mm_;
  const auto up_to = [this](double to_mm) { return Part{to_mm - inserted_mm_, to_mm, false, {}}; };
  // New tissue, none at all, or the way in of a needle that nobody watched.
  if (!back && inserted_mm_ >= front_mm_) return up_to(target_mm);
  if (back && inserted_mm_ <= 0) return up_to(target_mm);
  if (!back && inserted_mm_ < 0) return up_to(std::min(target_mm, 0.0));
  const double at = inserted_mm_ / kCell_mm;
  const double cell = back ? std::ceil(at) - 1 : std::floor(at);
  const double from_mm = cell * kCell_mm, end_mm = std::min(from_mm + kCell_mm, front_mm_);
  Part part = up_to(back ? std::max(target_mm, from_mm) : std::min(target_mm, end_mm));
  part.cut_before = cell < static_cast<double>(kCells);
  if (!part.cut_before) return part;
  const Eigen::Vector2d mean = cells_[static_cast<std::size_t>(cell)].cast<double>() / (end_mm - from_mm);
  part.bend = {std::min(mean.norm(), 1.0), std::atan2(mean.y(), mean.x())};
  return part;
}

void Channel::pass(const Part& part, double rotation_rad, bool bend_known) {
  if (!part.cut_before && part.to_mm > front_mm_) cut(part.to_mm, rotation_rad, bend_known);
  inserted_mm_ = part.to_mm;
  rolled_rad_ += rotation_rad;
}

void Channel::cut(double to_mm, double rotation_rad, bool bend_known) {
  const double from_mm = front_mm_, length_mm = to_mm - from_mm;
  for (auto c = static_cast<std::size_t>(from_mm / kCell_mm); front_mm_ < to_mm; ++c) {
    const double end_mm = std::min(to_mm, kCell_mm * static_cast<double>(c + 1));
    const double part_mm = end_mm - front_mm_;
    if (c < kCells && part_mm > 0) {
      if (front_mm_ <= kCell_mm * static_cast<double>(c)) cells_[c].setZero();
      const double roll_rad = rolled_rad_ + rotation_rad * (0.5 * (front_mm_ + end_mm) - from_mm) / length_mm;
      if (bend_known) cells_[c] += (part_mm * Eigen::Vector2d(std::cos(roll_rad), std::sin(roll_rad))).cast<float>();
    }
    front_mm_ = std::max(front_mm_, end_mm);
  }
}

}  // namespace bevel::estimator
