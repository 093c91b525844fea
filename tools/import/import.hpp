#pragma once
// What bevel-import does with its arguments.
#include <string>
#include <vector>

namespace bevel::importing {

struct Options {
  std::string map_path, out_folder = ".";
  std::vector<std::string> inputs, base;
};

// A usage error, or "".
std::string usage_fault(const Options& options);

// Writes a log a recording, says on stdout what is in each, on stderr what is odd. Returns the exit status. Throws
// std::runtime_error naming file, line and column of the first recording that cannot be used; logs before it are whole.
int run(const Options& options);

}  // namespace bevel::importing
