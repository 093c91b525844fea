// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Age of time stamps. Time stamps come from outside and can have any int64 value. Differences therefore saturate, so
/// that an overflow never makes an extreme time stamp appear recent.
#include <cstdint>
#include <limits>

namespace bevel::model {

/// Computes later - earlier, saturated at the limits of int64.
/// @param later time, us
/// @param earlier time, us
/// @return the difference, us
constexpr std::int64_t difference_saturated(std::int64_t later, std::int64_t earlier) {
  std::int64_t difference = 0;
  if (!__builtin_sub_overflow(later, earlier, &difference)) return difference;
  return later < earlier ? std::numeric_limits<std::int64_t>::min() : std::numeric_limits<std::int64_t>::max();
}

/// Computes the age of a time stamp, saturated at the limits of int64.
/// @param now_utime present time, us since the epoch
/// @param utime time stamp, us since the epoch
/// @return the age, us; negative for a time stamp in the future
constexpr std::int64_t age_us(std::int64_t now_utime, std::int64_t utime) {
  return difference_saturated(now_utime, utime);
}
/// Computes the age of a time stamp in seconds.
/// @param now_utime present time, us since the epoch
/// @param utime time stamp, us since the epoch
/// @return the age, s; negative for a time stamp in the future
constexpr double age_s(std::int64_t now_utime, std::int64_t utime) {
  return static_cast<double>(age_us(now_utime, utime)) * 1e-6;
}

}  // namespace bevel::model
