#include "diagnosis/mismatch/diagnose.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "diagnosis/mismatch/calibration.hpp"
#include "diagnosis/mismatch/conclusions.hpp"
#include "diagnosis/mismatch/gates.hpp"
#include "diagnosis/mismatch/location.hpp"
#include "diagnosis/mismatch/selection.hpp"

namespace bevel::diagnosis {
namespace {

constexpr int kNoiseRounds = 3;
constexpr std::size_t kFewReadings = 40;

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

// Leave-one-out, before and after, with the figures per recording.
HeldOut hold_out(const Evidence& evidence, const Fit& before, const Fit& after, int threads) {
  HeldOut out;
  const HeldOutFit without = leave_one_out(evidence, before, threads);
  const HeldOutFit with = leave_one_out(evidence, after, threads);
  std::size_t count_before = 0, count_after = 0;
  for (std::size_t r = 0; r < evidence.recorded->recordings.size(); ++r) {
    HeldOutRecording one{.log = evidence.recorded->recordings[r].name, .before = {}, .after = {}};
    one.before = figures_of(evidence, before.hypothesis, r, without.values[r], out.before, count_before);
    one.after = figures_of(evidence, after.hypothesis, r, with.values[r], out.after, count_after);
    out.recordings.push_back(one);
  }
  for (auto [figures, count] : {std::pair{&out.before, count_before}, std::pair{&out.after, count_after}}) {
    const auto n = static_cast<double>(std::max<std::size_t>(count, 1));
    figures->rmse_mm = std::sqrt(figures->rmse_mm / n);
    figures->chi2_per_dof /= n;
  }
  out.gain = without.total() - with.total();
  return out;
}

void remark_on_short_recordings(const RecordedCase& recorded, Findings& findings) {
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (const auto& recording : recorded.recordings) fewest = std::min(fewest, recording.motion.at.size());
  if (fewest < kFewReadings)
    findings.remarks.push_back(
        "a recording has only " + std::to_string(fewest) +
        " readings: the cameras' noise is hardly known, and what is quicker than a few readings cannot be seen");
}

// No name holds, and what the curves leave is no noise: there is nothing to measure the noise beside.
bool hopeless(const Evidence& evidence, const Fit& fit) {
  const EffectSet& set = fit.hypothesis.set();
  return std::all_of(set.begin(), set.end(), is_correction) && examine_remains(evidence, fit).has_structure();
}

// A name that does not foretell is not physics, and a nameless curve that does not is no description.
void drop_what_does_not_foretell(Selection& selection, const Fit& base, EffectSet& set, Findings& findings,
                                 int threads) {
  const Evidence& evidence = selection.evidence();
  const auto drop = [&](EffectSet::iterator member) {
    const EffectSet rest = without_member(set, static_cast<std::size_t>(member - set.begin()));
    findings.remarks.push_back(std::string(member->effect->name()) + " beside " + describe(rest) +
                               " fits, but foretells recordings that it was not fitted on no better: it was dropped");
    set = rest;
    findings.held_out = hold_out(evidence, base, *selection.fit_of(set), threads);
  };
  const auto foretold = [&](const EffectSet& of) {
    return leave_one_out(evidence, *selection.fit_of(of), threads).total();
  };
  const auto idle_curve = [&] {
    if (std::none_of(set.begin(), set.end(), is_correction)) return set.end();
    const double with = foretold(set);
    return std::find_if(set.begin(), set.end(), [&](const Member& member) {
      return is_correction(member) &&
             !(with < foretold(without_member(set, static_cast<std::size_t>(&member - set.data()))));
    });
  };
  for (auto idle = idle_curve(); idle != set.end(); idle = idle_curve()) drop(idle);
  while (!set.empty() && findings.held_out.gain <= 0) drop(std::prev(set.end()));
}

}  // namespace

Findings diagnose(const RecordedCase& original, const model::NeedleParameters& model, const DiagnosisOptions& options) {
  Findings findings;
  findings.model_file = model;
  findings.seed = options.seed;
  findings.bootstrap_draws = options.bootstrap_draws;
  for (const auto& channel : original.channels) findings.channels.push_back(channel.name);
  Stages stages(options, findings.times);

  stages.begin("fitting the needle's own parameters");
  Evidence evidence;
  RecordedCase recorded = original;
  evidence.recorded = &recorded;
  evidence.belief = model;
  evidence.noise.frame_s = original.frame_s;
  for (const auto& channel : original.channels) evidence.noise.sigma_mm.push_back(channel.claimed_sigma_mm);
  const Hypothesis nothing(model, {}, original);
  Fit base = fit(evidence, nothing, nothing.start());
  if (!base.valid)
    throw std::invalid_argument(
        "the model in use cannot follow these recordings: with it the tip leaves the domain of the slip law; check the "
        "model file's curvature_per_mm and lambda, and that insertion and rotation are logged in mm and rad");

  stages.begin("measuring the cameras' noise");
  Calibration calibration = calibrate_noise(original, errors_of(evidence, base));
  SelectionRules rules;
  rules.seed = options.seed;
  rules.threads = options.threads;
  rules.bootstrap_draws = options.bootstrap_draws;
  rules.largest_set = options.largest_set;
  EffectSet set;
  std::unique_ptr<Selection> selection;
  for (int round = 0;; ++round) {
    recorded = without(original, calibration.outliers);
    evidence.noise = calibration.noise;
    base = fit(evidence, nothing, base.values);
    stages.begin(round == 0 ? "trying every effect" : "trying again with the noise as it now stands");
    selection = std::make_unique<Selection>(evidence, base, rules, options.progress);
    set = selection->select();
    if (round + 1 == kNoiseRounds) break;
    // Missing physics may have passed for noise, or for outliers: with the best explanation both are measured again.
    if (set.empty() || hopeless(evidence, *selection->fit_of(set))) break;
    const Calibration again = calibrate_beside(original, evidence, *selection->fit_of(set));
    if (settled(calibration, again)) break;
    calibration = again;
  }
  findings.noise = evidence.noise;
  remark_on_short_recordings(original, findings);
  for (const auto& recording : original.recordings) findings.readings += recording.motion.at.size();
  for (const auto& readings : calibration.outliers) findings.outliers += readings.size();

  stages.begin("foretelling each recording from the others");
  findings.held_out = hold_out(evidence, base, *selection->fit_of(set), options.threads);
  drop_what_does_not_foretell(*selection, base, set, findings, options.threads);

  stages.begin("intervals, rivals and the next experiment");
  conclude(*selection, base, set, findings, options.threads);
  findings.where = set.empty() ? std::vector<Location>{} : locate(evidence, base, *selection->fit_of(set), 3);
  findings.traces = make_traces(evidence, original, base, *selection->fit_of(set), model);
  stages.end();
  return findings;
}

}  // namespace bevel::diagnosis
