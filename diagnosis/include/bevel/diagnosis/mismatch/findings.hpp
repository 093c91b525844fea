// SPDX-License-Identifier: MIT
#pragma once
// What the mismatch tool found, as plain data: verdict.json, report.html and model.toml are made from this alone.
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <bevel/diagnosis/inference/forms.hpp>
#include <bevel/diagnosis/inference/noise.hpp>
#include <bevel/diagnosis/needle/recorded_case.hpp>
#include <bevel/model/effects/covariates.hpp>
#include <bevel/model/effects/discrepancy.hpp>

namespace bevel::diagnosis {

enum class Verdict { nothing_missing, effects_found, unknown_effect, inconclusive };
/// Returns "nothing-missing", "effects-found" or "unknown-effect"; for two groups of recordings "unchanged", "changed"
/// or "changed-unknown"; for both "inconclusive".
std::string_view name_of(Verdict verdict, bool two_groups = false);
/// Returns whether a model other than the nominal one is adopted.
inline bool adopts_a_model(Verdict verdict) {
  return verdict == Verdict::effects_found || verdict == Verdict::unknown_effect;
}

struct FoundParameter {
  std::string name;
  double value = 0;      // of the model that is written
  double std_error = 0;  // about it: over all explanations that hold the effect, with and without a discrepancy
  std::array<double, 2> ci95{};
  bool at_bound = false;
  double none = std::numeric_limits<double>::quiet_NaN();  // value at which the effect vanishes; NaN: at no value
};
/// Returns whether the 95 % interval of a size excludes "no effect"; false for a parameter at which no effect vanishes.
inline bool excludes_none(const FoundParameter& p) { return p.ci95[0] > p.none || p.ci95[1] < p.none; }

// Instants and phases: one entry per recording that has the effect.
struct FoundInRecording {
  std::string log;
  std::vector<FoundParameter> parameters;
};

struct FoundEffect {
  std::string name;
  std::string meaning;                        // one clause
  double probability = 0;                     // of being in the model
  double joint_probability = 0;               // of it or one of `ambiguous_with` being in the model
  std::vector<std::string> ambiguous_with{};  // at odds of less than 20 to 1 in its place
  std::vector<FoundParameter> parameters{};
  std::vector<FoundInRecording> recordings{};
  // Natural: of the model with it against the model without it, both with a discrepancy or both without one.
  double log_bayes_factor = 0;
  double visible_sigmas = 0;  // root of the fall of chi2 that it brings, given the others
  // By how much it moves the tip where the cameras see it: the model without it against the model that was found, at
  // the deepest reading of each recording, root mean square over recordings. NaN: without it the tip cannot follow.
  double moved_at_depth_mm = 0;
};

/// When the missing physics begins to act in a recording.
struct Location {
  std::string log;
  std::string channel;          // in which it lowers chi2 most
  double from_s = 0, to_s = 0;  // 95 % interval of the onset
  std::string covariate;
  std::array<double, 2> range{};  // of the covariate, during the onset
  double share = 0;               // of the whole mismatch, in chi2
};

// Of scalar readings; errors in mm of positions alone, headings count in chi2 and density. chi2 counts what was not
// known beforehand too (parameters, variation between insertions): 1 is a prediction that knows how sure it is.
struct FitFigures {
  double rmse_mm = 0, rmse_se_mm = 0;  // its standard error: from recording to recording
  double max_mm = 0, chi2_per_dof = 0;
  double log_density = 0, log_density_se = 0;  // predictive, natural, per reading, of mm
};
// Of one channel's readings: root mean square of measured - predicted in the channel's unit, and the share that lies
// within its 95 % interval.
struct ChannelFigures {
  double rmse = 0, share_in_95 = 0;
};
// Of readings that were predicted as normals or sums of them; rmse_mm of positions, density and share of headings too.
struct PredictionFigures {
  double rmse_mm = 0;
  double log_density = 0;  // natural, per reading, in mm and rad
  double share_in_95 = 0;
  std::vector<ChannelFigures> channels;  // in the order of Findings::channels; NaN: it has none of the readings
  std::size_t readings = 0;              // scalar
};
// By one model, its parameters and its variation from the other recordings: as a new insertion, of which the standard
// deviations between insertions are all that is known; and continued from its own first third, in time.
struct InsertionPredicted {
  PredictionFigures whole;      // all readings, as of a new insertion
  PredictionFigures beyond;     // those beyond the first third, as of a new insertion
  PredictionFigures continued;  // the same ones, given the first third
};
struct HeldOutRecording {
  std::string log;
  FitFigures before, after;
  InsertionPredicted predicted_before, predicted_after;
};
// Each recording (of two groups: of the second) predicted as a new insertion.
struct HeldOut {
  FitFigures as_it_stands;   // by the model file; noise alone is known
  FitFigures before, after;  // refitted to the others: the needle alone, and what the others select
  FitFigures noise_floor;    // of a prediction that is true and sure
  // Reading by reading, with intervals: before by the noise and the variation of the needle alone.
  InsertionPredicted predicted_before, predicted_after;
  std::vector<HeldOutRecording> recordings;
  double gain = 0;  // of log predictive density, natural, over all recordings
};

// A set of effects and its share in the posterior.
struct Explanation {
  std::vector<std::string> effects;
  double probability = 0;
  double with_discrepancy = 0;  // part of it
};

// One line of the ranking: an effect tried alone, or beside what was found.
struct TriedEffect {
  std::string name;
  std::string beside;  // "" = alone
  // Natural, against its absence, both with a discrepancy or both without one; null: not computed.
  std::optional<double> log_bayes_factor{};
  bool with_discrepancy = false;  // both
  bool fitted = false;            // else estimated from the linear model
  bool likelier = false;          // its prior odds included
  std::vector<std::pair<std::string, double>> parameters{};
};

// The smallest size that these recordings would have shown.
struct DetectableSize {
  std::string effect, parameter;
  double size = 0;         // against "none"; infinite: cannot be shown at all
  double typical = 0;      // what the field reports, for comparison (a start of the fits)
  double absorbed = 0;     // share of its signature that k, lambda1, lambda2 and the variation take over
  std::string experiment;  // motion that would show it, if this size is above typical
};

// What remains unexplained, described: which quantity of the motion is off by how much, against what. Several add up.
struct Discrepancy {
  model::DiscrepancyCurve curve;
  double log_bayes_factor = 0;   // natural: of the likeliest one against none, of so many against one less
  double visible_size = 0;       // root mean square over the readings, in standard deviations of the noise
  double moved_at_depth_mm = 0;  // as of an effect
};

// The simplest equation that does for one of the discrepancies what its curve does, beside the others: a proposal for
// an effect, not a cause.
struct ProposedForm {
  model::DiscrepancyComponent component = model::DiscrepancyComponent::curvature_bevel;
  model::Covariate covariate = model::Covariate::depth_mm;
  inference::Form form = inference::Form::step;
  std::string equation;                             // "a (1 - exp(-(x - 0.2) / s))"; x is the covariate
  double amplitude = 0, amplitude_sd = 0;           // a, in the component's unit
  double shape = 0, shape_low = 0, shape_high = 0;  // s, with 95 %
  double log_bayes_factor = 0;                      // natural, of this one against the curves together
  double phase_rad = 0;                             // of a sinusoid
  double low = 0, range = 0;                        // of the covariate in the recordings: inference/forms.hpp
  bool periodic = false;                            // the covariate is an angle, s a share of its circle
  std::vector<double> shapes{};                     // those that were tried
  std::size_t discrepancy = 0;                      // which of Findings::discrepancies it stands for
};

// How much insertions differ: the standard deviation of one quantity between them.
struct VariationEstimate {
  std::string name, unit;
  double sd = 0;             // posterior mean
  double none = 0;           // probability that they do not differ
  double low = 0, high = 0;  // 95 %, of the values that were tried
  bool at_end = false;       // the interval reaches the largest of them: a limit, not a measurement
};

// What one insertion has of its own, as a deviation from what all share: curvature as a share of the needle's, the
// heading about x and y and the bevel's roll at the entry in rad, registration in x and y (where depths were read by
// hand, z) in mm.
struct InsertionValue {
  std::string name;   // as in model::OwnValues: "curvature_relative", "tilt_x_rad", ...
  std::string group;  // of VariationEstimate::name
  double value = 0, std_error = 0;
  std::array<double, 2> ci95{};
};
struct InsertionValues {
  std::string log;
  std::vector<InsertionValue> values;
};

struct NextExperiment {
  std::string script;  // what to command
  std::array<std::string, 2> separates;
  double expected_gain = 0;  // of chi2, in one recording of it
};

struct NeedleEstimate {
  model::NeedleParameters value;
  double curvature_sd_per_mm = 0, lambda1_sd_per_rad = 0, lambda2_sd = 0;
  /// False: the shaft turns too little to separate slip from curvature. Both lambda keep the values of the model file,
  /// and their standard deviations are those of the prior density.
  bool slip_determined = true;
};

// Insertions steered in simulated time with one model in the software: true tip to target where the needle came to
// rest, of those that arrived; NaN where none did.
struct SteeredFigures {
  std::size_t arrived = 0;
  double median_mm = 0, worst_mm = 0;  // the upper of the middle two, of an even count
  std::string stopped_by{};            // the commonest reason of those that did not arrive; "": all did
  /// The insertions that ended before the depth of their target, counted by reason.
  struct Stopped {
    std::string reason;  ///< of an unhealthy estimate with the quantity: "needle state unhealthy, age of ..."
    std::size_t count = 0;
    std::array<double, 2> value{};  ///< least and largest of the quantity
    double limit = 0;               ///< largest allowed; 0: the reason has none
    std::string unit;
    std::array<double, 2> depth_mm{};  ///< least and largest z of the true tip
  };
  std::vector<Stopped> stopped{};  ///< the commonest first
};
/// Mean difference of the distances from tip to target, over the targets at which both models arrive.
struct PairedMiss {
  std::size_t targets = 0;
  double farther_mm = 0;    ///< with the model that was found, less as it stands: negative if it steers nearer
  double std_error_mm = 0;  ///< of the mean
};
// To the same targets on a rig that is the model that was found, with the recordings' noise.
struct SteeredToTargets {
  std::size_t targets = 0;
  std::uint64_t seed = 0;
  std::array<double, 2> depth_mm{};  // of the targets, along z: from, to
  SteeredFigures as_it_stands{}, found{};
  PairedMiss paired{};
  std::vector<std::string> not_known_live{};  // effects that no software knows of an insertion beforehand
};

// For pictures: one recording against time.
struct Trace {
  std::string log;
  std::vector<double> time_s;  // one per reading
  std::vector<model::Covariates> covariates;
  std::vector<Eigen::Vector3d> measured_mm, model_file_mm, before_mm, after_mm;
  std::vector<char> outlier;  // 1: taken for one
  // Whitened residuals per channel (NaN where the channel has no reading): of the base refit, and of what was found.
  std::vector<std::vector<double>> white_before, white_after;
};

// Printed for people; no verdict depends on them.
struct Checks {
  double chi2_per_dof = 0;
  std::array<double, 2> band{};  // 99 % of it if the model is right and the noise as found
  double ljung_box_p = 1;        // smallest over the series, times their number
  bool clean = true;             // both as chance leaves them in 99 of 100
};

struct StageTime {
  std::string stage;
  double seconds = 0;
};

struct Findings {
  Verdict verdict = Verdict::nothing_missing;
  bool two_groups = false;  // what is said is of what the second has and the first has not
  double stop_s = 0;     // logs without a clock: by how much "times" of neighbouring stops are apart; 0: they have one
  std::string sentence;  // what was found, in one
  double probability = 0;  // of the verdict, given that one of the fitted models is true; inconclusive: 0
  // Why likely effects are not named, one sentence each; inconclusive: why nothing is concluded.
  std::vector<std::string> reasons{};
  std::vector<FoundEffect> effects;
  std::vector<Explanation> explanations;  // the likeliest first
  double nothing_probability = 0;         // of no effect, and no discrepancy of any consequence
  double discrepancy_probability = 0;     // of one of consequence
  double discrepancy_sigmas = 0;          // of the one in the model, all its curves: visible standard deviations
  double not_visited = 0;                 // share of sets that were judged by the linear model alone
  std::vector<Location> where;
  inference::Noise noise;
  std::vector<std::string> channels, units;  // in the order of noise.sigma
  std::vector<ScatterNearEntry> scatter{};   // the same; noise is that deep down
  std::vector<VariationEstimate> variation;
  std::vector<InsertionValues> insertions;  // in the order of the recordings
  HeldOut held_out;
  NeedleEstimate base, needle;  // refitted without, and with what was found
  model::NeedleParameters model_file;
  std::vector<TriedEffect> tried;   // alone, best first
  std::vector<TriedEffect> beside;  // beside what was found, best first
  std::vector<DetectableSize> detectable;
  std::vector<Discrepancy> discrepancies;         // unknown-effect only
  std::vector<ProposedForm> proposals;            // of each discrepancy in turn, the likeliest first
  std::optional<NextExperiment> next_experiment;  // null: none is needed, or none of the known motions decides
  std::optional<SteeredToTargets> steered;        // by whoever has a controller: diagnose() leaves it empty
  std::string not_steered;                        // why, in a clause, where something found might matter to steering
  std::vector<std::string> confusion_names;
  Eigen::MatrixXd confusion;  // |cosine| between visible parts
  Checks checks;
  std::vector<std::string> remarks;  // plain sentences: what was not usable, what cannot be told apart
  std::vector<Trace> traces;
  std::size_t readings = 0, outliers = 0;  // messages
  std::vector<StageTime> times;
};

/// From this probability of a verdict on, no experiment is needed to separate it from other explanations.
inline constexpr double kNoDoubt = 0.99;
inline bool is_experiment_needed(const Findings& findings) {
  return findings.verdict == Verdict::inconclusive || findings.probability < kNoDoubt;
}

}  // namespace bevel::diagnosis
