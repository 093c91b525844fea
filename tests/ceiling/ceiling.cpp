// SPDX-License-Identifier: MIT
#include "tests/ceiling/ceiling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/analysis/diagnose/read_case.hpp>
#include <bevel/diagnosis/inference/calibrate.hpp>
#include <bevel/diagnosis/inference/log_sum.hpp>
#include <bevel/diagnosis/mismatch/decision.hpp>
#include <bevel/diagnosis/mismatch/found_effects.hpp>
#include <bevel/io/find_logs.hpp>
#include <bevel/io/model_file.hpp>
#include "proof/trial_files.hpp"

namespace bevel::ceiling {

using Eigen::Index;
using Eigen::VectorXd;
using inference::ModelSet;
using inference::Search;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();

// Of one explanation: the names that it says, "unknown" among them; sorted.
using Answer = std::vector<std::string>;

struct Explanation {
  Answer answer;
  std::string label;
  double log = kNever;
  const inference::Visited* visited = nullptr;
  bool with_curve = false;
};

// Every set that was visited, without a discrepancy and with one. One that is too small to count is an error of form.
std::vector<Explanation> explanations_of(const Search& search) {
  std::vector<Explanation> out;
  for (const auto& [set, one] : search.visited()) {
    Answer names;
    for (const std::size_t e : set) names.push_back(search.system().effects()[e].name);
    std::ranges::sort(names);
    const std::string label = describe(search.system(), set);
    out.push_back({names, label, one.log_without_curve, &one, false});
    if (!std::isfinite(one.log_with_curve)) continue;
    const auto& fit = one.at->fit_with_curve;
    if (fit && inference::visible_sigmas_of_curve(search, *fit) > diagnosis::consequence_sigmas(search.rules())) {
      names.push_back("unknown");
      std::ranges::sort(names);
    }
    out.push_back({names, label + " and a discrepancy", one.log_with_curve, &one, true});
  }
  std::ranges::stable_sort(out, [](const auto& a, const auto& b) { return a.log > b.log; });
  return out;
}

// A set of the library in the generator's words, its parameters where the fit has them; empty where the generator has
// no such effect.
std::vector<Claim> claims_of(const Search& search, const GeneratorSystem& system, const inference::Fit& fit,
                             const inference::Reach& reach) {
  std::vector<Claim> out;
  for (std::size_t m = 0; m < fit.layout.set().size(); ++m) {
    const std::size_t e = fit.layout.set()[m];
    const auto& theirs = search.system().effects()[e];
    Claim claim{.effect = {.name = theirs.name, .kind = {}, .parameters = {}, .per_recording = {}}, .visible = {}};
    for (std::size_t p = 0; p < theirs.parameters.size(); ++p) {
      const std::string& name = theirs.parameters[p].name;
      if (const int i = fit.layout.find_shared(m, p); i >= 0) claim.effect.parameters[name] = fit.shared[i];
      if (const int i = fit.layout.find_local(m, p); i >= 0)
        for (const VectorXd& local : fit.local) claim.effect.per_recording[name].push_back(local[i]);
    }
    const int ours = theirs.name == "tip_swing" ? -1 : system.find(claim.effect);
    if (ours < 0) return {};
    std::vector<double> sigmas;
    const auto& slots = system.slots(static_cast<std::size_t>(ours));
    const auto& parameters = system.effects()[static_cast<std::size_t>(ours)].parameters;
    for (std::size_t p = 0; p < slots.size(); ++p) {
      if (!slots[p].is_size) continue;
      double one_deviation = std::numeric_limits<double>::infinity();
      for (const auto& size : reach.sizes)
        if (size.effect == e && theirs.parameters[size.parameter].name == parameters[p].name)
          one_deviation = size.one_deviation;
      sigmas.push_back(1 / one_deviation);
    }
    claim.visible.sigmas_per_unit = Eigen::Map<const VectorXd>(sigmas.data(), static_cast<Index>(sigmas.size()));
    out.push_back(std::move(claim));
  }
  return out;
}

}  // namespace

double Judged::log_posterior() const {
  // One of them, as each explanation that it is compared with is one.
  return valid ? std::max(log_without_curve, log_with_curve) : kNever;
}

