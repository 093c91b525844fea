// SPDX-License-Identifier: MIT
#pragma once
// Numbers in messages: as few digits as tell them, "nan" and "inf" as such.
#include <cstdio>
#include <string>

namespace bevel::camera {

inline std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

}  // namespace bevel::camera
