// SPDX-License-Identifier: MIT
// bevel-replay: logs through the estimator that runs live, deterministic and faster than real time.
#include <iostream>

#include <bevel/analysis/replay/batch.hpp>
#include <bevel/cli/command_line.hpp>

int main(int argc, char** argv) {
  using namespace bevel::analysis;
  BatchOptions options;
  bevel::cli::CommandLine command_line(
      "bevel-replay", "Replays logs through the estimator: consistency, parameters, error against the truth.");
  command_line.arguments("LOG", options.paths, "logs, or folders of them; with --cases folders of cases")
      .reads_recordings()
      .example("bevel-replay --system config/demo.toml --out replayed out/demo/insertion.lcm")
      .option("-m,--model", options.model_path, "model file (TOML); not with --cases")
      .option("-s,--system", options.system_path, "instead of -m and -c: the rig's file, with its estimator's settings")
      .option("-c,--config", options.config_path, "estimator settings (TOML); see docs/estimator.md")
      .option("-o,--out", options.out_folder, "folder for CSV files and a page per log")
      .positive("--ahead-mm", options.ahead_mm, "distance over which the filter is asked to predict")
      .flag("--bicycle", options.bicycle, "the plain bicycle: lambda held at zero")
      .flag("--without-headings", options.without_headings, "leave TIP_HEADING out")
      .flag("--held-out", options.held_out, "start each log from k and lambda learned on the others")
      .positive("--width", options.width, "prior of --held-out: share of [prior]'s standard deviations")
      .flag("--cases", options.cases, "a table, one line per folder with model.toml and logs")
      .check([&]() -> std::string {
        const int given = !options.model_path.empty() + !options.system_path.empty() + options.cases;
        if (given != 1) return "exactly one of --model, --system, --cases is required";
        if (options.cases && options.held_out) return "--cases excludes --held-out";
        return options.system_path.empty() || options.config_path.empty() ? "" : "--system excludes --config";
      });
  return command_line.run(argc, argv, [&] {
    return options.cases ? run_cases(options, std::cout, std::cerr) : run(options, std::cout, std::cerr);
  });
}
