// SPDX-License-Identifier: MIT
// What the simulated drive's objects of CiA 402 do to its motor, and the motor to them: modes of operation, ramps,
// limits, supervision of the following error, status.
#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/rig/drives/simulated_drive.hpp>

namespace bevel::rig {
namespace {

constexpr int kProfileVelocity = 3;
constexpr int kHoming = 6;
constexpr int kCyclicVelocity = 9;
constexpr std::uint16_t kStartHoming = 1U << 4;  // controlword
constexpr std::uint16_t kHalt = 1U << 8;
constexpr unsigned kRemote = 1U << 9;  // statusword
constexpr unsigned kTargetReached = 1U << 10;
constexpr unsigned kInternalLimit = 1U << 11;
constexpr unsigned kStandsOrFollows = 1U << 12;  // pv: speed is 0; csv: follows its target
constexpr std::uint16_t kFollowingError = 0x8611;
constexpr std::uint32_t kNegativeSwitch = 1U << 0;  // 60FD
constexpr std::uint32_t kPositiveSwitch = 1U << 1;
constexpr double kRests_per_s = 0.5;

std::uint32_t rounded(double value) {
  constexpr double kLow = std::numeric_limits<std::int32_t>::min();
  constexpr double kHigh = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::llround(std::clamp(value, kLow, kHigh))));
}

}  // namespace

double SimulatedDrive::quick_stop_ramp() const {
  // 605A: 1 and 5 brake by the profile's deceleration, 2 and 6 by that of the quick stop.
  const int option = od_.get_signed(0x605A);
  const bool slowly = power_.state() == PowerStateMachine::State::quick_stop_active && (option == 1 || option == 5);
  return od_.get(slowly ? 0x6084 : 0x6085) / units_.velocity_per_increment;
}

double SimulatedDrive::wanted_increments_s() const {
  if ((od_.get(0x6040) & kHalt) != 0) return 0.0;
  const int mode = od_.get_signed(0x6061);
  if (mode == kHoming) return homing_.target();
  if (mode != kProfileVelocity && mode != kCyclicVelocity) return 0.0;
  const double limit = od_.get(0x607F);
  return std::clamp(static_cast<double>(od_.get_signed(0x60FF)), -limit, limit) / units_.velocity_per_increment;
}

double SimulatedDrive::ramp_increments_s2(double target) const {
  const int mode = od_.get_signed(0x6061);
  if (mode == kCyclicVelocity && (od_.get(0x6040) & kHalt) == 0) return cyclic_ramp_;
  const bool speeds_up = std::abs(target) > std::abs(motion_.demand_per_s());
  const std::uint16_t ramp = mode == kHoming ? 0x609A : speeds_up ? 0x6083 : 0x6084;
  return od_.get(ramp) / units_.velocity_per_increment;
}

TravelLimits SimulatedDrive::travel_limits() const {
  TravelLimits limits;
  // Before homing has told where it is, a drive on its way to the switches must be let go there.
  if (!homing_.runs()) {
    limits.low = zero_increments_ + od_.get_signed(0x607D, 1) / units_.position_per_increment;
    limits.high = zero_increments_ + od_.get_signed(0x607D, 2) / units_.position_per_increment;
    limits.negative_switch = negative_switch();
    limits.positive_switch = positive_switch();
  }
  return limits;
}

void SimulatedDrive::advance_homing() {
  const Homing::Inputs inputs{negative_switch(), positive_switch(),
                              motion_.demand_per_s() == 0.0 && std::abs(motion_.velocity_per_s()) < kRests_per_s};
  if (homing_.step(inputs)) {
    // 607C: from home to the zero of the application.
    zero_increments_ = motion_.position() + od_.get_signed(0x607C) / units_.position_per_increment;
  }
}

// The drive's own control cycle: limits and switches are looked at a thousand times a second, however late step() is.
void SimulatedDrive::advance(double dt_s) {
  constexpr double kCycle_s = 0.001;
  constexpr double kMostCycles = 1000.0;  // of one step
  const double cycles = std::clamp(std::ceil(dt_s / kCycle_s), 1.0, kMostCycles);
  for (int i = 0; i < static_cast<int>(cycles); ++i) advance_cycle(dt_s / cycles);
}

void SimulatedDrive::advance_cycle(double dt_s) {
  at_limit_ = false;
  if (power_stage_stuck_) {
    motion_.step(dt_s, motion_.demand_per_s(), 1.0);
  } else if (power_.moves()) {
    advance_homing();
    const double wanted = wanted_increments_s();
    const double stop_ramp = od_.get(0x6085) / units_.velocity_per_increment;
    const double target = travel_limits().left_of(wanted, motion_.demand_position(), stop_ramp);
    at_limit_ = target != wanted;
    motion_.step(dt_s, target, at_limit_ ? stop_ramp : ramp_increments_s2(target));
  } else if (power_.brakes()) {
    motion_.step(dt_s, 0.0, quick_stop_ramp());
    if (motion_.demand_per_s() == 0.0) power_.on_standstill(od_.get_signed(0x605A));
  } else if (power_.has_torque()) {
    motion_.step(dt_s, 0.0, od_.get(0x6084) / units_.velocity_per_increment);  // "disable operation" ramps down
  } else {
    motion_.let_go();
  }
  if (!power_.moves()) homing_.interrupt();
  supervise_following(dt_s);
}

