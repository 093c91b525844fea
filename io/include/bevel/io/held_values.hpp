// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Sample-and-hold columns: a slow sensor's value that a faster table repeats until the next one arrives.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace bevel::io {

/// Result of find_held_values.
struct HeldValues {
  double period_s = 0;          ///< mean interval between new values
  double row_interval_s = 0;    ///< median interval between rows
  std::vector<bool> is_update;  ///< for each row; false: the row repeats the value of an earlier row
  std::size_t repeated = 0;     ///< number of rows that repeat a value
};

/// Detects a column whose value is held between regular updates.
///
/// A value counts as held if it changes at intervals that are multiples of one period, and this period is longer than
/// the interval between rows. An axis that stands still, and an encoder whose resolution is coarse at a varying speed,
/// change at irregular intervals and are not held values.
/// A value that stays the same for several periods has one update in each of them.
/// @param times_us  time of each row that has the value, increasing
/// @param is_new  whether the row's value differs from that of the row before; the first element is ignored
/// @return period and updates; nothing if the value is not held, or if it changes too rarely to decide
std::optional<HeldValues> find_held_values(std::span<const std::int64_t> times_us, const std::vector<bool>& is_new);

}  // namespace bevel::io
