// SPDX-License-Identifier: MIT
#pragma once
// The result as one page that opens anywhere: figures first, pictures, every trial at the end.
#include <string>
#include <vector>

#include "proof/tally.hpp"

namespace bevel::proof {

struct CampaignFacts {
  std::uint64_t seed = 0;
  bool sealed = true;
  std::string tool_sha256;
  std::string commitments_sha256;
  std::string verdicts_sha256;
};

std::string results_page(const CampaignFacts& facts, const Tally& tally, const std::vector<TrialScore>& scores);

}  // namespace bevel::proof
