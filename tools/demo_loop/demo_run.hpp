// SPDX-License-Identifier: MIT
#pragma once
// The demo from start to end.
#include <string>
#include <vector>

namespace bevel::tools {

struct DemoOptions {
  std::string config_path;
  std::string out = "out/demo";
  std::string programs;  // folder of the five programs
  std::vector<double> target_mm{6, -9, 100};
  double retract_to_mm = -1;  // once it has arrived, until so much is inserted; below 0: not
  double tolerance_mm = 0;    ///< largest miss that counts as an arrival, mm; 0: the configured one
  double time_limit_s = 55;
  bool view = false;  // bevel-view beside the five; whatever becomes of it, the insertion goes on
  std::string fault;  // "" or as nodes::parse_fault() takes it: the demo then shows the stop
};

// Exit status: 0 the controller reports an arrival and the true tip is within the tolerance, 1 not, 130 interrupted.
// Throws for what keeps it from starting.
int run_demo(const DemoOptions& options);

}  // namespace bevel::tools
