// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/mismatch/diagnose.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include <bevel/diagnosis/inference/calibrate.hpp>
#include <bevel/diagnosis/mismatch/found_effects.hpp>
#include <bevel/diagnosis/mismatch/invariants.hpp>
#include <bevel/diagnosis/parallel.hpp>
#include <bevel/error.hpp>
#include "mismatch/checks.hpp"
#include "mismatch/held_out.hpp"
#include "mismatch/location.hpp"
#include "mismatch/reach.hpp"
#include "mismatch/sentence.hpp"

namespace bevel::diagnosis {

namespace {

constexpr std::size_t kFewReadings = 40;
constexpr std::size_t kExplanations = 8;  // that are printed

class Stages {
 public:
  Stages(const DiagnosisOptions& options, std::vector<StageTime>& times) : options_(options), times_(times) {}
  void begin(const std::string& stage) {
    end();
    stage_ = stage;
    start_ = std::chrono::steady_clock::now();
    if (options_.progress) options_.progress(stage);
  }
  void end() {
    if (stage_.empty()) return;
    times_.push_back({stage_, std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count()});
    stage_.clear();
  }

 private:
  const DiagnosisOptions& options_;
  std::vector<StageTime>& times_;
  std::string stage_;
  std::chrono::steady_clock::time_point start_;
};

inference::Calibration calibrate(const NeedleSystem& system) {
  try {
    return inference::calibrate(system);
  } catch (const DomainError&) {
    throw ArgumentError(
        "the model in use cannot follow these recordings: with it the tip leaves the domain of the slip law; check the "
        "model file's curvature_per_mm and lambda, and that insertion and rotation are logged in mm and rad");
  }
}

void remark_on_short_recordings(const RecordedCase& recorded, Findings& findings) {
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (const auto& recording : recorded.recordings) fewest = std::min(fewest, recording.motion.at.size());
  if (recorded.has_clock && fewest < kFewReadings)
    findings.remarks.push_back(
        "a recording has only " + std::to_string(fewest) +
        " readings: the cameras' noise is hardly known, and what is quicker than a few readings cannot be seen");
}

// Names of the effects that a condition selects, separated by commas.
std::string names_of_effects(bool (*selects)(const model::Effect&)) {
  std::string names;
  for (const model::Effect* effect : model::all_effects())
    if (selects(*effect)) names += (names.empty() ? "" : ", ") + std::string(effect->name());
  return names;
}

void remark_on_clock(const NeedleSystem& system, Findings& findings) {
  if (system.recorded().has_clock) return;
  findings.remarks.push_back(
      "these recordings have no clock: effects of time, speed and rest were not looked for (" +
      names_of_effects([](const model::Effect& effect) { return model::needs_clock(effect.covariate()); }) + ")");
}

void remark_on_retraction(const NeedleSystem& system, Findings& findings) {
  if (system.recorded().has_retraction()) return;
  findings.remarks.push_back(names_of_effects([](const model::Effect& effect) { return effect.needs_retraction(); }) +
                             ": not a candidate, because no recording retracts the needle; insert 10 mm and retract "
                             "4 mm repeatedly to measure it");
}

// Where the posterior is as wide as the belief that the model file is.
void remark_on_beliefs(const NeedleSystem& system, const NeedleEstimate& needle, Findings& findings) {
  constexpr double kAsWide = 0.8;
  if (findings.two_groups) return;
  const auto belief_sd = [&](BaseParameter p) {
    return 1 / std::sqrt(inference::precision_of(system.base()[p].prior));
  };
  std::string held;
  const auto look = [&](const char* name, double sd, BaseParameter p) {
    if (sd > kAsWide * belief_sd(p)) held += (held.empty() ? "" : ", ") + std::string(name);
  };
  look("curvature_per_mm", needle.curvature_sd_per_mm, kCurvature);
  if (needle.slip_determined) {
    look("lambda1_per_rad", needle.lambda1_sd_per_rad, kU);
    look("lambda2", needle.lambda2_sd, kLambda2);
  } else {
    findings.remarks.push_back(
        "lambda1_per_rad and lambda2 are not determined: the shaft does not turn in these recordings. They keep the "
        "values of the model file, and k is estimated given these; insertions that turn would determine them");
  }
  if (!held.empty())
    findings.remarks.push_back(
        held +
        ": held by the model file, of which these recordings say next to nothing; insertions that turn, at two "
        "speeds and both ways, and paths that bend would measure it");
  const double k = needle.value.curvature_per_mm, believed = system.model().curvature_per_mm;
  if (k * believed < 0 || std::abs(k) < 2 * needle.curvature_sd_per_mm)
    findings.remarks.push_back(
        "the needle's curvature cannot be told from none, or is on the other side than the model file's: check the "
        "frame and the bevel's side, and record insertions that bend, at two roll angles, before this model is used");
}

void remark_on_groups(const RecordedCase& recorded, Findings& findings) {
  constexpr std::ptrdiff_t kComfortable = 4;
  if (!recorded.two_groups()) return;
  const auto changed = std::ranges::count_if(recorded.recordings, &Recording::changed);
  const auto fewest = std::min(changed, std::ssize(recorded.recordings) - changed);
  if (fewest < kComfortable)
    findings.remarks.push_back(
        "a group of " + std::to_string(fewest) +
        ": how much insertions differ by themselves is known from the two groups together, and a change has to stand "
        "out of that; what would have been seen is listed, more insertions would show less");
}

void remark_on_bounds(Findings& findings) {
  for (const Discrepancy& one : findings.discrepancies)
    if (const std::string fault = find_fault(one.curve); !fault.empty())
      findings.remarks.push_back("the discrepancy is beyond what a model file may hold, and is not in it: " + fault);
  for (const FoundEffect& effect : findings.effects)
    for (const FoundParameter& parameter : effect.parameters)
      if (parameter.at_bound)
        findings.remarks.push_back(effect.name + ": " + parameter.name +
                                   " lies at the end of the range that fits allow; it is a limit, not a measurement");
}

void list_explanations(const inference::Search& search, const inference::Posterior& posterior, Findings& findings) {
  for (const auto& share : posterior.sets) {
    if (findings.explanations.size() == kExplanations) break;
    Explanation one{.effects = {}, .probability = share.probability, .with_discrepancy = share.with_discrepancy};
    for (const std::size_t e : share.set) one.effects.push_back(search.system().effects()[e].label);
    findings.explanations.push_back(std::move(one));
  }
  findings.nothing_probability = posterior.nothing;
  findings.discrepancy_probability = posterior.discrepancy;
  findings.not_visited = posterior.not_visited;
}

// The motion that separates the chosen model from the likeliest other explanation; of an inconclusive verdict, the two
// likeliest explanations. Null where there is no other.
std::optional<NextExperiment> next_experiment(const inference::Search& search, const inference::Posterior& posterior,
                                              const Decision& decision, const ChosenModel& base,
                                              const Experiments& experiments) {
  const auto model = [&](const inference::Fit& fit) { return imagined(fit, model_of(search, fit)); };
  const auto chosen =
      decision.verdict == Verdict::inconclusive ? posterior.sets.front().set : decision.model.fit->layout.set();
  const inference::Fit& chosen_fit =
      decision.verdict == Verdict::inconclusive ? search.visited().at(chosen).likelier_fit() : *decision.model.fit;
  if (decision.verdict == Verdict::unknown_effect) {
    // Against the likeliest explanation without a discrepancy, or the needle alone.
    for (const auto& share : posterior.sets)
      if (!share.set.empty() && share.set != chosen)
        return experiments.best(model(chosen_fit), model(search.visited().at(share.set).at->fit));
    return experiments.best(model(chosen_fit), imagined(*base.fit, base));
  }
  for (const auto& share : posterior.sets) {
    if (share.set == chosen) continue;
    const Imagined rival = model(search.visited().at(share.set).at->fit);
    const Imagined found = model(chosen_fit);
    // Where nothing was found, the rival would have to be true to be seen.
    return chosen.empty() ? experiments.best(rival, found) : experiments.best(found, rival);
  }
  return std::nullopt;
}

}  // namespace

std::string_view name_of(Verdict verdict, bool two_groups) {
  switch (verdict) {
    case Verdict::nothing_missing:
      return two_groups ? "unchanged" : "nothing-missing";
    case Verdict::effects_found:
      return two_groups ? "changed" : "effects-found";
    case Verdict::inconclusive:
      return "inconclusive";
    case Verdict::unknown_effect:
      break;
  }
  return two_groups ? "changed-unknown" : "unknown-effect";
}

Findings diagnose(const RecordedCase& recorded, const model::NeedleParameters& model, const DiagnosisOptions& options) {
  Findings findings;
  findings.model_file = model;
  findings.two_groups = recorded.two_groups();
  findings.stop_s = recorded.has_clock ? 0 : recorded.frame_s;
  for (const auto& channel : recorded.channels) {
    findings.channels.push_back(channel.name);
    findings.units.emplace_back(channel.unit());
    findings.scatter.push_back(channel.scatter);
  }
  Stages stages(options, findings.times);

  stages.begin("measuring the cameras' noise");
  const NeedleSystem system(recorded, model, options.known);
  const inference::Calibration calibration = calibrate(system);
  for (const auto& recording : recorded.recordings) findings.readings += recording.motion.at.size();
  for (const auto& readings : calibration.outliers) findings.outliers += readings.size();

  stages.begin("comparing sets of effects");
  inference::SearchRules rules;
  rules.threads = options.threads;
  rules.largest = options.largest_set;
  Crew crew(rules.threads);
  inference::Search search(system, rules);
  search.run(calibration.outliers, calibration.noise, [&](const std::string& set) {
    if (options.progress) options.progress("comparing sets of effects: beside " + set);
  });
  const inference::Posterior posterior = posterior_of(search, consequence_sigmas(rules));
  list_explanations(search, posterior, findings);

  stages.begin("intervals and confounders");
  const inference::Unknowns unknowns(search);
  Decision decision = decide(search, posterior, [&](const ChosenModel& chosen, std::size_t member) {
    return fault_of_name(system, search, unknowns, chosen, member);
  });
  std::optional<inference::Fit> base_fit;
  const auto describe_decision = [&] {
    findings.verdict = decision.verdict;
    findings.probability = decision.probability;
    findings.reasons = decision.reasons;
    findings.noise = decision.model.fit->likelihood->noise();
    findings.noise.outlier_share = calibration.noise.outlier_share;
    base_fit = refitted_base(search, *decision.model.fit);
    findings.effects = found_effects(system, search, posterior, unknowns, decision.model);
    findings.discrepancies = discrepancies_of(system, search, decision.model);
    findings.discrepancy_sigmas =
        findings.discrepancies.empty() ? 0 : visible_sigmas_of_curve(search, *decision.model.fit);
    findings.proposals = propose_forms(system, search, decision.model);
    findings.insertions = insertions_of(system, search, decision.model);
    findings.needle = needle_estimate(system, search, decision.model);
  };
  describe_decision();
  findings.variation = variation_of(search, unknowns);
  const inference::Fit& alone = search.visited().at({}).at->fit;
  findings.base = needle_estimate(system, search, model_of(search, alone));

  stages.begin("predicting each recording from the others");
  findings.held_out = hold_out(system, search, *decision.model.fit);
  if (auto broken = violations(findings); !broken.empty()) {
    decision = inconclusive(search, std::move(broken));
    describe_decision();
  }
  const ChosenModel base = model_of(search, *base_fit);
  const bool with_discrepancy = !decision.model.fit->scales.curves.empty();
  findings.tried = tried_beside(search, {}, with_discrepancy);
  if (!decision.model.fit->layout.set().empty())
    findings.beside = tried_beside(search, decision.model.fit->layout.set(), with_discrepancy);
  findings.checks = check_model(search, decision.model, calibration.outliers, calibration.noise);

  stages.begin("what these recordings could have shown");
  const Experiments experiments(system, findings.noise);
  find_reach(system, search, base, experiments, findings);
  if (is_experiment_needed(findings))
    findings.next_experiment = next_experiment(search, posterior, decision, base, experiments);

  if (adopts_a_model(findings.verdict)) findings.where = locate(system, base, decision.model, 3);
  findings.traces = make_traces(system, calibration.outliers, base, decision.model, model);
  remark_on_short_recordings(recorded, findings);
  remark_on_clock(system, findings);
  remark_on_retraction(system, findings);
  remark_on_groups(recorded, findings);
  remark_on_beliefs(system, findings.needle, findings);
  remark_on_bounds(findings);
  findings.sentence = sentence_of(findings);
  stages.end();
  return findings;
}

}  // namespace bevel::diagnosis
