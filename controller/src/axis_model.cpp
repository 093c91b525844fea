// SPDX-License-Identifier: MIT
#include <bevel/controller/axis_model.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <bevel/error.hpp>

namespace bevel::controller {
namespace {

// Longer than any dead band: the widest of a model file is 8 rad.
constexpr double kLongTurn_rad = 20;
constexpr double kLongInsertion_mm = 100;
constexpr double kBrakingShare = 0.5;  // of the acceleration, as at the closest approach

constexpr double kLongestJump_mm = 15;   // largest indentation of a membrane in a model file; stick-slip has 10
constexpr double kDeepest_mm = 300;      // largest depth of a membrane in a model file
constexpr double kFinestStep_mm = 0.02;  // of the base: within which stick-slip catches up
constexpr double kStepShare = 0.05;      // of the insertion so far, by which steps grow
constexpr double kJumpRatio = 2;  // advance of the tip over that of the base, above which the base cannot stop it
constexpr double kSamePlace_mm = 1e-6;

bool is_jump(double tip_mm, double base_mm) { return tip_mm > kJumpRatio * base_mm; }

}  // namespace

AxisModel::AxisModel(std::vector<model::ActiveEffect> effects) : effects_(std::move(effects)) {
  if (effects_.size() > model::kMaxEffects)
    throw ArgumentError("a model has " + std::to_string(effects_.size()) + " effects; at most " +
                        std::to_string(model::kMaxEffects) + " are supported");
  // A discrepancy is no dead band: what it adds to a rate, the feedback takes care of, and a turn that comes in short
  // by a share would be taken for slack.
  std::erase_if(effects_, [](const model::ActiveEffect& active) { return active.owned != nullptr; });
  turns_late_ = find_late_turn();
  advances_by_jumps_ = !effects_.empty() && find_jumps();
}

// Deep in the tissue, where a shaft has something to wind up, and with no time passing.
bool AxisModel::find_late_turn() const {
  const model::BaseMotion deep{0, kLongInsertion_mm, 0};
  Tip probe;
  move(probe, {}, {}, 0);
  move(probe, {}, deep, 0);
  const double before_rad = probe.rotation_rad;
  move(probe, deep, {0, kLongInsertion_mm, kLongTurn_rad}, 0);
  return std::abs(probe.rotation_rad - before_rad - kLongTurn_rad) > 1e-9;
}

bool AxisModel::find_jumps() const {
  Tip probe;
  model::BaseMotion at;
  move(probe, at, at, 0);
  while (at.insertion_mm < kDeepest_mm) {
    const model::BaseMotion from = at;
    const double before_mm = probe.insertion_mm;
    at.insertion_mm += kFinestStep_mm;
    move(probe, from, at, before_mm);
    if (is_jump(probe.insertion_mm - before_mm, kFinestStep_mm)) return true;
  }
  return false;
}

void AxisModel::move(Tip& tip, const model::BaseMotion& from, const model::BaseMotion& to, double tip_depth_mm) const {
  model::LegView leg;
  leg.entry = entry_;
  leg.from = from;
  leg.to = to;
  leg.tip_depth_mm.value = tip_depth_mm;
  leg.heading_z.value = 1;
  leg.R.setIdentity();
  leg.R_body.setZero();
  leg.tip_rotation_rad.value = tip.rotation_rad;
  model::Dual insertion_mm(to.insertion_mm), rotation_rad(to.rotation_rad);
  for (std::size_t i = 0; i < effects_.size(); ++i) {
    const model::ActiveEffect& active = effects_[i];
    active.effect->axes({active.parameters.data(), active.effect->parameters().size()}, leg, tip.memory[i],
                        insertion_mm, rotation_rad);
  }
  tip.rotation_rad = rotation_rad.value;
  tip.insertion_mm = insertion_mm.value;
}

void AxisModel::follow(const model::ActuatorState& actuator, double tip_depth_mm) {
  if (!turns_late_ && !advances_by_jumps_) return;
  if (!entered_) {
    entered_ = true;
    entry_utime_ = actuator.utime;
    entry_ = base_ = {0, actuator.insertion_mm, actuator.rotation_rad};
    tip_.rotation_rad = actuator.rotation_rad;
    tip_.insertion_mm = actuator.insertion_mm;
  }
  tip_depth_mm_ = tip_depth_mm;
  const model::BaseMotion to{static_cast<double>(actuator.utime - entry_utime_) * 1e-6, actuator.insertion_mm,
                             actuator.rotation_rad};
  move(tip_, base_, to, tip_depth_mm);
  base_ = to;
}

double AxisModel::take_up_rad(double direction) const {
  if (!turns_late_ || !entered_ || direction == 0) return 0;
  Tip tried = tip_;
  const double turn_rad = std::copysign(kLongTurn_rad, direction);
  move(tried, base_, {base_.time_s, base_.insertion_mm, base_.rotation_rad + turn_rad}, tip_depth_mm_);
  return std::clamp(kLongTurn_rad - std::abs(tried.rotation_rad - tip_.rotation_rad), 0.0, kLongTurn_rad);
}

// Steps through the insertion to come. A place counts if the tip jumps neither to it nor from it, since a base that is
// commanded to stop within a jump stops behind it. The result is the middle of the insertion over which the tip rests
// at the nearest place: a base that stops too early or too late by less than half of it leaves the tip there.
double AxisModel::insertion_to_nearest_mm(double ahead_mm) const {
  if (!advances_by_jumps_ || !entered_ || !(ahead_mm > 0) || ahead_mm > kLongestJump_mm) return ahead_mm;
  Tip tried = tip_;
  model::BaseMotion at = base_;
  double nearest_mm = ahead_mm, from_mm = 0, until_mm = 0;
  bool follows_jump = true;  // nothing is counted before the first step
  for (double inserted_mm = 0; inserted_mm < ahead_mm + kLongestJump_mm;) {
    const double step_mm = std::max(kFinestStep_mm, kStepShare * inserted_mm);
    const double before_mm = tried.insertion_mm - tip_.insertion_mm;
    const model::BaseMotion from = at;
    at.insertion_mm += step_mm;
    move(tried, from, at, tip_depth_mm_ + before_mm);
    const bool jumps = is_jump(tried.insertion_mm - tip_.insertion_mm - before_mm, step_mm);
    if (!jumps && !follows_jump) {
      const double off_mm = std::abs(ahead_mm - before_mm);
      if (off_mm < nearest_mm - kSamePlace_mm)
        nearest_mm = off_mm, from_mm = until_mm = inserted_mm;
      else if (off_mm <= nearest_mm + kSamePlace_mm)
        until_mm = inserted_mm;
      else if (before_mm > ahead_mm)
        break;
    }
    follows_jump = jumps;
    inserted_mm += step_mm;
  }
  return from_mm > 0 ? 0.5 * (from_mm + until_mm) : 0;
}

double base_rate_rad_s(double tip_rate_rad_s, double take_up_rad, double share, const SteeringLimits& limits) {
  if (!(take_up_rad > 0)) return tip_rate_rad_s;
  const double extra = share * std::sqrt(2 * kBrakingShare * limits.rotation_acceleration_rad_s2 * take_up_rad);
  return std::copysign(std::min(std::abs(tip_rate_rad_s) + extra, limits.rotation_rate_rad_s), tip_rate_rad_s);
}

}  // namespace bevel::controller
