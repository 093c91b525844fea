// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Recordings without time stamps. A stepwise insertion by hand has an order of stops, but no clock. Its log states
/// this in its CONFIG: [recording] clock = "none".
#include <string>

#include <bevel/io/recording.hpp>

namespace bevel::io {

/// Text of the CONFIG of a log without a clock.
inline constexpr const char* kNoClockConfig =
    "# Stops of a stepwise insertion in their order: times between them mean nothing.\n"
    "[recording]\nclock = \"none\"\n";

/// Returns whether the times of a recording are meaningful.
/// @param recording  recording with the text of its CONFIG
/// @return false if CONFIG states clock = "none"; true otherwise, also if CONFIG is not TOML
bool has_clock(const Recording& recording);

}  // namespace bevel::io
