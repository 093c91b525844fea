// SPDX-License-Identifier: MIT
// bevel-identify: the needle's parameters from recorded insertions.
#include <iostream>

#include <bevel/analysis/identify/identify.hpp>
#include <bevel/cli/command_line.hpp>

int main(int argc, char** argv) {
  bevel::analysis::IdentifyOptions o;
  bevel::cli::CommandLine command_line("bevel-identify",
                                       "The needle's parameters from recorded insertions, with their uncertainty.");
  command_line.arguments("LOG", o.logs, "logs of one insertion each, or folders of them")
      .reads_recordings()
      .example("bevel-identify --model model.toml --out found rec01.lcm rec02.lcm")
      .option("-m,--model", o.model_path, "model file to start from (TOML); what is not fitted stays", true)
      .option("-o,--out", o.out_folder, "folder for model.toml, figures.json and report.html")
      .choice("--method", o.method, "trajectory (default) or angle-rate, as printed in the paper",
              {"trajectory", "angle-rate"})
      .choice("--prior", o.prior, "on the lambdas", {"none", "table1-agar", "table1-plastisol"})
      .flag("--bicycle", o.bicycle, "select the bicycle, lambda 0, whatever its BIC")
      .flag("--fit-slip-in-plane", o.fit_slip_in_plane,
            "fit lambda although no shaft rotates, as the paper does; misfit of any kind then changes it")
      .flag("--wheelbase", o.fit_wheelbase, "fit the wheelbase as well")
      .flag("--square-loss", o.square_loss, "least squares instead of Huber's loss")
      .non_negative("--entry-tilt-rad", o.entry_tilt_rad, "standard deviation of each entry's tilt; 0: nominal")
      .non_negative("--entry-roll-rad", o.entry_roll_rad, "standard deviation of each entry's roll")
      .non_negative("--entry-offset-mm", o.entry_offset_mm, "standard deviation of each entry's lateral place")
      .non_negative("--late-entry-mm", o.late_entry_mm,
                    "standard deviation of the insertion at which the tip met the tissue");
  return command_line.run(argc, argv, [&] { return bevel::analysis::run(o, std::cout, std::cerr); });
}
