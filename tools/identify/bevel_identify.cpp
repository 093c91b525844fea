// bevel-identify: the needle's parameters from recorded insertions.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>

#include "tools/identify/identify.hpp"

int main(int argc, char** argv) {
  bevel::identify::Options o;
  CLI::App app("The needle's parameters from recorded insertions, with their uncertainty.", "bevel-identify");
  app.set_version_flag("--version", BEVEL_VERSION);
  app.add_option("LOG", o.logs, "logs, one insertion each")->required();
  app.add_option("-m,--model", o.model_path, "model file to start from (TOML); what is not fitted stays")->required();
  app.add_option("-o,--out", o.out_folder, "folder for model.toml, figures.json and report.html");
  app.add_option("--method", o.method, "trajectory (default) or angle-rate, as printed in the paper")
      ->check(CLI::IsMember({"trajectory", "angle-rate"}));
  app.add_option("--prior", o.prior, "on the lambdas")
      ->check(CLI::IsMember({"none", "table1-agar", "table1-plastisol"}));
  app.add_flag("--bicycle", o.bicycle, "the plain bicycle: lambda held at zero");
  app.add_flag("--wheelbase", o.fit_wheelbase, "fit the wheelbase as well");
  app.add_flag("--square-loss", o.square_loss, "least squares instead of Huber's loss");
  const auto sigma = [&](const char* name, double& value, const char* what) {
    app.add_option(name, value, what)->check(CLI::NonNegativeNumber);
  };
  sigma("--entry-tilt-rad", o.entry_tilt_rad, "standard deviation of each entry's tilt; 0: nominal");
  sigma("--entry-roll-rad", o.entry_roll_rad, "standard deviation of each entry's roll");
  sigma("--entry-offset-mm", o.entry_offset_mm, "standard deviation of each entry's lateral place");
  sigma("--late-entry-mm", o.late_entry_mm, "standard deviation of the insertion at which the tip met the tissue");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    return bevel::identify::run(o, std::cout);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bevel-identify: %s\n", e.what());
    return 1;
  }
}
