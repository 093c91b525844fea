#pragma once
// The whole proof: draw and seal all trials, let the tool under test see each, hash its verdicts, open the truths,
// score. Each step of each trial that is on disk already is skipped, so an interrupted campaign goes on where it was.
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "proof/trial.hpp"

namespace bevel::proof {

struct CampaignOptions {
  int trials = 100;
  std::uint64_t seed = 1;
  Population population{.varied = 0.5};
  std::filesystem::path out;
  std::filesystem::path diagnose;          // the tool under test; not needed for generate_only
  std::vector<std::string> also_readable;  // further folders that the tool may read
  int jobs = 2;                            // trials at a time
  double limit_s = 600;                    // a trial that takes longer is an abstention
  bool generate_only = false;
  bool unsealed = false;  // without namespaces, where the kernel has none; the result says so
};

// Exit status: 0 finished, 130 interrupted. Throws std::runtime_error with a message for the user.
int run_campaign(const CampaignOptions& options, std::ostream& progress);

}  // namespace bevel::proof
