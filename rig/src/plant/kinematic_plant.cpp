// SPDX-License-Identifier: MIT
#include <bevel/rig/plant/plant.hpp>

#include <algorithm>

namespace bevel::rig {
namespace {
constexpr double kShaftSpacing_mm = 1.0;
constexpr double kCutSpacing_mm = 0.1;
}  // namespace

KinematicPlant::KinematicPlant(const model::NeedleParameters& needle, std::vector<model::ActiveEffect> effects,
                               double roll_rad, const model::OwnValues& own, Cut cut)
    : needle_(model::of_insertion(needle, own), std::move(effects)),
      state_(needle_.entry({})),
      keeps_cut_(cut == Cut::kept && needle_.effects().empty()) {
  state_.pose = model::of_insertion(state_.pose, own);
  state_.pose.R = state_.pose.R * model::exp_so3({0, 0, roll_rad});
  path_mm_ = {state_.pose.p_mm - state_.pose.R.col(2), state_.pose.p_mm};
  path_depth_mm_ = {-1, 0};
  if (keeps_cut_) cut_ = {{0, 0, state_.pose}, {0, 0, state_.pose}};
  follow_path();
}

void KinematicPlant::advance(double insertion_mm, double rotation_rad, double dt_s) {
  const model::BaseMotion& base = state_.base;
  const model::BaseMotion to{base.time_s + dt_s, base.insertion_mm + insertion_mm, base.rotation_rad + rotation_rad};
  const double front_mm = keeps_cut_ ? cut_.back().insertion_mm : base.insertion_mm;
  const bool behind = to.insertion_mm < front_mm || base.insertion_mm < front_mm;
  const bool in_cut = keeps_cut_ && to.insertion_mm >= 0 && behind;
  if (in_cut) {
    const double through_mm = std::min(to.insertion_mm, front_mm) - base.insertion_mm;
    const double share = insertion_mm == 0 ? 1 : through_mm / insertion_mm;
    follow_cut({base.time_s + share * dt_s, base.insertion_mm + through_mm, base.rotation_rad + share * rotation_rad});
  }
  if (!in_cut || to.insertion_mm > front_mm) cut_to(to);
  follow_path();
}

// Outside the domain of the slip law the tip stays: the rig has no needle that bends past 90 degrees. Time goes on.
void KinematicPlant::cut_to(const model::BaseMotion& to) {
  if (needle_.advance(state_, to))
    state_.pose.R = model::orthonormalised(state_.pose.R);
  else
    state_.base.time_s = to.time_s;
  if (keeps_cut_ && state_.base.insertion_mm >= cut_.back().insertion_mm) keep();
}

void KinematicPlant::keep() {
  const Passed here{state_.base.insertion_mm, state_.base.rotation_rad, state_.pose};
  if (here.insertion_mm - cut_[cut_.size() - 2].insertion_mm >= kCutSpacing_mm)
    cut_.push_back(here);
  else
    cut_.back() = here;
}

// Between two places where it was: straight from the one to the other, turned by what the shaft was turned since.
void KinematicPlant::follow_cut(const model::BaseMotion& to) {
  const auto beyond = std::upper_bound(cut_.begin() + 1, cut_.end() - 1, to.insertion_mm,
                                       [](double mm, const Passed& passed) { return mm < passed.insertion_mm; });
  const Passed &a = *(beyond - 1), &b = *beyond;
  const double length_mm = b.insertion_mm - a.insertion_mm;
  const double share = length_mm > 0 ? (to.insertion_mm - a.insertion_mm) / length_mm : 1;
  const auto unrolled = [](const Passed& passed) {
    return model::Pose{passed.pose.R * model::exp_so3({0, 0, -passed.rotation_rad}), passed.pose.p_mm};
  };
  const model::Pose from = unrolled(a);
  state_.pose = from * model::exp_se3(share * model::log_se3(from.inverse() * unrolled(b)));
  state_.pose.R = model::orthonormalised(state_.pose.R * model::exp_so3({0, 0, to.rotation_rad}));
  state_.base = to;
  state_.tip_insertion_mm.value = to.insertion_mm;
  state_.tip_rotation_rad.value = to.rotation_rad;
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
}

// An offset of the tip bends the shaft, evenly from the entry on.
std::vector<Eigen::Vector3d> KinematicPlant::shaft_mm() const {
  const double inserted_mm = state_.tip_insertion_mm.value;
  const Eigen::Vector3d offset_mm = tip_.p_mm - state_.pose.p_mm;
  std::vector<Eigen::Vector3d> drawn_mm = path_mm_;
  for (std::size_t i = 0; i < drawn_mm.size(); ++i)
    drawn_mm[i] += std::max(0.0, path_depth_mm_[i] / std::max(inserted_mm, kShaftSpacing_mm)) * offset_mm;
  drawn_mm.back() = tip_.p_mm;
  return drawn_mm;
}

}  // namespace bevel::rig
