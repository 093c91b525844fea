// SPDX-License-Identifier: MIT
#include <bevel/io/recording_clock.hpp>

#include <bevel/error.hpp>
#include <bevel/io/config.hpp>

namespace bevel::io {

bool has_clock(const Recording& recording) {
  if (recording.config.empty()) return true;
  try {
    std::string clock;
    ConfigFile::parse(recording.config, "CONFIG").section("recording", optional).read("clock", clock, optional);
    return clock != "none";
  } catch (const ConfigError&) {
    return true;
  }
}

}  // namespace bevel::io
