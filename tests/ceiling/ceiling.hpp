// SPDX-License-Identifier: MIT
#pragma once
// One trial of a campaign, judged twice by one evidence: the tool's search, by the library's forms, and what was really
// concealed, by the generator's own.
#include <filesystem>
#include <nlohmann/json.hpp>

#include <bevel/diagnosis/inference/search.hpp>
#include "tests/ceiling/generator_prior.hpp"

namespace bevel::ceiling {

// What is concealed, or said to be: with the parameters from which a fit begins, and what can be seen of it.
struct Claim {
  proof::ConcealedEffect effect;
  Visible visible;
};

// Of a set in the generator's forms, on the scale of Visited: prior x evidence, its sizes' prior the generator's.
struct Judged {
  bool valid = false;
  double log_without_curve = 0, log_with_curve = 0;
  double log_prior_ratio = 0;  // part of both
  double log_posterior() const;
};
// What a fit begins at, beside the claims' parameters.
struct Beginning {
  proof::BaseNeedle needle;
  std::vector<proof::InsertionVariation> variation;  // per recording
  Eigen::VectorXd nuisance_sd;
};
Judged judge(const inference::Search& search, const GeneratorSystem& system, const std::vector<Claim>& claims,
             const Beginning& beginning);

// The truth's claims; of effects that no size tells, none is visible.
std::vector<Claim> claims_of(const GeneratorSystem& system, const proof::Truth& truth);

// A trial of a campaign's folder, its recordings drawn again and its truth opened. Throws IoError where the
// seal is broken or a file is missing.
proof::Trial open_trial(const std::filesystem::path& folder, const nlohmann::json& campaign, int number);

// Runs the search on the case, and compares: everything that report() needs. campaign: results.json, of whose trials
// score is one. threads: of the search.
nlohmann::json compare(const std::filesystem::path& folder, const nlohmann::json& campaign, const nlohmann::json& score,
                       int threads);

// Tables of what was compared (Markdown).
std::string report(const std::vector<nlohmann::json>& compared);

}  // namespace bevel::ceiling