void SimulatedDrive::supervise_following(double dt_s) {
  constexpr std::uint32_t kOff = 0xFFFFFFFF;
  const std::uint32_t window = od_.get(0x6065);
  const double error = std::abs(motion_.following_error()) * units_.position_per_increment;
  const bool off_track = window != kOff && error > static_cast<double>(window);
  following_error_s_ = off_track ? following_error_s_ + dt_s : 0.0;
  if (off_track && power_.moves() && following_error_s_ * 1000.0 > static_cast<double>(od_.get(0x6066)))
    raise_fault(kFollowingError);
}

unsigned SimulatedDrive::mode_bits() const {
  const bool rests = motion_.demand_per_s() == 0.0 && std::abs(motion_.velocity_per_s()) < kRests_per_s;
  const bool halted = (od_.get(0x6040) & kHalt) != 0;
  unsigned bits = 0;
  switch (od_.get_signed(0x6061)) {
    case kProfileVelocity:
      if (power_.moves() && (halted ? rests : motion_.demand_per_s() == wanted_increments_s())) bits |= kTargetReached;
      if (rests) bits |= kStandsOrFollows;
      return bits;
    case kHoming:
      return homing_.statusword_bits(rests);
    case kCyclicVelocity:
      return power_.moves() && !halted && !at_limit_ ? kStandsOrFollows : 0;
    default:
      return 0;
  }
}

void SimulatedDrive::update_status() {
  const double position = (motion_.position() - zero_increments_) * units_.position_per_increment;
  od_.set(0x6041, 0, power_.statusword_bits() | kRemote | mode_bits() | (at_limit_ ? kInternalLimit : 0));
  od_.set(0x6064, 0, rounded(position));
  if (config_.dialect.shows_mode_only_enabled) od_.set(0x6061, 0, power_.moves() ? od_.get(0x6060) : 0);
  od_.set(0x606C, 0, rounded(motion_.velocity_per_s() * units_.velocity_per_increment));
  od_.set(0x60F4, 0, rounded(motion_.following_error() * units_.position_per_increment));
  od_.set(0x60FD, 0, (negative_switch() ? kNegativeSwitch : 0) | (positive_switch() ? kPositiveSwitch : 0));
}

// csv: a new target is reached by an even ramp within the interpolation time, 60C2:1 times ten to the power of 60C2:2
// s.
void SimulatedDrive::on_new_target() {
  const double target = wanted_increments_s();
  // The same target again, in a cycle that began a little early, must not make what is left of its ramp flatter.
  if (target == cyclic_target_ && cyclic_ramp_ > 0.0) return;
  const double within_s = od_.get(0x60C2, 1) * std::pow(10.0, od_.get_signed(0x60C2, 2));
  cyclic_target_ = target;
  cyclic_ramp_ = std::max(std::abs(target - motion_.demand_per_s()) / within_s, 1.0);
}

void SimulatedDrive::on_controlword() {
  const auto word = static_cast<std::uint16_t>(od_.get(0x6040));
  const bool was_fault = power_.state() == PowerStateMachine::State::fault;
  power_.on_controlword(word, od_.get_signed(0x605A));
  if (was_fault && power_.state() != PowerStateMachine::State::fault) {
    od_.set(0x603F, 0, 0);
    od_.set(0x1001, 0, 0);
    send_emergency(0);
  }
  const bool start = (word & kStartHoming) != 0;
  const bool started = (old_controlword_ & kStartHoming) != 0;
  old_controlword_ = word;
  if (od_.get_signed(0x6061) != kHoming || !power_.moves() || !start) return homing_.interrupt();
  if (!started)
    homing_.start({od_.get_signed(0x6098), od_.get(0x6099, 1) / units_.velocity_per_increment,
                   od_.get(0x6099, 2) / units_.velocity_per_increment});
}

void SimulatedDrive::written(std::uint16_t index) {
  switch (index) {
    case 0x6040:
      return on_controlword();
    case 0x6060:
      if (od_.get(0x6061) != od_.get(0x6060)) homing_.forget();
      od_.set(0x6061, 0, od_.get(0x6060));
      cyclic_ramp_ = 0.0;  // of another mode
      return on_new_target();
    case 0x60FF:
      return on_new_target();
    case 0x608F:
    case 0x6091:
    case 0x6092:
    case 0x6096:
      units_ = UnitFactors::of(od_, config_.dialect.velocity_unit);
      return;
    default:
      return;
  }
}

}  // namespace bevel::rig
