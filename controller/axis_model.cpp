#include "controller/axis_model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace bevel::controller {
namespace {

// Longer than any dead band: the widest of a model file is 8 rad.
constexpr double kLongTurn_rad = 20;
constexpr double kLongInsertion_mm = 100;
constexpr double kBrakingShare = 0.5;  // of the acceleration, as at the closest approach

}  // namespace

AxisModel::AxisModel(std::vector<model::ActiveEffect> effects) : effects_(std::move(effects)) {
  if (effects_.size() > model::kMaxEffects)
    throw std::invalid_argument("a model has " + std::to_string(effects_.size()) + " effects; at most " +
                                std::to_string(model::kMaxEffects) + " are supported");
  // A discrepancy is no dead band: what it adds to a rate, the feedback takes care of, and a turn that comes in short
  // by a share would be taken for slack.
  std::erase_if(effects_, [](const model::ActiveEffect& active) { return active.owned != nullptr; });
  // Asked once, deep in the tissue, where a shaft has something to wind up, and with no time passing.
  Tip probe;
  move(probe, {});
  base_.insertion_mm = kLongInsertion_mm;
  move(probe, {0, kLongInsertion_mm, 0});
  const double before_rad = probe.rotation_rad;
  move(probe, {0, kLongInsertion_mm, kLongTurn_rad});
  turns_late_ = std::abs(probe.rotation_rad - before_rad - kLongTurn_rad) > 1e-9;
  base_ = {};
}

void AxisModel::move(Tip& tip, const model::BaseMotion& to) const {
  model::LegView leg;
  leg.entry = entry_;
  leg.from = base_;
  leg.to = to;
  leg.tip_depth_mm.value = tip_depth_mm_;
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
}

void AxisModel::follow(const model::ActuatorState& actuator, double tip_depth_mm) {
  if (!turns_late_) return;
  if (!entered_) {
    entered_ = true;
    entry_utime_ = actuator.utime;
    entry_ = base_ = {0, actuator.insertion_mm, actuator.rotation_rad};
    tip_.rotation_rad = actuator.rotation_rad;
  }
  tip_depth_mm_ = tip_depth_mm;
  const model::BaseMotion to{static_cast<double>(actuator.utime - entry_utime_) * 1e-6, actuator.insertion_mm,
                             actuator.rotation_rad};
  move(tip_, to);
  base_ = to;
}

double AxisModel::take_up_rad(double direction) const {
  if (!turns_late_ || !entered_ || direction == 0) return 0;
  Tip tried = tip_;
  const double turn_rad = std::copysign(kLongTurn_rad, direction);
  move(tried, {base_.time_s, base_.insertion_mm, base_.rotation_rad + turn_rad});
  return std::clamp(kLongTurn_rad - std::abs(tried.rotation_rad - tip_.rotation_rad), 0.0, kLongTurn_rad);
}

double base_rate_rad_s(double tip_rate_rad_s, double take_up_rad, double share, const SteeringLimits& limits) {
  if (!(take_up_rad > 0)) return tip_rate_rad_s;
  const double extra = share * std::sqrt(2 * kBrakingShare * limits.rotation_acceleration_rad_s2 * take_up_rad);
  return std::copysign(std::min(std::abs(tip_rate_rad_s) + extra, limits.rotation_rate_rad_s), tip_rate_rad_s);
}

}  // namespace bevel::controller
