// SPDX-License-Identifier: MIT
#include "tests/diagnosis/made_up_findings.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <bevel/diagnosis/needle/recorded_case.hpp>
#include "tests/diagnosis/recorded_logs.hpp"

namespace bevel::diagnosis::testing {
namespace {

using model::testing::active;
using model::testing::path_of;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kSigma_mm = 0.15;

Trace trace_of(int recording, const model::NeedleParameters& needle, const std::vector<model::ActiveEffect>& effects,
               bool explained, std::mt19937_64& random) {
  const model::Motion motion = script_of(recording).recorded();
  Trace trace;
  trace.log = "rec0" + std::to_string(recording + 1) + ".lcm";
  const auto covariates = model::find_covariates(motion.nodes);
  for (const std::size_t i : motion.at) {
    trace.covariates.push_back(covariates[i]);
    trace.time_s.push_back(covariates[i][model::Covariate::time_s]);
  }
  const auto truth = path_of(needle, effects, motion);
  trace.before_mm = path_of(needle, {}, motion);
  trace.after_mm = explained ? truth : trace.before_mm;
  auto given = needle;
  given.curvature_per_mm *= 0.8;
  trace.model_file_mm = path_of(given, {}, motion);
  trace.white_before.assign(3, {});
  trace.white_after.assign(3, {});
  std::normal_distribution<double> normal;
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    error = 0.6 * error + 0.8 * kSigma_mm * Eigen::Vector3d(normal(random), normal(random), normal(random));
    const bool outlier = random() % 60 == 0;
    trace.measured_mm.push_back(truth[i] + (outlier ? 20.0 : 1.0) * error);
    trace.outlier.push_back(outlier ? 1 : 0);
    for (int c = 0; c < 3; ++c) {
      const auto channel = static_cast<std::size_t>(c);
      const bool missing = i % 50 == 7;
      trace.white_before[channel].push_back(missing ? kNone
                                                    : (trace.measured_mm[i][c] - trace.before_mm[i][c]) / kSigma_mm);
      trace.white_after[channel].push_back(missing ? kNone
                                                   : (trace.measured_mm[i][c] - trace.after_mm[i][c]) / kSigma_mm);
    }
  }
  return trace;
}

std::vector<model::ActiveEffect> truth_of(Verdict verdict) {
  if (!adopts_a_model(verdict)) return {};
  if (verdict == Verdict::effects_found)
    return {active("torsional_windup", {0.82}), active("lost_steps", {1.39, 0, 3.3})};
  return {active("torsional_windup", {0.82}), active("lateral_bias", {0.0009, -0.0006})};
}

FoundEffect windup() {
  FoundEffect effect;
  effect.name = "torsional_windup";
  effect.meaning = "friction on the inserted shaft holds its tip back when the base turns";
  effect.probability = 0.971;
  effect.ambiguous_with = {"rotation_backlash"};
  effect.parameters = {{"lag_at_100mm_rad", 0.8234, 0.031, {0.763, 0.889}, false}};
  effect.log_bayes_factor = 148;
  effect.visible_sigmas = 17;
  effect.moved_at_depth_mm = 1.83;
  return effect;
}

FoundEffect lost_steps() {
  FoundEffect effect;
  effect.name = "lost_steps";
  effect.meaning = "the motor lost steps that its encoder did not see";
  effect.probability = 0.99994;
  effect.parameters = {{"rotation_rad", 1.394, 0.022, {1.351, 1.437}, false}};
  effect.recordings = {{"rec03.lcm", {{"at_s", 3.309, 0.02, {3.27, 3.35}, false}}},
                       {"rec04.lcm", {{"at_s", 2.411, 0.03, {2.36, 2.47}, false}}}};
  effect.log_bayes_factor = 1080;
  effect.visible_sigmas = 47;
  effect.moved_at_depth_mm = kNone;
  return effect;
}

FitFigures figures(double rmse_mm, double max_mm, double chi2_per_dof) {
  return {.rmse_mm = rmse_mm,
          .rmse_se_mm = 0.1 * rmse_mm,
          .max_mm = max_mm,
          .chi2_per_dof = chi2_per_dof,
          .log_density = -rmse_mm,
          .log_density_se = 0.03};
}

InsertionPredicted predicted(double rmse_mm, double share) {
  const auto figures = [&](double scale, std::size_t readings) {
    return PredictionFigures{.rmse_mm = scale * rmse_mm,
                             .log_density = -scale,
                             .share_in_95 = share,
                             .channels = {{scale * rmse_mm, share}, {0.9 * scale * rmse_mm, share}, {kNone, kNone}},
                             .readings = readings};
  };
  return {.whole = figures(1, 900), .beyond = figures(1.2, 600), .continued = figures(0.4, 600)};
}

void add_insertions(Findings& findings) {
  for (std::size_t i = 0; i < findings.traces.size(); ++i) {
    const double off = std::sin(static_cast<double>(3 * i));
    InsertionValues one{.log = findings.traces[i].log, .values = {}};
    const auto add = [&](const char* name, const char* group, double size) {
      const double value = size * off, sd = 0.4 * size;
      one.values.push_back({.name = name,
                            .group = group,
                            .value = value,
                            .std_error = sd,
                            .ci95 = {value - 1.96 * sd, value + 1.96 * sd}});
    };
    add("curvature_relative", "curvature", 0.05);
    for (const char* name : {"tilt_x_rad", "tilt_y_rad"}) add(name, "entry_angle", 0.003);
    add("roll_rad", "roll", 0.02);
    for (const char* name : {"entry_x_mm", "entry_y_mm"}) add(name, "entry_point", 0.1);
    findings.insertions.push_back(std::move(one));
  }
}

void add_ranking(Findings& findings) {
  double factor = !adopts_a_model(findings.verdict) ? 1.2 : 2112.7;
  for (const model::Effect* effect : model::all_effects()) {
    TriedEffect tried;
    tried.name = effect->name();
    tried.log_bayes_factor = factor;
    tried.fitted = factor > -0.05;
    for (const auto& p : effect->parameters()) tried.parameters.emplace_back(p.name, 0.5 * (p.lower + p.upper));
    tried.likelier = factor > 5;
    findings.tried.push_back(tried);
    tried.beside = "torsional_windup + lost_steps";
    tried.log_bayes_factor = std::min(factor, 2.0);
    tried.likelier = false;
    if (!findings.effects.empty()) findings.beside.push_back(tried);
    factor = 0.62 * factor - 0.1;
  }
}

void add_reach(Findings& findings) {
  const auto& all = model::all_effects();
  findings.confusion =
      Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(all.size()), static_cast<Eigen::Index>(all.size()));
  for (std::size_t i = 0; i < all.size(); ++i) {
    findings.confusion_names.emplace_back(all[i]->name());
    for (std::size_t k = 0; k < i; ++k) {
      const double cosine = std::abs(std::sin(1.7 * static_cast<double>(i * k + i)));
      const auto row = static_cast<Eigen::Index>(i);
      const auto column = static_cast<Eigen::Index>(k);
      findings.confusion(row, column) = findings.confusion(column, row) = k == 3 ? kNone : cosine;
    }
    for (const auto& p : all[i]->parameters()) {
      if (p.scope == model::Scope::recording || std::isnan(p.none)) continue;
      DetectableSize size;
      size.effect = all[i]->name();
      size.parameter = p.name;
      size.typical = p.starts.empty() ? 1 : p.starts.front();
      const bool hidden = all[i]->name() == "layer";
      size.size = hidden ? std::numeric_limits<double>::infinity() : std::abs(size.typical) * 0.137;
      size.absorbed = hidden ? 1 : 0.04 * static_cast<double>(i);
      if (hidden) size.experiment = "insert 60 mm at 5 mm/s, hold 20 s, insert 40 mm at 20 mm/s";
      findings.detectable.push_back(size);
    }
  }
}

}  // namespace

