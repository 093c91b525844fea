// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Result of a mismatch diagnosis, as plain data. The files verdict.json, report.html and model.toml depend on these
/// values alone. Log Bayes factors and log densities are natural logarithms. Frame {A} is the frame of the entry point.
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

/// Mismatch diagnosis and parameter identification of bevel-tip needles from recorded insertions.
namespace bevel::diagnosis {

/// Conclusion of a diagnosis.
enum class Verdict {
  nothing_missing,  ///< neither an effect nor a discrepancy of consequence is likelier than not
  effects_found,    ///< effects of the library explain the mismatch
  unknown_effect,   ///< a discrepancy of consequence remains that no effect of the library explains
  inconclusive      ///< the evidence is insufficient for any of the above; the nominal model is kept
};
/// Returns the name of a verdict as used in verdict.json.
/// @param verdict the verdict
/// @param two_groups whether two groups of recordings are compared
/// @return "nothing-missing", "effects-found" or "unknown-effect"; for two groups of recordings "unchanged", "changed"
///   or "changed-unknown"; for both "inconclusive"
std::string_view name_of(Verdict verdict, bool two_groups = false);
/// Returns whether a model other than the nominal one is adopted.
/// @param verdict the verdict
/// @return true for effects_found and unknown_effect
inline bool adopts_a_model(Verdict verdict) {
  return verdict == Verdict::effects_found || verdict == Verdict::unknown_effect;
}

/// Estimate of one parameter of an effect, in the parameter's unit.
struct FoundParameter {
  std::string name;              ///< name of the parameter
  double value = 0;              ///< estimate in the adopted model
  double std_error = 0;          ///< standard error about value, over all models with the effect (and discrepancies)
  std::array<double, 2> ci95{};  ///< 95 % interval, lower and upper limit
  bool at_bound = false;         ///< whether the estimate lies at a bound of the range of the fit
  double none = std::numeric_limits<double>::quiet_NaN();  ///< value at which the effect vanishes; NaN: none
};
/// Returns whether the 95 % interval of a parameter excludes the value at which the effect vanishes.
/// @param p the estimate
/// @return true if it does; false for a parameter without such a value
inline bool excludes_none(const FoundParameter& p) { return p.ci95[0] > p.none || p.ci95[1] < p.none; }

/// Parameters of an effect that are specific to one recording: event times and phases.
struct FoundInRecording {
  std::string log;                         ///< name of the recording
  std::vector<FoundParameter> parameters;  ///< estimates in this recording
};

/// One effect of the adopted model.
struct FoundEffect {
  std::string name;                            ///< name in the effect library
  std::string meaning;                         ///< description, one clause
  double probability = 0;                      ///< posterior probability that the effect is in the model
  double joint_probability = 0;                ///< posterior probability of the effect or one of ambiguous_with
  std::vector<std::string> ambiguous_with{};   ///< confounders: odds against them in its place are below 20 to 1
  std::vector<FoundParameter> parameters{};    ///< estimates that all recordings share
  std::vector<FoundInRecording> recordings{};  ///< one entry per recording that has the effect
  /// Log Bayes factor of the model with the effect against the model without it, both with or both without a
  /// discrepancy.
  double log_bayes_factor = 0;
  double visible_sigmas = 0;  ///< square root of the decrease of chi2 by the effect, given the other effects
  /// Tip displacement by the effect, mm: distance, as the cameras see it, between the adopted model with and without
  /// the effect, at the deepest measurement of each recording, root mean square over recordings. NaN: without the
  /// effect the tip leaves the domain of the slip law.
  double moved_at_depth_mm = 0;
};

/// When the missing physics begins to act in a recording.
struct Location {
  std::string log;                ///< name of the recording
  std::string channel;            ///< channel in which the adopted model lowers chi2 most
  double from_s = 0,              ///< lower limit of the 95 % interval of the onset, s
      to_s = 0;                   ///< upper limit of the 95 % interval of the onset, s
  std::string covariate;          ///< name of the covariate that range refers to
  std::array<double, 2> range{};  ///< least and largest covariate during the onset, in the covariate's unit
  double share = 0;               ///< share of the decrease of chi2 over all recordings, in [0, 1]
};

/// Accuracy of predictions over scalar measurements. Errors in mm are of positions alone; headings count in chi2 and
/// density. chi2 includes the variance of unknown parameters and of insertion-specific parameters.
struct FitFigures {
  double rmse_mm = 0,      ///< root mean square error, mm
      rmse_se_mm = 0;      ///< standard error of rmse_mm from its variation between recordings, mm
  double max_mm = 0,       ///< largest absolute error, mm
      chi2_per_dof = 0;    ///< chi2 per measurement; 1 = consistent with the predicted uncertainty
  double log_density = 0,  ///< log predictive density per measurement, of mm
      log_density_se = 0;  ///< standard error of log_density from its variation between recordings
};
/// Prediction error of one channel.
struct ChannelFigures {
  double rmse = 0,      ///< root mean square of measured minus predicted, in the channel's unit
      share_in_95 = 0;  ///< share of the measurements within their predicted 95 % interval
};
/// Accuracy of predictions whose density is a normal density or a mixture of normal densities.
struct PredictionFigures {
  double rmse_mm = 0;                    ///< root mean square error of positions, mm
  double log_density = 0;                ///< log predictive density per measurement, in mm and rad
  double share_in_95 = 0;                ///< share of all measurements within their predicted 95 % interval
  std::vector<ChannelFigures> channels;  ///< in the order of Findings::channels; NaN: no measurement of the channel
  std::size_t readings = 0;              ///< number of scalar measurements
};
/// Prediction of a left-out recording by one model, whose parameters and between-insertion standard deviations are
/// estimated from the other recordings.
struct InsertionPredicted {
  PredictionFigures whole;      ///< all measurements, predicted as a new insertion
  PredictionFigures beyond;     ///< measurements after the first third, predicted as a new insertion
  PredictionFigures continued;  ///< measurements after the first third, conditional on the first third
};
/// Prediction of one left-out recording from the other recordings.
struct HeldOutRecording {
  std::string log;                      ///< name of the recording
  FitFigures before,                    ///< by the refitted nominal model
      after;                            ///< by the model that the other recordings select
  InsertionPredicted predicted_before,  ///< measurement by measurement, by the refitted nominal model
      predicted_after;                  ///< measurement by measurement, by the models that the other recordings select
};
/// Cross-validation: each recording (of two groups: of the second group) predicted as a new insertion.
struct HeldOut {
  FitFigures as_it_stands;              ///< by the model file without refit; noise is the only uncertainty
  FitFigures before,                    ///< by the nominal model, refitted to the other recordings
      after;                            ///< by the model that the other recordings select
  FitFigures noise_floor;               ///< expected figures of an exact prediction: errors are measurement noise alone
  InsertionPredicted predicted_before,  ///< by the nominal model with its own noise and between-insertion deviations
      predicted_after;                  ///< by the models that the other recordings select
  std::vector<HeldOutRecording> recordings;  ///< each recording separately
  double gain = 0;                           ///< gain in log predictive density of after over before, all recordings
};

/// A candidate model and its share of the posterior.
struct Explanation {
  std::vector<std::string> effects;  ///< labels of its effects; empty: the nominal model
  double probability = 0;            ///< posterior probability
  double with_discrepancy = 0;       ///< part of probability that belongs to the model with a discrepancy
};

/// One line of the ranking: an effect added to the nominal model or to the adopted model.
struct TriedEffect {
  std::string name;    ///< label of the effect
  std::string beside;  ///< the model to which the effect is added; "": the nominal model
  /// Log Bayes factor against the model without the effect, both with or both without a discrepancy; null: not
  /// computed.
  std::optional<double> log_bayes_factor{};
  bool with_discrepancy = false;  ///< whether both models have a discrepancy
  bool fitted = false;            ///< whether the model was fitted; false: estimated from the linearised model
  bool likelier = false;          ///< whether the effect is likelier than its absence, prior odds included
  std::vector<std::pair<std::string, double>> parameters{};  ///< names and estimates of its parameters
};

/// Smallest size of an effect that these recordings could have shown.
struct DetectableSize {
  std::string effect,      ///< name of the effect
      parameter;           ///< name of the parameter that measures its size
  double size = 0;         ///< distance from the value at which the effect vanishes; infinite: not detectable
  double typical = 0;      ///< typical size in the literature (a start value of the fits), for comparison
  double absorbed = 0;     ///< share of its signature absorbed by k, lambda1, lambda2 and insertion-specific parameters
  std::string experiment;  ///< motion that would show the effect, if size is above typical
};

/// One discrepancy term: an unexplained deviation of a component of the motion as a function of a covariate. Several
/// terms add up.
struct Discrepancy {
  model::DiscrepancyCurve curve;  ///< component, covariate and values
  double log_bayes_factor = 0;    ///< of the likeliest term against none, given the terms before it
  double visible_size = 0;        ///< root mean square over the measurements, in standard deviations of the noise
  double moved_at_depth_mm = 0;   ///< tip displacement by the term, mm; as FoundEffect::moved_at_depth_mm
};

/// Simplest closed form that replaces one discrepancy term, given the others. It is a proposal for a new effect, not
/// an established cause.
struct ProposedForm {
  model::DiscrepancyComponent component = model::DiscrepancyComponent::curvature_bevel;  ///< affected component
  model::Covariate covariate = model::Covariate::depth_mm;                               ///< argument x
  inference::Form form = inference::Form::step;                                          ///< kind of equation
  std::string equation;          ///< equation with x the covariate, for example "a (1 - exp(-(x - 0.2) / s))"
  double amplitude = 0,          ///< a, in the component's unit
      amplitude_sd = 0;          ///< standard deviation of a
  double shape = 0,              ///< s
      shape_low = 0,             ///< lower limit of the 95 % interval of s
      shape_high = 0;            ///< upper limit of the 95 % interval of s
  double log_bayes_factor = 0;   ///< of this form against all curves together
  double phase_rad = 0;          ///< phase of a sinusoid, rad
  double low = 0,                ///< least covariate in the recordings (inference/forms.hpp)
      range = 0;                 ///< largest minus least covariate in the recordings
  bool periodic = false;         ///< whether the covariate is an angle; s is then a share of the full circle
  std::vector<double> shapes{};  ///< grid of s that was evaluated
  std::size_t discrepancy = 0;   ///< index into Findings::discrepancies of the replaced term
};

/// Between-insertion standard deviation of one quantity.
struct VariationEstimate {
  std::string name,     ///< name of the quantity
      unit;             ///< unit of sd, low and high
  double sd = 0;        ///< posterior mean of the standard deviation
  double none = 0;      ///< posterior probability that insertions do not differ
  double low = 0,       ///< lower limit of the 95 % interval, a value of the evaluated grid
      high = 0;         ///< upper limit of the 95 % interval, a value of the evaluated grid
  bool at_end = false;  ///< whether the interval reaches the end of the grid; high is then a bound, not an estimate
};

/// Insertion-specific parameter, as a deviation from the value that all insertions share: relative curvature, rotation
/// of the heading about x and y and roll of the bevel at the entry (rad), registration in x and y (z as well where
/// depths are read by hand; mm).
struct InsertionValue {
  std::string name;              ///< as in model::OwnValues: "curvature_relative", "tilt_x_rad", ...
  std::string group;             ///< VariationEstimate::name of its standard deviation
  double value = 0,              ///< estimate
      std_error = 0;             ///< standard error
  std::array<double, 2> ci95{};  ///< 95 % interval, lower and upper limit
};
/// Insertion-specific parameters of one recording.
struct InsertionValues {
  std::string log;                     ///< name of the recording
  std::vector<InsertionValue> values;  ///< its parameters
};

/// Recommended next recording.
struct NextExperiment {
  std::string script;                    ///< motion to command
  std::array<std::string, 2> separates;  ///< the two explanations that it separates
  double expected_gain = 0;              ///< expected difference in chi2 in one recording of the motion
};

/// Estimate of the needle's parameters.
struct NeedleEstimate {
  model::NeedleParameters value;   ///< estimates
  double curvature_sd_per_mm = 0,  ///< standard deviation of the curvature, 1/mm
      lambda1_sd_per_rad = 0,      ///< standard deviation of lambda1, 1/rad
      lambda2_sd = 0;              ///< standard deviation of lambda2
  /// False: the shaft turns too little to separate slip from curvature. Both lambda keep the values of the model file,
  /// and their standard deviations are those of the prior density.
  bool slip_determined = true;
};

/// Simulated closed-loop insertions with one controller model: distance from the true tip to the target where the
/// needle stops, over the insertions that arrive; NaN if none arrives.
struct SteeredFigures {
  std::size_t arrived = 0;   ///< number of insertions that reach the depth of their target
  double median_mm = 0,      ///< median distance, mm; of an even count the upper of the middle two
      worst_mm = 0;          ///< largest distance, mm
  std::string stopped_by{};  ///< most frequent reason of the insertions that do not arrive; "": all arrive
  /// The insertions that ended before the depth of their target, counted by reason.
  struct Stopped {
    std::string reason;             ///< an unhealthy estimate with the quantity: "needle state unhealthy, age of ..."
    std::size_t count = 0;          ///< number of insertions
    std::array<double, 2> value{};  ///< least and largest of the quantity
    double limit = 0;               ///< largest allowed; 0: the reason has none
    std::string unit;               ///< unit of value and limit
    std::array<double, 2> depth_mm{};  ///< least and largest z of the true tip, mm
  };
  std::vector<Stopped> stopped{};  ///< most frequent reason first
};
/// Mean difference of the distances from tip to target, over the targets at which both models arrive.
struct PairedMiss {
  std::size_t targets = 0;  ///< number of targets
  double farther_mm = 0;    ///< adopted model minus model file, mm; negative if the adopted model ends nearer
  double std_error_mm = 0;  ///< standard error of the mean, mm
};
/// Comparison of two controller models that steer to identical targets; the plant matches the adopted model and has
/// the recordings' noise.
struct SteeredToTargets {
  std::size_t targets = 0;                    ///< number of targets
  std::uint64_t seed = 0;                     ///< seed of the random numbers
  std::array<double, 2> depth_mm{};           ///< least and largest depth of the targets along z, mm
  SteeredFigures as_it_stands{},              ///< with the model file
      found{};                                ///< with the adopted model
  PairedMiss paired{};                        ///< difference of the two
  std::vector<std::string> not_known_live{};  ///< effects whose parameters are unknown before an insertion
};

/// One recording against time, for figures. All positions in {A}, mm.
struct Trace {
  std::string log;                                ///< name of the recording
  std::vector<double> time_s;                     ///< one per measurement, s
  std::vector<model::Covariates> covariates;      ///< one per measurement
  std::vector<Eigen::Vector3d> measured_mm,       ///< measured tip; NaN where a measurement has no position
      model_file_mm,                              ///< prediction by the model file
      before_mm,                                  ///< prediction by the refitted nominal model
      after_mm;                                   ///< prediction by the adopted model
  std::vector<char> outlier;                      ///< 1: classified as an outlier
  std::vector<std::vector<double>> white_before,  ///< whitened residuals per channel, refitted nominal model; NaN: none
      white_after;                                ///< whitened residuals per channel, adopted model; NaN: none
};

/// Goodness of fit of the adopted model. The values are printed for information; no verdict depends on them.
struct Checks {
  double chi2_per_dof = 0;       ///< chi2 per degree of freedom
  std::array<double, 2> band{};  ///< 99 % band of chi2_per_dof for a correct model and the estimated noise
  double ljung_box_p = 1;        ///< smallest p-value over the series, multiplied by their number
  bool clean = true;             ///< whether both values are within what chance gives in 99 of 100 cases
};

/// Duration of one stage of the diagnosis.
struct StageTime {
  std::string stage;   ///< name of the stage
  double seconds = 0;  ///< duration, s
};

/// All results of a diagnosis.
struct Findings {
  Verdict verdict = Verdict::nothing_missing;  ///< the conclusion
  bool two_groups = false;  ///< whether the results describe the change from the first to the second group
  double stop_s = 0;        ///< recordings without time stamps: nominal interval between stops, s; otherwise 0
  std::string sentence;     ///< the conclusion in one sentence
  double probability = 0;   ///< of the verdict, if one of the fitted models is true; inconclusive: 0
  /// Why likely effects are not named, one sentence each; inconclusive: why nothing is concluded.
  std::vector<std::string> reasons{};
  std::vector<FoundEffect> effects;          ///< effects of the adopted model
  std::vector<Explanation> explanations;     ///< candidate models, the likeliest first
  double nothing_probability = 0;            ///< posterior probability of no effect and no discrepancy of consequence
  double discrepancy_probability = 0;        ///< posterior probability of a discrepancy of consequence
  double discrepancy_sigmas = 0;             ///< visible size of all discrepancy terms in the adopted model, sigma
  double not_visited = 0;                    ///< posterior share of candidate models evaluated by linearisation alone
  std::vector<Location> where;               ///< onsets of the missing physics, the largest share first
  inference::Noise noise;                    ///< estimated measurement noise
  std::vector<std::string> channels,         ///< names of the channels, in the order of noise.sigma
      units;                                 ///< units of the channels, in the order of noise.sigma
  std::vector<ScatterNearEntry> scatter{};   ///< per channel; noise is the noise at large depth
  std::vector<VariationEstimate> variation;  ///< between-insertion standard deviations
  std::vector<InsertionValues> insertions;   ///< insertion-specific parameters, in the order of the recordings
  HeldOut held_out;                          ///< cross-validation
  NeedleEstimate base,                       ///< estimate in the nominal model
      needle;                                ///< estimate in the adopted model
  model::NeedleParameters model_file;        ///< parameters of the model file
  std::vector<TriedEffect> tried;            ///< effects added to the nominal model, best first
  std::vector<TriedEffect> beside;           ///< effects added to the adopted model, best first
  std::vector<DetectableSize> detectable;    ///< smallest detectable sizes
  std::vector<Discrepancy> discrepancies;    ///< discrepancy terms; Verdict::unknown_effect only
  std::vector<ProposedForm> proposals;       ///< proposals for each discrepancy in turn, the likeliest first
  std::optional<NextExperiment> next_experiment;  ///< null: none is needed, or no available motion is informative
  std::optional<SteeredToTargets> steered;        ///< filled by callers with a controller; diagnose() leaves it empty
  std::string not_steered;                   ///< clause: why steered is empty although a finding may affect steering
  std::vector<std::string> confusion_names;  ///< names of the rows and columns of confusion
  Eigen::MatrixXd confusion;                 ///< absolute cosine between the projected signatures of two effects
  Checks checks;                             ///< goodness of fit
  std::vector<std::string> remarks;          ///< sentences: unusable input and effects that cannot be separated
  std::vector<Trace> traces;                 ///< one per recording
  std::size_t readings = 0,                  ///< number of measurement messages
      outliers = 0;                          ///< number of messages classified as outliers
  std::vector<StageTime> times;              ///< duration of each stage
};

/// Probability of a verdict from which no further experiment is recommended.
inline constexpr double kNoDoubt = 0.99;
/// Returns whether a further experiment is recommended.
/// @param findings result of a diagnosis
/// @return true for an inconclusive verdict or one with a probability below kNoDoubt
inline bool is_experiment_needed(const Findings& findings) {
  return findings.verdict == Verdict::inconclusive || findings.probability < kNoDoubt;
}

}  // namespace bevel::diagnosis
