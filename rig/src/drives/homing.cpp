// SPDX-License-Identifier: MIT
#include <bevel/rig/drives/homing.hpp>

namespace bevel::rig {
namespace {

constexpr int kNegativeSwitch = 17;
constexpr int kPositiveSwitch = 18;
constexpr std::uint16_t kTargetReached = 1U << 10;
constexpr std::uint16_t kAttained = 1U << 12;
constexpr std::uint16_t kError = 1U << 13;

}  // namespace

void Homing::end(Phase how) {
  phase_ = how;
  target_ = 0.0;
}

void Homing::start(const Settings& settings) {
  settings_ = settings;
  end(knows(settings.method) ? Phase::to_switch : Phase::failed);
}

void Homing::interrupt() {
  if (runs()) end(Phase::idle);
}

bool Homing::step(const Inputs& inputs) {
  if (!runs()) return false;
  if (settings_.method != kNegativeSwitch && settings_.method != kPositiveSwitch) {
    end(Phase::attained);
    return true;
  }
  const bool negative = settings_.method == kNegativeSwitch;
  const double sign = negative ? -1.0 : 1.0;
  const bool on_switch = negative ? inputs.negative_switch : inputs.positive_switch;
  const bool on_other = negative ? inputs.positive_switch : inputs.negative_switch;
  // Both at once is a broken wire; the other one while leaving the first, a motor that turns the wrong way.
  if (on_other && (on_switch || phase_ == Phase::off_switch)) {
    end(Phase::failed);
    return false;
  }
  if (phase_ == Phase::to_switch) {
    target_ = on_switch ? 0.0 : sign * settings_.switch_speed;
    if (on_switch && inputs.rests) phase_ = Phase::off_switch;
    return false;
  }
  target_ = -sign * settings_.release_speed;
  if (on_switch) return false;
  end(Phase::attained);
  return true;
}

std::uint16_t Homing::statusword_bits(bool rests) const {
  const std::uint16_t reached = rests ? kTargetReached : 0;
  switch (phase_) {
    case Phase::idle:
      return reached;  // interrupted, or not started
    case Phase::to_switch:
    case Phase::off_switch:
      return 0;
    case Phase::attained:
      return kAttained | reached;
    case Phase::failed:
      return kError | reached;
  }
  return 0;
}

}  // namespace bevel::rig
