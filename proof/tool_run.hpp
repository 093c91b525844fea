// SPDX-License-Identifier: MIT
#pragma once
// One run of the tool under test on one trial.
#include <atomic>

#include "proof/sandbox.hpp"

namespace bevel::proof {

struct ToolRun {
  fs::path program;
  fs::path given;    // the case: model.toml and logs
  fs::path output;   // exists, empty
  fs::path secret;   // folder that must not be visible: the campaign, with truths and seed
  fs::path console;  // the tool's stdout and stderr go to this file
  std::vector<fs::path> readable;
  double limit_s = 600;
  bool sealed = true;
};

struct ToolEnd {
  int exit_status = -1;  // 128 + signal if one ended it
  double seconds = 0;
  bool out_of_time = false;
  bool stopped = false;  // `stop` was set
};

// Runs PROGRAM --model M.toml --out DIR LOG..., ends it with everything it started when time is over or `stop` becomes
// non-zero. Throws IoError if it cannot be started or sealed, saying at which step.
ToolEnd run_tool(const ToolRun& run, const std::atomic<int>& stop);

}  // namespace bevel::proof
