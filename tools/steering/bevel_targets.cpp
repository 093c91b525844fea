// SPDX-License-Identifier: MIT
// bevel-targets: steers to many targets in simulated time, on needles that are the filter's model and on some that are
// not. Exit status: 0 finished, 1 failed, 2 usage.
#include <iostream>
#include <thread>

#include <bevel/analysis/steering/targets.hpp>
#include <bevel/cli/command_line.hpp>

int main(int argc, char** argv) {
  bevel::analysis::TargetsOptions o;
  o.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  int seed = 1;
  bevel::cli::CommandLine command_line(
      "bevel-targets",
      "Steers to random targets in simulated time and prints how far from them the needle comes to rest.");
  command_line.example("bevel-targets --targets 20 --json targets.json")
      .option("-n,--targets", o.targets, "targets in each scenario", 1, 100000)
      .option("--seed", seed, "the same seed draws the same targets, needles and noise", 0, 2147483647)
      .option("--compared", o.compared, "of them by what the controller's own law is compared with", 1, 100000)
      .option("--scenario", o.scenario, "one of them, or all; without, those of the table")
      .option("--law", o.law, "one of them; without, all but half turns at rest")
      .option("--tube-share", o.tube_share, "of the law by arcs; below 0: as the controller has it", -1, 10)
      .option("--threads", o.threads, "at a time", 1, 256)
      .option("--json", o.json, "writes the figures to this file as well");
  return command_line.run(argc, argv, [&] {
    o.seed = static_cast<std::uint64_t>(seed);
    return bevel::analysis::run_targets(o, std::cout);
  });
}
