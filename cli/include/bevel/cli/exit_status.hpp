// SPDX-License-Identifier: MIT
#pragma once
// Exit status of every program. 2 is CommandLine's own.

namespace bevel::cli {

inline constexpr int kOk = 0;
inline constexpr int kFailed = 1;
inline constexpr int kUsage = 2;
inline constexpr int kDamagedInput = 3;  // done, but the input was damaged; said on stderr

}  // namespace bevel::cli
