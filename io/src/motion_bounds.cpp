// SPDX-License-Identifier: MIT
#include <bevel/io/motion_bounds.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace bevel::io {
namespace {

// Drives overshoot their limit on the way to it, and stamps are those of the driver's cycle, not of the encoder.
constexpr double kRateShare = 1.5;
constexpr double kSlack_mm = 0.5;
constexpr double kSlack_rad = 0.2;
// A good filter's corrections stay within this many of its own standard deviations.
constexpr double kDeviations = 6;

double seconds(std::int64_t from_utime, std::int64_t to_utime) {
  return static_cast<double>(to_utime - from_utime) * 1e-6;
}

// Root of the largest diagonal element among three, from `first`.
double largest_sd(const needle_state_t& m, std::size_t first) {
  double variance = 0;
  for (std::size_t i = first; i < first + 3; ++i) variance = std::max(variance, m.covariance[10 * i]);
  return std::sqrt(variance);
}

// Reports at 100 Hz of an axis that moves differ by many encoder counts at these rates.
constexpr double kMoving_mm_s = 0.5;
constexpr double kMoving_rad_s = 0.5;
constexpr int kStillReports = 5;

}  // namespace

Implausible StandstillCheck::see(const actuator_state_t& before, const actuator_state_t& next) {
  const auto count = [](int& still, bool same, bool moving) { still = same && moving ? still + 1 : 0; };
  count(still_[0], next.insertion_mm == before.insertion_mm, std::abs(next.insertion_rate_mm_s) > kMoving_mm_s);
  count(still_[1], next.rotation_rad == before.rotation_rad, std::abs(next.rotation_rate_rad_s) > kMoving_rad_s);
  if (still_[0] >= kStillReports)
    return {"insertion that stands still at a rate", next.insertion_rate_mm_s, kMoving_mm_s, "mm/s"};
  if (still_[1] >= kStillReports)
    return {"rotation that stands still at a rate", next.rotation_rate_rad_s, kMoving_rad_s, "rad/s"};
  return {};
}

bool at_rest_and_off(const actuator_state_t& state) {
  return state.axis_status[0] <= 1 && state.axis_status[1] <= 1;  // off or ready
}

Implausible check_jump(const actuator_state_t& before, const actuator_state_t& next, const MotionBounds& bounds) {
  const double dt_s = std::abs(seconds(before.utime, next.utime));
  const double moved_mm = std::abs(next.insertion_mm - before.insertion_mm);
  const double room_mm = kRateShare * bounds.insertion_rate_mm_s * dt_s + kSlack_mm;
  if (!(moved_mm <= room_mm)) return {"jump of the insertion", moved_mm, room_mm, "mm"};
  const double turned_rad = std::abs(next.rotation_rad - before.rotation_rad);
  const double room_rad = kRateShare * bounds.rotation_rate_rad_s * dt_s + kSlack_rad;
  if (!(turned_rad <= room_rad)) return {"jump of the rotation", turned_rad, room_rad, "rad"};
  return {};
}

Implausible check_motion(const actuator_state_t& before, const actuator_state_t& next, const MotionBounds& bounds) {
  const double fastest_mm_s = kRateShare * bounds.insertion_rate_mm_s;
  const double fastest_rad_s = kRateShare * bounds.rotation_rate_rad_s;
  if (!(std::abs(next.insertion_rate_mm_s) <= fastest_mm_s))
    return {"insertion rate", next.insertion_rate_mm_s, fastest_mm_s, "mm/s"};
  if (!(std::abs(next.rotation_rate_rad_s) <= fastest_rad_s))
    return {"rotation rate", next.rotation_rate_rad_s, fastest_rad_s, "rad/s"};
  if (at_rest_and_off(before) && at_rest_and_off(next)) return {};
  return check_jump(before, next, bounds);
}

Implausible check_motion(const needle_state_t& before, const needle_state_t& next, const MotionBounds& bounds) {
  if (next.reset_count != before.reset_count) return {};
  const double dt_s = std::abs(seconds(before.utime, next.utime));
  double squared = 0;
  for (int i = 0; i < 3; ++i) {
    const double step = next.position_mm[i] - before.position_mm[i];
    squared += step * step;
  }
  const double sd_mm = std::max(largest_sd(before, 0), largest_sd(next, 0));
  const double room_mm = kRateShare * bounds.insertion_rate_mm_s * dt_s + kSlack_mm + kDeviations * sd_mm;
  if (!(std::sqrt(squared) <= room_mm)) return {"jump of the tip", std::sqrt(squared), room_mm, "mm"};
  double dot = 0;
  for (int i = 0; i < 4; ++i) dot += before.orientation_wxyz[i] * next.orientation_wxyz[i];
  const double turned_rad = 2 * std::acos(std::min(1.0, std::abs(dot)));
  const double sd_rad = std::max(largest_sd(before, 3), largest_sd(next, 3));
  const double room_rad = kRateShare * bounds.rotation_rate_rad_s * dt_s + kSlack_rad + kDeviations * sd_rad;
  if (!(turned_rad <= room_rad)) return {"turn of the tip", turned_rad, room_rad, "rad"};
  return {};
}

}  // namespace bevel::io
