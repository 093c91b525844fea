// SPDX-License-Identifier: MIT
#pragma once
// What bevel-export does with its arguments.
#include <string>
#include <vector>

namespace bevel::analysis {

struct ExportOptions {
  std::string out_folder = ".";
  std::string format = "csv";  // or mcap
  std::vector<std::string> logs;
};

// Writes OUT/LOG/*.csv or OUT/LOG.mcap, LOG by io::result_names. Prints on stdout what is in each, on stderr what is
// odd. A log that cannot be used is reported on stderr and leaves nothing; the others are written, and the exit status
// is 1. Throws IoError if a path does not exist.
int run(const ExportOptions& options);

}  // namespace bevel::analysis
