// SPDX-License-Identifier: MIT
#pragma once
// Recordings and frames by others, which are not part of this project: looked at where they lie, never copied. Needs
// BEVEL_SOURCE_DIR, which every test has.
#include <cstdlib>
#include <filesystem>

namespace bevel::test {

// $BEVEL_SHARED, or the folder `shared` beside the source tree; it need not be there.
inline std::filesystem::path shared_recordings() {
  const char* named = std::getenv("BEVEL_SHARED");
  return named != nullptr ? std::filesystem::path(named) : std::filesystem::path(BEVEL_SOURCE_DIR) / ".." / "shared";
}

}  // namespace bevel::test

// Skips the test that it stands in, saying why. In the test's own body: GTEST_SKIP() returns.
#define BEVEL_SKIP_WITHOUT(folder)      \
  if (!std::filesystem::exists(folder)) \
  GTEST_SKIP() << (folder) << " is not there; set BEVEL_SHARED to the folder of recordings"
