// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// One line of the report of bevel-check.

#include <cstdint>
#include <string>
#include <vector>

namespace bevel::drivers {

/// Result of a check.
enum class Verdict : std::uint8_t {
  ok,         ///< within the allowed range
  failed,     ///< outside the allowed range
  not_tried,  ///< could not be, or must not be, measured now; the finding states why
};

/// A measured value, the allowed range, and the remedy.
struct Finding {
  std::string name;                      ///< what was checked
  Verdict verdict = Verdict::not_tried;  ///< result
  std::string measured;                  ///< measured value with its unit
  std::string allowed;                   ///< allowed range
  std::string remedy;                    ///< command line, or key of the system file; for Verdict::failed
};

using Findings = std::vector<Finding>;  ///< findings in the order of the report

/// Returns whether a check failed.
/// @param findings findings
/// @return true if at least one verdict is Verdict::failed
inline bool any_failed(const Findings& findings) {
  for (const Finding& finding : findings)
    if (finding.verdict == Verdict::failed) return true;
  return false;
}

/// Formats a table, each finding on a line and its remedy on the next.
/// @param findings findings
/// @return text with line breaks
std::string to_text(const Findings& findings);

}  // namespace bevel::drivers
