// SPDX-License-Identifier: MIT
// bevel-demo: starts the five processes, steers the simulated needle to a target, records, reports, ends everything.
// Exit status: 0 the needle arrived within the tolerance, as the controller reports and by the true tip; 1 it did not,
// or something failed; 2 usage; 130 interrupted.
#include <filesystem>

#include <bevel/cli/command_line.hpp>
#include <bevel/cli/shipped_file.hpp>
#include "tools/demo_loop/demo_run.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  tools::DemoOptions options;
  cli::CommandLine command_line("bevel-demo",
                                "Steers a simulated needle with all five processes and a rendered camera in the loop.");
  std::string plant = "kinematic", config;
  command_line.exit_status("130 interrupted")
      .example("bevel-demo --target 4,-10,95 --out somewhere")
      .choice("--plant", plant, "the simulated needle: the estimator's own model, or a beam in elastic tissue",
              {"kinematic", "beam"})
      .option("-c,--config", config, "system file; without, config/demo.toml or config/beam.toml by the plant")
      .numbers("--target", options.target_mm, "target in {A}, mm: x,y,z", 3)
      .option("--out", options.out, "folder for log, report and the processes' output")
      .option("--retract-to", options.retract_to_mm,
              "draw it back along its path once it has arrived, until so much is inserted, mm; below 0: not", -1, 400)
      .option("--tolerance", options.tolerance_mm,
              "largest miss that counts as an arrival, mm; without, controller.safety.arrival_tolerance_mm", 0.05, 20)
      .option("--time-limit", options.time_limit_s, "give up after, s", 1, 3600)
      .flag("--view", options.view, "show it on a live page while it runs")
      .option("--fault", options.fault,
              "break something and show the stop: COMPONENT:KIND@SECONDSs, as in camera:off@5s");
  return command_line.run(argc, argv, [&] {
    options.programs = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
    options.config_path =
        !config.empty() ? config : cli::shipped_file(plant == "beam" ? "config/beam.toml" : "config/demo.toml");
    return tools::run_demo(options);
  });
}
