// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Limits of a TOML file, checked before it is parsed: toml++ recurses once for each part of a key and for each nested
/// table, and overflows the stack on 300 000 of them.
#include <cstdint>
#include <string>
#include <string_view>

namespace bevel::io {

/// The largest file that comes with the project has 3 kB; a file of this size is another kind of file.
inline constexpr std::size_t kLargestToml_bytes = std::size_t{1} << 20U;
/// The deepest key of any file that is read here has four parts.
inline constexpr int kLongestKey_parts = 16;
/// Arrays and inline tables within each other; no file that is read here has more than two.
inline constexpr int kDeepestNesting = 16;

/// Returns "", or a message with place, value, allowed range and remedy if a limit is exceeded.
/// @param text  contents of the file, valid TOML or not
/// @param name  start of the message
std::string toml_limit_exceeded(std::string_view text, const std::string& name);

}  // namespace bevel::io
