// SPDX-License-Identifier: MIT
#pragma once
// Whether a log's times mean anything: a stepwise insertion by hand has an order of stops, and no clock. Its log says
// so in its CONFIG: [recording] clock = "none".
#include <string>

#include <bevel/io/recording.hpp>

namespace bevel::io {

inline constexpr const char* kNoClockConfig =
    "# Stops of a stepwise insertion in their order: times between them mean nothing.\n"
    "[recording]\nclock = \"none\"\n";

// False where the log's CONFIG says that there is none. Of text that is no TOML: true.
bool has_clock(const Recording& recording);

}  // namespace bevel::io
