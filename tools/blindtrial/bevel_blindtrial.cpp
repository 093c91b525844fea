// SPDX-License-Identifier: MIT
// bevel-blindtrial: puts a mismatch tool before needles with concealed physics and scores its verdicts.
// Exit status: 0 finished, 1 failed, 2 usage, 130 interrupted (the same command goes on).
#include <iostream>

#include <bevel/cli/command_line.hpp>
#include <bevel/cli/progress_line.hpp>
#include "proof/campaign.hpp"
#include "proof/seed.hpp"
#include "proof/trial.hpp"

int main(int argc, char** argv) {
  bevel::proof::CampaignOptions o;
  std::string out;
  std::string diagnose;
  std::string seed_file;
  bool describe = false;
  bevel::cli::CommandLine command_line(
      "bevel-blindtrial",
      "A blind trial of a mismatch tool: physics concealed and sealed, verdicts hashed, then scored.");
  command_line.example("bevel-blindtrial --trials 3 --out trials --diagnose build/bin/bevel-diagnose")
      .option("--trials", o.trials, "number of trials", 1, 10000)
      .option("--seed-file", seed_file,
              "file with the seed, a whole number from 0 on, or - for standard input; the same seed draws the same "
              "trials; without it that of --out, or a random one")
      .option("--varied", o.population.varied, "share of trials whose insertions differ", 0.0, 1.0)
      .option("--edition", o.population.edition,
              "of the distribution; 1, with --varied 0: that of the first nine campaigns", 1, bevel::proof::kEditions)
      .flag("--nulls", o.population.nulls, "nothing is concealed in any trial: to calibrate a tool")
      .flag("--groups", o.population.two_groups,
            "recordings before and after a change, or none: --baseline LOG... --changed LOG...")
      .option("--out", out, "folder for trials and results; what is there already is not done again")
      .option("--diagnose", diagnose, "the tool under test: PATH --model M.toml --out DIR LOG...")
      .arguments("--also-readable", o.also_readable, "further folders that the tool may read", false)
      .option("--jobs", o.jobs, "trials at a time", 1, 64)
      .option("--limit-s", o.limit_s, "a trial that takes longer counts as an abstention, s", 1, 86400)
      .flag("--generate-only", o.generate_only, "draw and seal the trials, run nothing")
      .flag("--unsealed", o.unsealed, "run the tool without a sandbox; the result reports that")
      .flag("--describe", describe, "print the distribution that trials are drawn from")
      .check([&]() -> std::string {
        if (describe) return "";
        if (out.empty()) return "--out is required: the folder for trials and results";
        return diagnose.empty() && !o.generate_only ? "--diagnose is required, or --generate-only" : "";
      });
  return command_line.run(argc, argv, [&] {
    if (describe) {
      std::cout << bevel::proof::describe_distribution();
      return 0;
    }
    o.out = out;
    o.diagnose = diagnose;
    o.seed = bevel::proof::seed_of(seed_file, o.out);
    bevel::cli::ProgressLine line(bevel::cli::ProgressLine::as_stderr_is());
    o.watch = {.begin = [&](const auto& what, auto pieces, auto jobs) { line.begin(what, pieces, jobs); },
               .one_done = [&] { line.one_done(); },
               .make_room = [&] { line.make_room(); },
               .end = [&] { line.end(); }};
    return bevel::proof::run_campaign(o, std::cout);
  });
}
