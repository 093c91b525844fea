// How many of a campaign's trials could be answered at all: in each that the tool got wrong, the true set of effects,
// its fit begun at the truth, is compared with whatever the search found by itself. Where the truth is less likely than
// what the search found, these recordings do not single it out, and no search would.
//   ceiling_study CAMPAIGN [TRIAL...]
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "diagnosis/inference/calibrate.hpp"
#include "diagnosis/inference/search.hpp"
#include "diagnosis/needle/needle_system.hpp"
#include "io/find_logs.hpp"
#include "io/model_file.hpp"
#include "tools/diagnose/read_case.hpp"

namespace {

using Eigen::VectorXd;
using nlohmann::json;
using namespace bevel;
namespace fs = std::filesystem;

constexpr double kTie = 0.5;  // in log posterior: the true set found, but for where its fit stopped

json read_json(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error("cannot read " + file.string());
  return json::parse(in);
}

// The library's effect of this name that has these parameters, or -1.
int find_effect(const diagnosis::NeedleSystem& system, const json& effect) {
  for (std::size_t e = 0; e < system.effects().size(); ++e) {
    const auto& one = system.effects()[e];
    if (one.name != effect.at("name")) continue;
    const bool all = std::ranges::all_of(effect.at("parameters").items(), [&](const auto& item) {
      return std::ranges::any_of(one.parameters, [&](const auto& p) { return p.name == item.key(); });
    });
    if (all) return static_cast<int>(e);
  }
  return -1;
}

struct Compared {
  std::string truth, found;
  double truth_log = 0, found_log = 0;  // log posterior, not normalised
};

// nullopt: the truth is not among the library's sets.
std::optional<Compared> compare(const fs::path& folder, const json& truth) {
  const auto model = io::load_model_file((folder / "model.toml").string());
  const diagnosis::NeedleSystem system(diagnose::read_case(io::find_logs({folder.string()})).recorded, model.needle);
  inference::ModelSet set;
  std::vector<const json*> by_effect(system.effects().size(), nullptr);
  for (const json& effect : truth.at("effects")) {
    const int e = find_effect(system, effect);
    if (e < 0) return std::nullopt;
    set = inference::with(set, static_cast<std::size_t>(e));
    by_effect[static_cast<std::size_t>(e)] = &effect;
  }
  const auto calibration = inference::calibrate(system);
  inference::Search search(system, {});
  search.run(calibration.outliers, calibration.noise);

  const inference::Layout layout(system, set);
  const auto& alone = search.visited().at({}).at->fit;
  VectorXd shared = layout.shared_start();
  std::vector<VectorXd> local(system.data().recordings.size(), layout.local_start());
  const auto value_of = [&](const char* name) { return truth.at("needle").at(name).get<double>(); };
  const double lambda2 = value_of("lambda2");
  shared.head(3) << value_of("curvature_per_mm"), value_of("lambda1_per_rad") - lambda2 * lambda2 / (2 * M_PI), lambda2;
  for (std::size_t m = 0; m < set.size(); ++m) {
    const auto& parameters = system.effects()[set[m]].parameters;
    const json& effect = *by_effect[set[m]];
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      const std::string& name = parameters[p].name;
      if (const int i = layout.find_shared(m, p); i >= 0 && effect.at("parameters").contains(name))
        shared[i] = effect.at("parameters").at(name);
      if (const int i = layout.find_local(m, p); i >= 0 && effect.contains("per_recording"))
        for (std::size_t r = 0; r < local.size(); ++r) local[r][i] = effect.at("per_recording").front().at(r);
    }
  }
  auto at = inference::evaluate(search.likelihood(), layout, shared, local, alone.scales.nuisance_sd);
  Compared out{.truth = describe(system, set), .found = describe(system, search.best().set)};
  out.found_log = search.best().log_posterior();
  inference::add_discrepancy(search.likelihood(), search.discrepancy(), {}, at);
  out.truth_log = at.valid ? search.weighed(set, std::make_shared<const inference::Evaluated>(at)).log_posterior()
                           : -std::numeric_limits<double>::infinity();
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Of the trials that the tool got wrong: is the truth likelier than what the search found?"};
  std::string campaign;
  std::vector<int> wanted;
  app.add_option("campaign", campaign, "folder of a scored bevel-blindtrial")->required();
  app.add_option("trials", wanted, "numbers; without: every visible trial of library effects that is wrong");
  CLI11_PARSE(app, argc, argv);
  try {
    const fs::path folder = campaign;
    int visible = 0, right = 0, could = 0;
    const json results = read_json(folder / "results.json");
    for (const json& trial : results.at("trials")) {
      const int number = trial.at("trial");
      const bool asked = std::ranges::find(wanted, number) != wanted.end();
      if (!wanted.empty() && !asked) continue;
      if (!asked && trial.at("visibility") != "visible") continue;
      char name[16];
      std::snprintf(name, sizeof name, "t%04d", number);
      const json truth =
          json::parse(read_json(folder / "sealed" / (std::string(name) + ".json")).at("truth").get<std::string>());
      if (truth.at("plant") != "kinematic") continue;
      const bool listed = std::ranges::all_of(truth.at("effects"), [](const json& e) { return e.contains("nearest"); });
      if (!asked && !listed) continue;
      ++visible;
      if (!asked && trial.at("strict").get<bool>()) {
        ++right;
        continue;
      }
      const auto compared = compare(folder / "trials" / name / "case", truth);
      if (!compared) continue;
      const bool wins = compared->truth_log >= compared->found_log - kTie;
      could += wins;
      std::printf("%s  truth %s, found %s: %+.1f in log posterior%s\n", name, compared->truth.c_str(),
                  compared->found.c_str(), compared->truth_log - compared->found_log,
                  wins ? "; the search missed it" : "");
      std::fflush(stdout);
    }
    std::printf("%d trials of visible library effects; right %d; ceiling %d\n", visible, right, right + could);
  } catch (const std::exception& error) {
    std::cerr << "ceiling_study: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
