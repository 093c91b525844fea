// SPDX-License-Identifier: MIT
#pragma once
// What bevel-import does with its arguments.
#include <string>
#include <vector>

namespace bevel::analysis {

struct ImportOptions {
  std::string map_path, out_folder = ".";
  std::vector<std::string> inputs, base;
};

// A usage error, or "".
std::string usage_fault(const ImportOptions& options);

// Writes one log for each recording, prints on stdout what is in it and on stderr what is odd. A recording that cannot
// be used is reported with file, line and column on stderr and leaves no log; the others are written, and the exit
// status is
// 1. Throws IoError if no recording can be begun: the column map, the list of files.
int run(const ImportOptions& options);

}  // namespace bevel::analysis
