// SPDX-License-Identifier: MIT
// bevel-diagnose: what physics the model in use leaves out, from recordings.
#include <algorithm>
#include <iostream>
#include <thread>

#include <bevel/analysis/diagnose/diagnose_tool.hpp>
#include <bevel/analysis/diagnose/result_files.hpp>
#include <bevel/cli/command_line.hpp>

int main(int argc, char** argv) {
  bevel::analysis::DiagnoseOptions o;
  o.threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 64);
  bevel::cli::CommandLine command_line(
      "bevel-diagnose", "Where the model in use goes wrong, what physics it leaves out, and the model with it.");
  command_line.arguments("LOG", o.logs, "logs of one rig, or folders of them: at least two logs", false)
      .paths("--baseline", o.baseline, "with --changed, in place of LOG: logs, or folders of them, as it was")
      .paths("--changed", o.changed, "the same, as it is now: what changed?")
      .check([&] { return bevel::analysis::usage_fault(o); })
      .reads_recordings()
      .example("bevel-diagnose --model model.toml --out verdict recordings/")
      .option("-m,--model", o.model_path, "the model in use (TOML)", true)
      .option("-o,--out", o.out_folder, "folder for verdict.json, report.html, model.toml and a proposed effect", true)
      .option("--threads", o.threads, "at work at once; the verdict does not depend on it", 1, 64)
      .option("--targets", o.targets, "steered to in simulated time, before and after; 0: none", 0, 1000)
      .flag("-q,--quiet", o.quiet, "no progress on stderr");
  bevel::analysis::end_on_signals("bevel-diagnose");
  return command_line.run(argc, argv, [&] { return bevel::analysis::run(o, std::cout, std::cerr); });
}
