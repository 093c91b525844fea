#include "rig/plant/plant.hpp"

#include <algorithm>

namespace bevel::rig {
namespace {
constexpr double kShaftSpacing_mm = 1.0;
}

KinematicPlant::KinematicPlant(const model::NeedleParameters& needle, std::vector<model::ActiveEffect> effects,
                               double roll_rad, const model::OwnValues& own)
    : needle_(model::of_insertion(needle, own), std::move(effects)), state_(needle_.entry({})) {
  state_.pose = model::of_insertion(state_.pose, own);
  state_.pose.R = state_.pose.R * model::exp_so3({0, 0, roll_rad});
  path_mm_ = {state_.pose.p_mm - state_.pose.R.col(2), state_.pose.p_mm};
  path_depth_mm_ = {-1, 0};
  follow_path();
}

void KinematicPlant::advance(double insertion_mm, double rotation_rad, double dt_s) {
  const model::BaseMotion& base = state_.base;
  const model::BaseMotion to{base.time_s + dt_s, base.insertion_mm + insertion_mm, base.rotation_rad + rotation_rad};
  // Outside the domain of the slip law the tip stays: the rig has no needle that bends past 90 degrees. Time goes on.
  if (needle_.advance(state_, to))
    state_.pose.R = model::orthonormalised(state_.pose.R);
  else
    state_.base.time_s = to.time_s;
  follow_path();
}

void KinematicPlant::follow_path() {
  const double inserted_mm = state_.tip_insertion_mm.value;
  while (path_mm_.size() > 2 && path_depth_mm_[path_depth_mm_.size() - 2] >= inserted_mm) {
    path_mm_.pop_back();
    path_depth_mm_.pop_back();
  }
  if (inserted_mm - path_depth_mm_[path_depth_mm_.size() - 2] > kShaftSpacing_mm) {
    path_mm_.push_back(state_.pose.p_mm);
    path_depth_mm_.push_back(inserted_mm);
  }
  path_mm_.back() = state_.pose.p_mm;
  path_depth_mm_.back() = inserted_mm;

  model::TipReading reading;
  needle_.point(state_, reading);
  tip_ = {state_.pose.R, reading.position_mm};
  // An offset of the tip bends the shaft, evenly from the entry on.
  const Eigen::Vector3d offset_mm = tip_.p_mm - state_.pose.p_mm;
  shaft_mm_ = path_mm_;
  for (std::size_t i = 0; i < shaft_mm_.size(); ++i)
    shaft_mm_[i] += std::max(0.0, path_depth_mm_[i] / std::max(inserted_mm, kShaftSpacing_mm)) * offset_mm;
  shaft_mm_.back() = tip_.p_mm;
}

}  // namespace bevel::rig
