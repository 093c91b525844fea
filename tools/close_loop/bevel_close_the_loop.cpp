// SPDX-License-Identifier: MIT
// bevel-close-the-loop: diagnoses a case, and shows rig, estimator and controller before and after.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <thread>

#include <bevel/analysis/close_loop/close_loop.hpp>
#include <bevel/analysis/diagnose/result_files.hpp>
#include <bevel/cli/command_line.hpp>
#include <bevel/cli/shipped_file.hpp>

int main(int argc, char** argv) {
  bevel::analysis::CloseLoopOptions o;
  std::vector<std::string> folders;
  o.threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 64);
  bevel::cli::CommandLine command_line(
      "bevel-close-the-loop",
      "Diagnoses a case, and shows what rig, estimator and controller make of the model before and after.");
  command_line.arguments("CASE", folders, "folder with model.toml and rec*.lcm")
      .reads_recordings()
      .example("bevel-close-the-loop --insertions 20 CASE")
      .option("-o,--out", o.out_folder, "folder for the results; out/close-the-loop/CASE if not given")
      .option("-c,--config", o.estimator_path,
              "the estimator's settings for the replays (TOML); without, tools/replay/strict.toml")
      .option("--insertions", o.targeting.seeds, "steered to each target with each model", 1, 1000)
      .option("--threads", o.threads, "at work at once; the results do not depend on it", 1, 64)
      .flag("-q,--quiet", o.quiet, "no progress on stderr")
      .check([&] { return folders.size() == 1 ? "" : "one CASE at a time"; });
  bevel::analysis::end_on_signals("bevel-close-the-loop");
  return command_line.run(argc, argv, [&] {
    o.folder = folders.front();
    if (o.estimator_path.empty()) o.estimator_path = bevel::cli::shipped_file("tools/replay/strict.toml");
    if (o.out_folder.empty())
      o.out_folder = "out/close-the-loop/" + std::filesystem::weakly_canonical(o.folder).filename().string();
    return bevel::analysis::run(o, std::cout, std::cerr);
  });
}
