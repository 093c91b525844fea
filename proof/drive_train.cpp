// SPDX-License-Identifier: MIT
#include "proof/drive_train.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bevel::proof {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kElement_mm = 6.0;
constexpr double kLongest_mm = 150.0;

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

}  // namespace

ShaftChain::ShaftChain(double lag_at_100mm_rad, double element_mm, double longest_mm)
    : element_mm_(element_mm),
      // n equal elements lag n (n + 1) / 2 steps altogether, in the limit (length / element)^2 / 2 of them.
      slip_step_rad_(2.0 * lag_at_100mm_rad * std::pow(element_mm / 100.0, 2)),
      roll_rad_(static_cast<std::size_t>(longest_mm / element_mm) + 1, 0.0) {}

double ShaftChain::follow(double base_rad, double inserted_mm) {
  if (slip_step_rad_ <= 0.0) return base_rad;
  const double elements = std::clamp(inserted_mm / element_mm_, 0.0, static_cast<double>(roll_rad_.size() - 1));
  const auto whole = static_cast<std::size_t>(elements);
  const double part = std::max(elements - static_cast<double>(whole), 1e-6);  // of the element at the entry
  const std::size_t entry = whole;
  // Elements outside the tissue turn with the base.
  for (std::size_t i = entry + 1; i < roll_rad_.size(); ++i) roll_rad_[i] = base_rad;
  for (int sweep = 0; sweep < 400; ++sweep) {
    double change = 0;
    const auto settle = [&](std::size_t i) {
      // The entry's element is as stiff as it is short, and carries friction on the part that is inserted. Half an
      // element's friction sits at the tip, so that n elements lag n^2 / 2 steps, as a continuous shaft does.
      const double to_base = i == entry ? 1.0 / part : 1.0;
      const double to_tip = i == 0 ? 0.0 : 1.0;
      const double pull = to_base * (i == entry ? base_rad : roll_rad_[i + 1]) + (i == 0 ? 0.0 : roll_rad_[i - 1]);
      const double rest = pull / (to_base + to_tip);
      const double slack = slip_step_rad_ * (i == 0 ? 0.5 : 1.0) * (i == entry ? part : 1.0) / (to_base + to_tip);
      const double settled = std::clamp(roll_rad_[i], rest - slack, rest + slack);
      change = std::max(change, std::abs(settled - roll_rad_[i]));
      roll_rad_[i] = settled;
    };
    for (std::size_t i = entry + 1; i-- > 0;) settle(i);
    for (std::size_t i = 0; i <= entry; ++i) settle(i);
    if (change < 1e-7) break;
  }
  return roll_rad_[0];
}

double LooseGear::follow(double input) {
  if (half_ <= 0.0) return input;
  const double change = input - last_input_;
  last_input_ = input;
  const double gap = (input - output_) * (change < 0 ? -1.0 : 1.0);
  if (give_ > 0.0) output_ += change * smooth_step((gap - (half_ - give_)) / give_);
  output_ = std::clamp(output_, input - half_, input + half_);
  return output_;
}

DriveTrain::DriveTrain(const HiddenPhysics& physics, const DriveRipple& ripple, int recording)
    : physics_(physics),
      ripple_(ripple),
      lost_at_s_(physics.lost_at_s.at(static_cast<std::size_t>(recording))),
      insertion_gear_(physics.insertion_backlash_mm, 0.12 * physics.departure * physics.insertion_backlash_mm),
      rotation_gear_(physics.rotation_backlash_rad, 0.12 * physics.departure * physics.rotation_backlash_rad),
      chain_(physics.departure > 0 ? physics.windup_lag_at_100mm_rad : 0.0, kElement_mm, kLongest_mm) {}

double DriveTrain::lost_share(double time_s) const {
  if (lost_at_s_ <= 0.0) return 0.0;
  const double spread_s = 0.03 * physics_.departure;  // steps are lost one after another
  if (spread_s <= 0.0) return time_s >= lost_at_s_ ? 1.0 : 0.0;
  return std::clamp((time_s - lost_at_s_) / spread_s, 0.0, 1.0);
}

