// SPDX-License-Identifier: MIT
#pragma once
// How old a stamp is. Stamps come from outside and may be anything an int64 holds, so differences saturate: a stamp at
// the end of time is never "fresh" because its age has wrapped round.
#include <cstdint>
#include <limits>

namespace bevel::model {

// later - earlier, at the ends of int64 where it would not fit.
constexpr std::int64_t difference_saturated(std::int64_t later, std::int64_t earlier) {
  std::int64_t difference = 0;
  if (!__builtin_sub_overflow(later, earlier, &difference)) return difference;
  return later < earlier ? std::numeric_limits<std::int64_t>::min() : std::numeric_limits<std::int64_t>::max();
}

// Negative for a stamp from the future.
constexpr std::int64_t age_us(std::int64_t now_utime, std::int64_t utime) {
  return difference_saturated(now_utime, utime);
}
constexpr double age_s(std::int64_t now_utime, std::int64_t utime) {
  return static_cast<double>(age_us(now_utime, utime)) * 1e-6;
}

}  // namespace bevel::model
