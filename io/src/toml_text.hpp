// SPDX-License-Identifier: MIT
#pragma once
// Values as TOML writes them.
#include <string>
#include <string_view>
#include <vector>

namespace bevel::io {

// Reads back as the same double; with a point or an exponent, for TOML tells 20 from 20.0 and other readers may insist
// on the latter.
std::string toml_number(double value);
std::string toml_array(const std::vector<double>& values);
std::string toml_text(std::string_view plain);

}  // namespace bevel::io