// Rollers slip a little more on one side of their turn.
double DriveTrain::feed(double time_s, double base_mm) {
  const double unevenness = 0.2 * physics_.departure * std::cos(kTurn * base_mm / 25.0);
  const double ratio = 1.0 - (1.0 - physics_.insertion_ratio) * (1.0 + unevenness);
  fed_mm_ += (base_mm - last_base_mm_) * ratio * (1.0 - physics_.slip_growth_per_s * time_s);
  last_base_mm_ = base_mm;
  return fed_mm_;
}

// The tip bulges a membrane until the shaft is `indentation_mm` behind its base, then goes through and catches up.
double DriveTrain::membrane(double advance_mm, double depth_mm) {
  if (physics_.indentation_mm <= 0.0) return advance_mm;
  const double creep = 0.08 * physics_.departure;
  if (membrane_ == Membrane::whole && depth_mm >= physics_.puncture_depth_mm) {
    membrane_ = Membrane::loaded;
    // A tip that jumps is stopped by it and does not land beyond.
    if (physics_.stick_slip_mm > 0.0) membrane_lag_mm_ = depth_mm - physics_.puncture_depth_mm;
  }
  if (membrane_ == Membrane::loaded) {
    membrane_lag_mm_ += (advance_mm - last_advance_mm_) * (1.0 - creep);
    if (membrane_lag_mm_ < 0.0) membrane_ = Membrane::whole;
    if (membrane_lag_mm_ >= physics_.indentation_mm) membrane_ = Membrane::open;
    membrane_lag_mm_ = std::max(membrane_lag_mm_, 0.0);
  } else if (membrane_ == Membrane::open) {
    membrane_lag_mm_ *= physics_.departure > 0 ? std::exp(-kStep_s / (0.04 * physics_.departure)) : 0.0;
  }
  last_advance_mm_ = advance_mm;
  return advance_mm - membrane_lag_mm_;
}

// Pushed, the shaft bows between its feeder and the entry, which is why others support it there (Webster, Memisevic and
// Okamura 2005, "Design considerations for robotic needle steering", ICRA). A bow of amplitude w0 shortens a free
// length l by w0^2 l P / (2 EI) under a push P (Timoshenko and Gere, initial curvature, P far below the buckling load);
// where feeder and entry are out of line w0 grows with l, and P with the friction on the inserted length L: L l^3. What
// pulls straightens it.
double DriveTrain::bow(double advance_mm) {
  if (physics_.bow_mm <= 0.0) return advance_mm;
  constexpr double kFree_mm = 130.0;  // before the needle enters
  constexpr double kTakeUp_mm = 2.0;
  const double change_mm = advance_mm - last_unbowed_mm_;
  last_unbowed_mm_ = advance_mm;
  const double wanted = change_mm > 0.0 ? 1.0 : 0.0;
  bowed_ = wanted + (bowed_ - wanted) * std::exp(-std::abs(change_mm) / kTakeUp_mm);
  const double in_tissue = std::clamp(advance_mm / kFree_mm, 0.0, 1.0);
  const double most = 0.25 * std::pow(0.75, 3);  // a quarter is in, three quarters are free
  return advance_mm - physics_.bow_mm * bowed_ * in_tissue * std::pow(1.0 - in_tissue, 3) / most;
}

// Friction, so much per inserted length (Okamura, Simone and O'Leary 2004, IEEE Trans. Biomed. Eng. 51), presses the
// shaft and the tissue about it together while it moves. Both give way and recover as two Kelvin bodies in series, one
// quick and one slow.
double DriveTrain::creep(double advance_mm, double inserted_mm) {
  if (physics_.creep_at_100mm_mm <= 0.0) return advance_mm;
  constexpr double kQuick_s = 0.4;
  constexpr double kSlow_s = 4.0;
  constexpr double kSlides_mm_s = 0.5;  // friction is full from about here on
  const double speed_mm_s = (advance_mm - last_fed_mm_) / kStep_s;
  last_fed_mm_ = advance_mm;
  const double full_mm = physics_.creep_at_100mm_mm * inserted_mm / 100.0 * std::tanh(speed_mm_s / kSlides_mm_s);
  creep_quick_mm_ += (0.5 * full_mm - creep_quick_mm_) * kStep_s / kQuick_s;
  creep_slow_mm_ += (0.5 * full_mm - creep_slow_mm_) * kStep_s / kSlow_s;
  return advance_mm - creep_quick_mm_ - creep_slow_mm_;
}

