// bevel-predict: where the model says the tip was, from the axes alone.
#include <iostream>

#include "tools/common/command_line.hpp"
#include "tools/predict/predict.hpp"

int main(int argc, char** argv) {
  std::string model_path;
  std::vector<std::string> logs;
  bevel::tools::CommandLine command_line(
      "bevel-predict",
      "Integrates the model with its effects and discrepancies from ACTUATOR_STATE alone; CSV on stdout, one line per "
      "TIP_MEASUREMENT, with standard deviations where the model file says what is uncertain, and residuals of "
      "TIP_HEADING (mrad) where the log has any.");
  command_line.option("-m,--model", model_path, "model file (TOML)", true)
      .arguments("LOG", logs, "the log, one insertion")
      .reads_recordings()
      .check([&]() -> std::string { return logs.size() > 1 ? "one LOG at a time" : ""; });
  return command_line.run(argc, argv,
                          [&] { return bevel::predict::run(model_path, logs.front(), std::cout, std::cerr); });
}