std::vector<Claim> claims_of(const GeneratorSystem& system, const proof::Truth& truth) {
  std::vector<Claim> out;
  for (const proof::TruthEntry& entry : truth.entries) {
    Claim claim{.effect = entry.effect, .visible = {}};
    if (entry.effect.name == "tip_swing") {
      claim.effect.parameters = {{"foundation_modulus_kPa", truth.beam_config->foundation_modulus_kPa},
                                 {"bevel_force_N", truth.beam_config->bevel_force_N},
                                 {"guide_gap_mm", truth.beam_config->guide_gap_mm}};
    } else if (entry.effect.kind == "beam_relaxation") {
      claim.effect.parameters = {{"relaxing_fraction", truth.beam_config->relaxing_fraction},
                                 {"relaxation_time_s", truth.beam_config->relaxation_time_s}};
    }
    const auto e = static_cast<std::size_t>(system.find(claim.effect));
    std::vector<double> away;
    for (std::size_t p = 0; p < system.slots(e).size(); ++p) {
      const Slot& slot = system.slots(e)[p];
      if (slot.is_size)
        away.push_back(claim.effect.parameters.at(system.effects()[e].parameters[p].name) - slot.range.neutral);
    }
    const VectorXd size = Eigen::Map<const VectorXd>(away.data(), static_cast<Index>(away.size()));
    claim.visible.sigmas_per_unit =
        VectorXd::Constant(size.size(), entry.visible_sigmas / std::max(size.norm(), 1e-12));
    out.push_back(std::move(claim));
  }
  return out;
}

Judged judge(const Search& search, const GeneratorSystem& system, const std::vector<Claim>& claims,
             const Beginning& beginning) {
  ModelSet set;
  for (const Claim& claim : claims) set = inference::with(set, static_cast<std::size_t>(system.find(claim.effect)));
  if (!system.allows(set)) return {};
  const inference::Layout layout(system, set);
  VectorXd shared = layout.shared_start();
  const double lambda2 = beginning.needle.lambda2;
  shared.head(3) << beginning.needle.curvature_per_mm,
      beginning.needle.lambda1_per_rad - lambda2 * lambda2 / (2 * M_PI), lambda2;
  std::vector<VectorXd> local(system.data().recordings.size(), layout.local_start());
  for (std::size_t r = 0; r < std::min(local.size(), beginning.variation.size()); ++r) {
    const proof::InsertionVariation& own = beginning.variation[r];
    local[r][diagnosis::kOwnCurvature] = own.curvature_share;
    local[r][diagnosis::kTiltX] = own.about_x_rad;
    local[r][diagnosis::kTiltY] = own.about_y_rad;
    local[r][diagnosis::kRoll] = own.roll_rad;
    local[r][diagnosis::kEntryX] = own.entry_x_mm;
    local[r][diagnosis::kEntryY] = own.entry_y_mm;
  }
  std::vector<Visible> visible(set.size());
  for (const Claim& claim : claims) {
    const auto e = static_cast<std::size_t>(system.find(claim.effect));
    const auto m = static_cast<std::size_t>(std::ranges::find(set, e) - set.begin());
    visible[m] = claim.visible;
    const auto& parameters = system.effects()[e].parameters;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      const auto value = claim.effect.parameters.find(parameters[p].name);
      if (const int i = layout.find_shared(m, p); i >= 0 && value != claim.effect.parameters.end())
        shared[i] = system.slots(e)[p].logarithmic ? std::log(value->second) : value->second;
      const auto own = claim.effect.per_recording.find(parameters[p].name);
      if (const int i = layout.find_local(m, p); i >= 0 && own != claim.effect.per_recording.end())
        for (std::size_t r = 0; r < local.size(); ++r) local[r][i] = own->second.at(r);
    }
  }
  layout.clamp(shared, local);
  const inference::Likelihood likelihood(system, search.likelihood().outliers(), search.likelihood().noise());
  auto at = inference::evaluate(likelihood, layout, shared, local, beginning.nuisance_sd);
  if (!at.valid) return {};
  inference::add_discrepancy(likelihood, search.discrepancy(), search.curve_rules(), at);
  Judged out{.valid = true};
  out.log_prior_ratio = log_prior_ratio(system, at.fit, visible);
  const double log_prior = log_prior_of(system, set, search.rules().log_prior_odds_effect);
  const auto weighed = search.weighed(set, log_prior, std::make_shared<const inference::Evaluated>(at));
  out.log_without_curve = weighed.log_without_curve + out.log_prior_ratio;
  out.log_with_curve = weighed.log_with_curve + out.log_prior_ratio;
  return out;
}

namespace {

// The standard deviations of the grid nearest to those that were drawn.
VectorXd spread_on_grid(const inference::System& system, const proof::VariationSpread& spread) {
  const auto& groups = system.nuisance_groups();
  VectorXd out = VectorXd::Zero(static_cast<Index>(groups.size()));
  const double drawn[] = {spread.curvature_share, spread.entry_rad, spread.registration_mm, spread.roll_rad};
  for (std::size_t g = 0; g < groups.size() && spread.any(); ++g) {
    const auto& values = groups[g].standard_deviations;
    const auto distance = [&](double sd) { return sd > 0 ? std::abs(std::log(sd / drawn[g])) : 1e9; };
    out[static_cast<Index>(g)] = *std::ranges::min_element(values, {}, distance);
  }
  return out;
}

double finite(double log) { return std::isfinite(log) ? log : -1e6; }

}  // namespace

