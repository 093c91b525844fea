// bevel-replay: logs through the estimator that runs live, deterministic and faster than real time.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>

#include "tools/replay/batch.hpp"

int main(int argc, char** argv) {
  using namespace bevel::replay;
  CLI::App app("Replays logs through the estimator: consistency, parameters, error against the truth.", "bevel-replay");
  BatchOptions options;
  app.set_version_flag("--version", BEVEL_VERSION);
  app.add_option("LOG", options.paths, "logs, or folders of them; with --cases folders of cases")->required();
  auto* model = app.add_option("-m,--model", options.model_path, "model file (TOML)");
  app.add_option("-c,--config", options.config_path, "estimator settings (TOML); see docs/estimator.md");
  app.add_option("-o,--out", options.out_folder, "folder for CSV files and a page per log");
  app.add_option("--ahead-mm", options.ahead_mm, "distance over which the filter is asked to foretell")
      ->check(CLI::PositiveNumber);
  app.add_flag("--bicycle", options.bicycle, "the plain bicycle: lambda held at zero");
  auto* cases = app.add_flag("--cases", options.cases, "a table, one line per folder with model.toml and logs");
  model->excludes(cases);
  try {
    app.parse(argc, argv);
    if (!options.cases && options.model_path.empty()) throw CLI::RequiredError("--model");
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    // Speed goes to stderr, so that the output of the same logs is the same bytes.
    return options.cases ? run_cases(options, std::cout) : run(options, std::cout, std::cerr);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bevel-replay: %s\n", e.what());
    return 1;
  }
}
