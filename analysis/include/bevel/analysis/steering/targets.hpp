// SPDX-License-Identifier: MIT
#pragma once
// Many targets in each scenario by each law, in simulated time: how far from them the needle comes to rest.
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace bevel::analysis {

struct TargetsOptions {
  int targets = 500;   // by the controller's own law
  int compared = 500;  // of them by the others, at most
  std::uint64_t seed = 1;
  std::string scenario;    // empty: those of the table; "all"
  std::string law;         // empty: all but flip
  double tube_share = -1;  // below 0: the controller's own
  int threads = 2;
  std::string json;  // path; empty: none
};

// Prints a table, on stderr how far it is; returns the exit status. Throws IoError for a scenario that there
// is not, naming those that there are, and where the file cannot be written.
int run_targets(const TargetsOptions& options, std::ostream& out);

}  // namespace bevel::analysis