json compare(const fs::path& folder, const json& campaign, const json& score, int threads) {
  const int number = score.at("trial");
  const proof::Trial trial = open_trial(folder, campaign, number);
  const proof::TrialFolders folders(folder, number);
  const auto model = io::load_model_file((folders.given / "model.toml").string());
  const diagnosis::NeedleSystem needle(analysis::read_case(io::find_logs({folders.given.string()})).recorded,
                                       model.needle);
  const auto calibration = inference::calibrate(needle);
  Search search(needle, {.threads = threads});
  search.run(calibration.outliers, calibration.noise);
  const auto posterior = inference::posterior_of(search, diagnosis::consequence_sigmas(search.rules()));
  const inference::Unknowns unknowns(search);
  const auto decision =
      diagnosis::decide(search, posterior, [&](const diagnosis::ChosenModel& chosen, std::size_t member) {
        return diagnosis::fault_of_name(needle, search, unknowns, chosen, member);
      });
  Answer said;
  for (const std::size_t e : decision.model.fit->layout.set()) said.push_back(needle.effects()[e].name);
  if (decision.verdict == diagnosis::Verdict::unknown_effect) said.emplace_back("unknown");
  std::ranges::sort(said);

  const GeneratorSystem system(needle, trial);
  const proof::Truth& truth = trial.truth;
  const Beginning beginning{truth.needle, truth.variation, spread_on_grid(needle, truth.spread)};
  const Answer expected = truth.expected();
  const Judged judged = judge(search, system, claims_of(system, truth), beginning);

  const auto explanations = explanations_of(search);
  const Explanation* rival = nullptr;
  const Explanation* same = nullptr;
  std::vector<double> logs_of_rivals;
  double best_known = kNever;  // of nothing, or of names alone
  for (const Explanation& one : explanations) {
    if (one.answer != expected) logs_of_rivals.push_back(one.log);
    if (one.answer != expected && !rival) rival = &one;
    if (one.answer == expected && !same) same = &one;
    if (std::ranges::find(one.answer, "unknown") == one.answer.end()) best_known = std::max(best_known, one.log);
  }
  // The likeliest wrong set by the generator's own forms, where it has them; begun where the library's fit stands.
  const auto reach = search.proposals().reach(search.base_marginal());
  double rival_in_generator = kNever;
  for (const Explanation& one : explanations) {
    if (truth.entries.empty()) break;  // a null compares the two bases
    if (one.with_curve || one.answer == expected || one.visited->set.empty()) continue;
    const inference::Fit& fit = one.visited->at->fit;
    const auto claims = claims_of(search, system, fit, reach);
    if (claims.empty()) continue;
    Beginning there{{fit.shared[0], truth.needle.wheelbase_mm, 0, fit.shared[2]}, {}, fit.scales.nuisance_sd};
    there.needle.lambda1_per_rad = fit.shared[1] + fit.shared[2] * fit.shared[2] / (2 * M_PI);
    for (const VectorXd& l : fit.local) there.variation.push_back({l[0], l[1], l[2], l[4], l[5], l[3]});
    if (const Judged by_its_forms = judge(search, system, claims, there); by_its_forms.valid)
      rival_in_generator = by_its_forms.log_without_curve;
    break;
  }
  const auto& base = search.visited().at({});
  return {{"trial", number},
          {"class", truth.beam ? "beam" : proof::name_of(truth.trial_class)},
          {"concealed", score.at("concealed")},
          {"expected", expected},
          {"visibility", score.at("visibility")},
          {"visible_sigmas", truth.visible_sigmas},
          {"varied", truth.spread.any()},
          {"departure", truth.departure},
          {"said", said},
          {"said_in_campaign", score.at("named")},
          {"right", said == expected},
          {"truth", finite(judged.log_posterior())},
          {"truth_without_curve", finite(judged.valid ? judged.log_without_curve : kNever)},
          {"truth_prior_ratio", finite(judged.log_prior_ratio)},
          {"nothing_by_library_without_curve", base.log_without_curve},
          {"same_answer_by_library", same ? finite(same->log) : -1e6},
          {"rival", rival ? rival->label : ""},
          {"rival_answer", rival ? rival->answer : Answer{}},
          {"rival_log", rival ? rival->log : -1e6},
          {"without_unknown_log", finite(best_known)},
          {"rivals_log_sum", finite(inference::log_sum(logs_of_rivals))},
          {"rival_by_generator", finite(rival_in_generator)}};
}

}  // namespace bevel::ceiling
