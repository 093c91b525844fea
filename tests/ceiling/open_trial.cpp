// SPDX-License-Identifier: MIT
// A trial out of a campaign's folder.
#include "proof/trial_files.hpp"
#include "tests/ceiling/ceiling.hpp"

namespace bevel::ceiling {

using nlohmann::json;

proof::Trial open_trial(const std::filesystem::path& folder, const json& campaign, int number) {
  const proof::Population population{
      .varied = campaign.at("varied"), .edition = campaign.at("edition"), .nulls = campaign.at("nulls")};
  proof::Trial trial = proof::draw_recordings(campaign.at("seed").get<std::uint64_t>(), number, population);
  const json opened = json::parse(proof::open_truth(proof::TrialFolders(folder, number)));
  proof::Truth& truth = trial.truth;
  truth.departure = opened.at("departure");
  truth.visible_sigmas = opened.at("visible_sigmas");
  const json& needle = opened.at("needle");  // of a beam, the closest bicycle
  truth.needle = {needle.at("curvature_per_mm"), needle.at("wheelbase_mm"), needle.at("lambda1_per_rad"),
                  needle.at("lambda2")};
  for (const json& one : opened.at("effects"))
    truth.entries.push_back({{one.at("name"), one.value("kind", ""), one.at("parameters"),
                              one.value("per_recording", std::map<std::string, std::vector<double>>{})},
                             one.at("visible_sigmas")});
  if (opened.contains("beam")) {
    const json& beam = opened.at("beam");
    truth.beam_config.emplace();
    truth.beam_config->foundation_modulus_kPa = beam.at("foundation_modulus_kPa");
    truth.beam_config->bevel_force_N = beam.at("bevel_force_N");
    truth.beam_config->relaxing_fraction = beam.at("relaxing_fraction");
    truth.beam_config->relaxation_time_s = beam.at("relaxation_time_s");
    truth.beam_config->guide_gap_mm = beam.at("guide_gap_mm");
  }
  return trial;
}

}  // namespace bevel::ceiling
