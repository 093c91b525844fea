#pragma once
// What bevel-export does with its arguments.
#include <string>
#include <vector>

namespace bevel::exporting {

struct Options {
  std::string out_folder = ".";
  std::string format = "csv";  // or mcap
  std::vector<std::string> logs;
};

// Writes OUT/LOG/*.csv or OUT/LOG.mcap, says on stdout what is in each, on stderr what is odd. Returns the exit status.
// Throws std::runtime_error naming the first log that cannot be used; what is written of those before it is whole.
int run(const Options& options);

}  // namespace bevel::exporting
