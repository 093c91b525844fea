#pragma once
// What the mismatch tool found, as plain data: verdict.json, report.html and model.toml are made from this alone.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/mismatch/noise.hpp"

namespace bevel::diagnosis {

enum class Verdict { nothing_missing, effects_found, unknown_effect };
std::string_view name_of(Verdict verdict);  // "nothing-missing", ...

struct FoundParameter {
  std::string name;
  double value = 0;
  double std_error = 0;
  std::array<double, 2> ci95{};  // profile likelihood; an instant's: where it may as well have been
  bool at_bound = false;
};

// Instants and phases: one entry per recording that has the effect.
struct FoundInRecording {
  std::string log;
  std::vector<FoundParameter> parameters;
};

struct FoundEffect {
  std::string name;
  std::string meaning;  // one clause
  double probability = 0;
  std::vector<std::string> ambiguous_with;
  std::vector<FoundParameter> parameters;
  std::vector<FoundInRecording> recordings;
  double gain = 0;            // fall of chi2 when it is the last to enter
  double threshold = 0;       // what chance brings, anywhere in the library, in 1 of 100
  double visible_sigmas = 0;  // of the part that the needle's own parameters cannot absorb
};

// Where the model in use (its needle refitted) goes wrong most.
struct Location {
  std::string log;
  std::string channel;
  double from_s = 0, to_s = 0;
  std::string covariate;
  std::array<double, 2> range{};
  double share = 0;  // of the whole mismatch, in chi2
};

struct FitFigures {
  double rmse_mm = 0, max_mm = 0, chi2_per_dof = 0;  // per scalar reading
};
struct HeldOutRecording {
  std::string log;
  FitFigures before, after;
};
struct HeldOut {
  FitFigures before, after;  // leave one recording out: needle refitted, without and with what was found
  std::vector<HeldOutRecording> recordings;
  double gain = 0;  // fall of held-out chi2
};

// One line of the ranking: an effect tried alone (or beside what was found).
struct TriedEffect {
  std::string name;
  std::string beside;  // "" = alone
  double gain = 0, chance = 0, threshold = 0, evidence = 0;
  std::vector<std::pair<std::string, double>> parameters;
  bool passes = false;
};

// The smallest size that these recordings would have shown.
struct DetectableSize {
  std::string effect, parameter;
  double size = 0;         // against "none"; infinite: cannot be shown at all
  double typical = 0;      // what the field reports, for comparison (a start of the fits)
  double absorbed = 0;     // share of its signature that k, lambda1, lambda2 take over
  std::string experiment;  // motion that would show it, if this size is above typical
};

// What remains unexplained, described: which quantity of the motion is off by how much, against what.
struct Correction {
  std::string component;                       // "curvature toward the bevel", ...
  std::string unit;                            // of values
  std::string covariate;                       // "depth_mm", ...
  std::vector<double> at, values, std_errors;  // a broken line
  double gain = 0, threshold = 0;
};

struct NextExperiment {
  std::string script;  // what to command
  std::array<std::string, 2> separates;
  double expected_gain = 0;  // of chi2, in one recording of it
};

struct NeedleEstimate {
  model::NeedleParameters value;
  double curvature_sd_per_mm = 0, lambda1_sd_per_rad = 0, lambda2_sd = 0;
};

// For pictures: one recording against time.
struct Trace {
  std::string log;
  std::vector<double> time_s;  // one per reading
  std::vector<Covariates> covariates;
  std::vector<Eigen::Vector3d> measured_mm, model_file_mm, before_mm, after_mm;
  std::vector<char> outlier;  // 1: taken for one
  // Whitened residuals per channel (NaN where the channel has no reading): of the base refit, and of what was found.
  std::vector<std::vector<double>> white_before, white_after;
};

struct Checks {
  double chi2_per_dof = 0;
  std::array<double, 2> band{};  // 99 % of it if the model is right and the noise as found
  double ljung_box_p = 1;        // smallest over the series, times their number
  double remaining_sigmas = 0;   // slow structure left, in standard deviations of what chance leaves
  double unexplained_share = 0;  // of the mismatch
  bool clean = true;
};

struct StageTime {
  std::string stage;
  double seconds = 0;
};

struct Findings {
  Verdict verdict = Verdict::nothing_missing;
  std::string sentence;  // what was found, in one
  std::vector<FoundEffect> effects;
  std::vector<Location> where;
  Noise noise;
  std::vector<std::string> channels;  // names, in the order of noise.sigma_mm
  HeldOut held_out;
  NeedleEstimate base, needle;  // refitted without, and with what was found
  model::NeedleParameters model_file;
  std::vector<TriedEffect> tried;   // alone, best first
  std::vector<TriedEffect> beside;  // beside what was found, best first
  std::vector<DetectableSize> detectable;
  std::vector<Correction> corrections;  // unknown-effect only
  std::optional<NextExperiment> next_experiment;
  std::vector<std::string> confusion_names;
  Eigen::MatrixXd confusion;  // |cosine| between visible parts
  Checks checks;
  std::vector<std::string> remarks;  // plain sentences: what was not usable, what cannot be told apart
  std::vector<Trace> traces;
  std::size_t readings = 0, outliers = 0;  // messages
  int bootstrap_draws = 0;
  std::uint64_t seed = 0;
  std::vector<StageTime> times;
};

}  // namespace bevel::diagnosis
