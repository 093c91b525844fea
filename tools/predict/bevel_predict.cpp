// SPDX-License-Identifier: MIT
// bevel-predict: where the model says the tip was, from the axes alone.
#include <iostream>

#include <bevel/analysis/predict/predict.hpp>
#include <bevel/cli/command_line.hpp>
#include <bevel/error.hpp>
#include <bevel/io/find_logs.hpp>

int main(int argc, char** argv) {
  std::string model_path;
  std::vector<std::string> logs;
  bevel::cli::CommandLine command_line(
      "bevel-predict",
      "Integrates the model with its effects and discrepancies from ACTUATOR_STATE alone.\nCSV on stdout, one line per "
      "TIP_MEASUREMENT, with standard deviations where the model file says what is uncertain, and residuals of "
      "TIP_HEADING (mrad) where the log has any.");
  command_line.option("-m,--model", model_path, "model file (TOML)", true)
      .arguments("LOG", logs, "the log of one insertion, or a folder with one")
      .reads_recordings()
      .example("bevel-predict --model model.toml rec01.lcm > predicted.csv")
      .check([&]() -> std::string { return logs.size() > 1 ? "one LOG at a time" : ""; });
  return command_line.run(argc, argv, [&] {
    const auto found = bevel::io::find_logs(logs);
    if (found.size() > 1)
      throw bevel::IoError(logs.front() + ": holds " + std::to_string(found.size()) + " logs; one at a time");
    return bevel::analysis::run(model_path, found.front(), std::cout, std::cerr);
  });
}
