// SPDX-License-Identifier: MIT
#pragma once
// The whole proof: draw and seal all trials, let the tool under test see each, hash its verdicts, open the truths,
// score. Each step of each trial that is on disk already is skipped, so an interrupted campaign goes on where it was.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "proof/trial.hpp"

namespace bevel::proof {

// Who is told how far it is, from several threads; what is empty is not called.
struct CampaignWatch {
  std::function<void(const std::string& what, std::size_t pieces, std::size_t at_a_time)> begin;
  std::function<void()> one_done;
  std::function<void()> make_room;  // before a line of progress is printed
  std::function<void()> end;
};

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
  bool unsealed = false;  // without a sandbox, where bubblewrap cannot work; the result reports that
  CampaignWatch watch;
};

// Exit status: 0 finished, 130 interrupted. Throws ConfigurationError with a message for the user.
int run_campaign(const CampaignOptions& options, std::ostream& progress);

}  // namespace bevel::proof
