// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Check by measurement that a stopped axis comes to rest.

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace bevel::stepper {

/// One measurement of an axis. Unit is mm for the insertion axis, rad for the rotation axis.
struct AxisSample {
  std::int64_t sampled_ns = 0;        ///< steady clock; when the drive took the position
  std::int64_t rate_received_ns = 0;  ///< when the rate was received
  /// Position, mm or rad.
  double position_unit = 0.0;
  double rate_unit_s = 0.0;         ///< as the drive reports it (0x606C)
  double travel_rate_unit_s = 0.0;  ///< from the newest two positions
  double resolution_unit = 0.0;     ///< one count of the position
  double resolution_unit_s = 0.0;   ///< one count of the rate
};

/// Checks by measurement that a commanded stop is carried out.
///
/// From the stop on, the axis may travel at most as far as an axis that keeps its speed v for a reaction time and then
/// brakes by the ramp a: v t, then v t - a (t - t_reaction)^2 / 2, in all v t_reaction + v^2 / (2 a). It must report
/// that it is stationary once reaction, ramp and reporting have passed, and must stay where it came to rest.
/// Pure: holds no clock and does not allocate.
class RestWatch {
 public:
  /// Result of the check.
  enum class Verdict : std::uint8_t {
    inactive,       ///< begin() was not called
    slowing,        ///< within the expected travel, not stationary yet
    at_rest,        ///< measured: stationary, and still where it came to rest
    does_not_stop,  ///< measured: beyond the expected travel, moving past the deadline, or moving again
  };

  /// Starts a watch.
  /// @param now_ns       when the stop was commanded, steady clock, ns
  /// @param before       newest measurement before the stop
  /// @param fastest_unit_s largest speed that the axis may have, as commanded or measured, mm/s or rad/s; >= 0
  /// @param ramp_unit_s2 deceleration that the drive was configured with, mm/s^2 or rad/s^2; > 0
  /// @param reaction_ns  from the command to the beginning of the ramp, ns
  /// @param reporting_ns from the end of the ramp to a measurement that shows it, ns
  void begin(std::int64_t now_ns, const AxisSample& before, double fastest_unit_s, double ramp_unit_s2,
             std::int64_t reaction_ns, std::int64_t reporting_ns) {
    verdict_ = Verdict::slowing;
    from_ = last_ = before;
    begun_ns_ = now_ns;
    speed_unit_s_ = fastest_unit_s;
    ramp_unit_s2_ = ramp_unit_s2;
    reaction_ns_ = reaction_ns;
    deadline_ns_ = now_ns + reaction_ns + reporting_ns + std::llround(1e9 * fastest_unit_s / ramp_unit_s2);
  }

  /// Ends the watch; the verdict is Verdict::inactive.
  void end() { verdict_ = Verdict::inactive; }

  /// Moves the origin of the positions.
  /// @param position_unit position that is 0 from now on, mm or rad
  void set_zero(double position_unit) {
    from_.position_unit -= position_unit;
    last_.position_unit -= position_unit;
    rested_unit_ -= position_unit;
  }

  /// Evaluates the newest measurement.
  /// @param now_ns  steady clock, ns
  /// @param sample  newest measurement
  /// @param is_held false if the drive no longer holds the axis: it may be moved by hand once it has come to rest
  /// @return verdict, which stays does_not_stop once it is
  Verdict check(std::int64_t now_ns, const AxisSample& sample, bool is_held) {
    if (verdict_ == Verdict::inactive || verdict_ == Verdict::does_not_stop) return verdict_;
    if (verdict_ == Verdict::at_rest) {
      if (!is_held) rested_unit_ = sample.position_unit;
      if (std::abs(sample.position_unit - rested_unit_) > kLeast_unit + 2 * sample.resolution_unit)
        verdict_ = Verdict::does_not_stop;
      return verdict_;
    }
    if (sample.sampled_ns - last_.sampled_ns < kLeastInterval_ns && sample.sampled_ns != last_.sampled_ns)
      return verdict_;  // too close to the previous one to determine a rate
    // An axis that has just started is still before the stop has had an effect.
    const bool fresh = sample.sampled_ns > last_.sampled_ns && sample.sampled_ns >= begun_ns_ + reaction_ns_;
    if (fresh && is_stationary(sample)) {
      verdict_ = Verdict::at_rest;
      rested_unit_ = sample.position_unit;
    } else if (std::abs(sample.position_unit - from_.position_unit) >
                   expected_travel_unit(now_ns) + kLeast_unit + 2 * sample.resolution_unit ||
               (fresh && now_ns > deadline_ns_)) {
      verdict_ = Verdict::does_not_stop;
    }
    if (sample.sampled_ns > last_.sampled_ns) last_ = sample;
    return verdict_;
  }

  /// @return verdict of the last check()
  Verdict verdict() const { return verdict_; }
  /// Returns whether the axis should have been measured at rest.
  /// @param now_ns steady clock, ns
  /// @return true if the verdict is still Verdict::slowing after the deadline
  bool is_overdue(std::int64_t now_ns) const { return verdict_ == Verdict::slowing && now_ns > deadline_ns_; }

 private:
  bool is_stationary(const AxisSample& sample) const {
    const double dt_s = static_cast<double>(sample.sampled_ns - last_.sampled_ns) * 1e-9;
    const double travelled = std::abs(sample.position_unit - last_.position_unit);
    // A rate that was received before the stop is not used; the position alone decides then.
    const bool rate_known = sample.rate_received_ns >= begun_ns_;
    return (!rate_known || std::abs(sample.rate_unit_s) <= kStationary_unit_s + sample.resolution_unit_s) &&
           travelled <= kStationary_unit_s * dt_s + 2 * sample.resolution_unit;
  }

  double expected_travel_unit(std::int64_t now_ns) const {
    // The position before the stop is as old as its sample; until the stop the axis kept its speed.
    const double keeps_s = static_cast<double>(begun_ns_ + reaction_ns_ - from_.sampled_ns) * 1e-9;
    const double t_s = static_cast<double>(now_ns - from_.sampled_ns) * 1e-9;
    const double braking_s = std::clamp(t_s - keeps_s, 0.0, speed_unit_s_ / ramp_unit_s2_);
    return speed_unit_s_ * (std::min(t_s, keeps_s) + braking_s) - 0.5 * ramp_unit_s2_ * braking_s * braking_s;
  }

  static constexpr std::int64_t kLeastInterval_ns = 5'000'000;  // half the shortest usual period
  static constexpr double kLeast_unit = 0.05;                   // mm or rad: play, steps, an encoder's noise
  static constexpr double kStationary_unit_s = 0.05;            // mm/s or rad/s

  Verdict verdict_ = Verdict::inactive;
  AxisSample from_{}, last_{};
  std::int64_t begun_ns_ = 0;
  std::int64_t deadline_ns_ = 0;
  std::int64_t reaction_ns_ = 0;
  double speed_unit_s_ = 0.0;
  double ramp_unit_s2_ = 1.0;
  double rested_unit_ = 0.0;
};

}  // namespace bevel::stepper
