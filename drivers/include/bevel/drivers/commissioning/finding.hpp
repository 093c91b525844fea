// SPDX-License-Identifier: MIT
// One line of bevel-check: what was measured, what is allowed, and what to type where it is not.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace bevel::drivers {

enum class Verdict : std::uint8_t {
  ok,
  failed,
  not_tried,  // could not be, or must not be, measured now; says why
};

struct Finding {
  std::string name;
  Verdict verdict = Verdict::not_tried;
  std::string measured;
  std::string allowed;
  std::string remedy;  // a command line, or a key of the system file; of what failed
};

using Findings = std::vector<Finding>;

inline bool any_failed(const Findings& findings) {
  for (const Finding& finding : findings)
    if (finding.verdict == Verdict::failed) return true;
  return false;
}

// A table for people, each finding on a line and its remedy on the next.
std::string to_text(const Findings& findings);

}  // namespace bevel::drivers