// Friction at rest holds the tip until the shaft has taken up a jump's length; then it slides that far, against a
// friction of its own under which the shaft came in: only a reversal has to overcome that one as well.
double DriveTrain::friction_hold(double advance_mm) {
  const double jump_mm = physics_.stick_slip_mm;
  if (jump_mm <= 0.0) return advance_mm;
  const double sliding_mm = 0.15 * physics_.departure * jump_mm;
  const double pull_mm = advance_mm - slides_to_mm_ + sliding_mm;
  if (std::abs(pull_mm) > jump_mm + sliding_mm) slides_to_mm_ += pull_mm > 0.0 ? jump_mm : -jump_mm;
  const double left = physics_.departure > 0.0 ? std::exp(-kStep_s / (0.004 * physics_.departure)) : 0.0;
  held_mm_ = slides_to_mm_ + (held_mm_ - slides_to_mm_) * left;
  return held_mm_;
}

double DriveTrain::first_friction_hold(double advance_mm) {
  if (physics_.first_stick_slip_mm <= 0.0) return advance_mm;
  const double stretch = advance_mm - held_mm_;
  if (std::abs(stretch) > physics_.first_stick_slip_mm) slipping_ = true;
  if (slipping_) held_mm_ += stretch * kStep_s / 0.015;
  if (std::abs(stretch) < 0.15 * physics_.first_stick_slip_mm) slipping_ = false;
  return held_mm_;
}

// A grip by friction creeps by a share of the way that grows with its load (Johnson 1985, Contact Mechanics), here
// the torque of the tissue on the inserted length. What has slipped does not come back.
double DriveTrain::chuck(double roll_rad, double inserted_mm) {
  if (physics_.chuck_slip_at_100mm <= 0.0) return roll_rad;
  chuck_lost_rad_ += physics_.chuck_slip_at_100mm * inserted_mm / 100.0 * (roll_rad - last_chucked_rad_);
  last_chucked_rad_ = roll_rad;
  return roll_rad - chuck_lost_rad_;
}

DriveTrain::Tip DriveTrain::step(double time_s, double insertion_mm, double rotation_rad, double depth_mm) {
  const double lost = lost_share(time_s);
  const auto wave = [](double x, double phase) { return std::sin(x + phase) - std::sin(phase); };
  const double base_mm =
      insertion_mm + lost * physics_.lost_insertion_mm +
      ripple_.insertion_mm * wave(kTurn * insertion_mm / ripple_.insertion_period_mm, ripple_.insertion_phase_rad);
  const double base_rad = rotation_rad + lost * physics_.lost_rotation_rad +
                          ripple_.rotation_rad * wave(2.0 * rotation_rad, ripple_.rotation_phase_rad);

  const double fed_mm = feed(time_s, insertion_gear_.follow(base_mm));
  double advance_mm = membrane(friction_hold(creep(bow(fed_mm), std::max(fed_mm, 0.0))), depth_mm);
  advance_mm = first_friction_hold(advance_mm) + physics_.screw_mm_per_rad * rotation_rad;

  const double inserted_mm = std::max(insertion_mm, 0.0);
  const double geared_rad = chuck(rotation_gear_.follow(base_rad), inserted_mm);
  const double lag_rad = physics_.windup_lag_at_100mm_rad * std::pow(inserted_mm / 100.0, 2);
  play_rad_ = std::clamp(play_rad_, geared_rad - lag_rad, geared_rad + lag_rad);
  double roll_rad = play_rad_;
  if (physics_.departure > 0.0) roll_rad += physics_.departure * (chain_.follow(geared_rad, inserted_mm) - play_rad_);
  roll_rad += physics_.bevel_offset_rad + physics_.self_rotation_rad_per_mm * inserted_mm +
              physics_.roll_friction_rad * std::sin(2.0 * geared_rad) * 0.5;
  return {advance_mm, roll_rad};
}

}  // namespace bevel::proof