Findings made_up(Verdict verdict) {
  Findings f;
  f.verdict = verdict;
  std::mt19937_64 random(7);
  const auto needle = model::testing::agar();
  f.model_file = f.base.value = f.needle.value = needle;
  f.model_file.curvature_per_mm *= 0.8;
  for (NeedleEstimate* n : {&f.base, &f.needle}) {
    n->curvature_sd_per_mm = 0.000021;
    n->lambda1_sd_per_rad = 0.013;
    n->lambda2_sd = 0.008;
  }
  f.channels = {"tip.x", "tip.y", "tip.z"};
  f.units = {"mm", "mm", "mm"};
  f.noise = {.sigma = {0.151, 0.149, 0.26}, .ar1 = 0.6, .ar2 = -0.1, .outlier_share = 0.0167, .frame_s = 1.0 / 30};
  const auto truth = truth_of(verdict);
  const bool explained = verdict == Verdict::effects_found;
  for (int i = 0; i < 8; ++i) {
    f.traces.push_back(trace_of(i, needle, truth, explained, random));
    f.readings += f.traces.back().time_s.size();
    const double before = !adopts_a_model(verdict) ? 0.2 : 0.7 + 0.21 * i;
    const double after = explained ? 0.2 + 0.01 * i : before * 0.8;
    f.held_out.recordings.push_back({f.traces.back().log, figures(before, 3 * before, before * before / 0.04),
                                     figures(after, 3 * after, after * after / 0.04), predicted(before, 0.6),
                                     predicted(after, 0.951)});
  }
  f.outliers = 41;
  f.held_out.as_it_stands = figures(1.93, 6.1, 44);
  f.held_out.before = figures(1.21, 3.42, 15.2);
  f.held_out.after = figures(0.264, 0.91, 1.012);
  f.held_out.noise_floor = figures(0.201, 0, 1);
  f.held_out.predicted_before = predicted(1.21, 0.612);
  f.held_out.predicted_after = predicted(0.264, 0.951);
  add_insertions(f);
  f.variation = {{"curvature", "relative", 0.05, 0.02, 0.02, 0.12}, {"entry_angle", "rad", 0.003, 0.6, 0, 0.007}};
  f.explanations = {{{"torsional_windup", "lost_steps (rotation)"}, 0.93, 0.04}, {{"rotation_backlash"}, 0.05, 0.01}};
  f.nothing_probability = 0.001;
  f.held_out.gain = 5321;
  f.checks = {1.004, {0.965, 1.036}, 0.41, true};
  f.sentence =
      "The tip lags behind the base when it turns, by more the deeper the needle, and rotation steps were lost.";
  f.effects = {windup(), lost_steps()};
  f.steered = {.targets = 8,
               .seed = 20'260'102,
               .depth_mm = {55.8, 62},
               .as_it_stands = {.arrived = 7,
                                .median_mm = 1.94,
                                .worst_mm = 3.1,
                                .stopped_by = "workspace",
                                .stopped = {{"workspace", 1, {61, 61}, 60, "mm", {58.2, 58.2}}}},
               .found = {.arrived = 8, .median_mm = 0.052, .worst_mm = 0.11},
               .paired = {.targets = 7, .farther_mm = -1.9, .std_error_mm = 0.3},
               .not_known_live = {"lost_steps"}};
  f.where = {{"rec03.lcm", "tip.y", 3.1, 5.0, "depth_mm", {30, 52}, 0.42},
             {"rec07.lcm", "tip.x", 7.1, 8.3, "since_reversal_mm", {2, 9}, 0.13},
             {"rec05.lcm", "tip.y", 9.0, 10.4, "depth_mm", {52, 60}, 0.08}};
  f.next_experiment = {"insert 10 mm at 10 mm/s\nthen 6 times: turn +2 rad, -2 rad; insert 10 mm",
                       {"torsional_windup", "rotation_backlash"},
                       38.4};
  if (!adopts_a_model(verdict)) {
    f.sentence = "These recordings show no missing physics.";
    f.probability = 0.995;
    f.effects.clear();
    f.steered.reset();
    f.where.clear();
    f.next_experiment.reset();
    f.held_out.before = f.held_out.after = figures(0.249, 0.88, 1.008);
  }
  if (verdict == Verdict::inconclusive) {
    f.sentence = "The recordings do not decide: 32 % of the probability is in candidate models that were not fitted.";
    f.probability = 0;
    f.reasons = {"32 % of the probability is in candidate models that were not fitted"};
  }
  if (verdict == Verdict::unknown_effect) {
    f.sentence = "Something is missing that no listed effect explains: the curvature depends on time.";
    f.effects.pop_back();
    f.steered.reset();
    f.not_steered = "the recordings have no clock";
    f.held_out.after = figures(0.82, 2.71, 9.4);
    f.checks = {7.4, {0.965, 1.036}, 1e-14, false};
    f.discrepancies = {{.curve = {.component = model::DiscrepancyComponent::curvature_bevel,
                                  .covariate = model::Covariate::time_s,
                                  .at = {0, 2, 4, 6, 8, 10, 12},
                                  .values = {0, 1e-4, 3e-4, 4e-4, 6e-4, 8e-4, 9e-4},
                                  .std_errors = {4e-5, 3e-5, 3e-5, 3e-5, 4e-5, 6e-5, 9e-5}},
                        .log_bayes_factor = 1150,
                        .visible_size = 3.1,
                        .moved_at_depth_mm = 0.74}};
  }
  if (verdict == Verdict::unknown_effect)
    f.proposals = {{.component = model::DiscrepancyComponent::curvature_bevel,
                    .covariate = model::Covariate::time_s,
                    .form = inference::Form::saturation,
                    .equation = "a (1 - exp(-(x - 0) / s))",
                    .amplitude = 0.00113,
                    .amplitude_sd = 0.00006,
                    .shape = 7.1,
                    .shape_low = 6.2,
                    .shape_high = 8.3,
                    .log_bayes_factor = 4.2,
                    .low = 0,
                    .range = 12,
                    .shapes = {1.2, 1.68, 2.4, 3.36, 4.8, 6.72, 9.6}}};
  add_ranking(f);
  add_reach(f);
  f.remarks = {"rec05.lcm: damaged (log: 1 region, 120 bytes skipped); what is left of it was used.",
               "camera_rotation and entry_angle leave the same mark in these recordings."};
  f.times = {
      {"reading the logs", 0.05}, {"noise", 1.31}, {"comparing sets of effects", 4.2}, {"intervals and rivals", 0.7}};
  return f;
}

}  // namespace bevel::diagnosis::testing
