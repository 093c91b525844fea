// SPDX-License-Identifier: MIT
// The ceiling of a blind trial: in how many trials what was concealed, by the generator's own forms, is likelier than
// every other answer that the tool's search found.
//   ceiling_study CAMPAIGN [TRIAL...] [--results RESULTS.json] [--out COMPARED.jsonl]
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>

#include "proof/trial_files.hpp"
#include "tests/ceiling/ceiling.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Of a campaign's trials: is the truth, by the generator's forms, likelier than what the search found?"};
  std::string folder, results, file;
  std::vector<int> wanted;
  int threads = 1;
  app.add_option("campaign", folder, "folder of a bevel-blindtrial")->required();
  app.add_option("trials", wanted, "numbers; without: every visible trial that is wrong");
  app.add_option("--results", results, "its results.json, where that is elsewhere");
  app.add_option("--out", file, "what is compared, a line a trial; what is there is not done again");
  app.add_option("--threads", threads, "of the search");
  CLI11_PARSE(app, argc, argv);
  try {
    if (results.empty()) results = folder + "/results.json";
    if (file.empty()) file = folder + "/ceiling.jsonl";
    const auto campaign = nlohmann::json::parse(bevel::proof::read_text(results));
    std::vector<nlohmann::json> compared;
    std::ifstream before(file);
    for (std::string line; std::getline(before, line);) compared.push_back(nlohmann::json::parse(line));
    for (const auto& score : campaign.at("trials")) {
      const int number = score.at("trial");
      const bool asked = std::ranges::find(wanted, number) != wanted.end();
      if (!asked && (!wanted.empty() || score.at("visibility") != "visible" || score.at("strict"))) continue;
      if (std::ranges::any_of(compared, [&](const auto& one) { return one.at("trial") == number; })) continue;
      compared.push_back(bevel::ceiling::compare(folder, campaign, score, threads));
      std::ofstream(file, std::ios::app) << compared.back().dump() << std::endl;
    }
    std::ranges::sort(compared, {}, [](const auto& one) { return one.at("trial").template get<int>(); });
    std::cout << bevel::ceiling::report(compared);
  } catch (const std::exception& error) {
    std::cerr << "ceiling_study: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
