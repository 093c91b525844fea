// SPDX-License-Identifier: MIT
#include "mismatch/location.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mismatch/onset.hpp"

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::VectorXd;
using inference::Fit;

namespace {

// White residuals of one recording by channel, in the order of its series.
std::vector<VectorXd> white_of(const ChosenModel& model, std::size_t r) {
  const Fit& fit = *model.fit;
  inference::Residuals residuals;
  if (!fit.likelihood->evaluate(fit.layout, r, fit.shared, fit.local[r], false, residuals, model.curve,
                                fit.curve_values))
    return {};
  return by_channel(fit.likelihood->data().recordings[r], residuals.white);
}

struct Begin {
  double depth_mm = -1;  // of an effect that begins at a depth
  double at_s = -1;      // of one that begins at an instant in this recording
};

Begin begin_of(const NeedleSystem& system, const Fit& fit, std::size_t r) {
  Begin begin;
  const auto& set = fit.layout.set();
  for (std::size_t m = 0; m < set.size(); ++m)
    for (std::size_t p = 0; p < system.effects()[set[m]].parameters.size(); ++p) {
      const int shared = fit.layout.find_shared(m, p), local = fit.layout.find_local(m, p);
      const model::Begins begins = system.parameter(set[m], p).begins;
      if (begins == model::Begins::depth && shared >= 0) begin.depth_mm = fit.shared[shared];
      if (begins == model::Begins::instant && local >= 0) begin.at_s = fit.local[r][local];
    }
  return begin;
}

// At every node; where the tip is, at those of which there is a reading.
std::vector<model::Covariates> covariates_of(const Recording& recording) {
  auto all = model::find_covariates(recording.motion.nodes);
  for (std::size_t i = 0; i < recording.motion.at.size(); ++i) {
    model::Covariates& at = all[recording.motion.at[i]];
    for (const model::Covariate covariate : model::all_covariates())
      if (const auto along = model::tip_direction(covariate))
        at[covariate] = model::place_along(*along, recording.position_mm[i]);
  }
  return all;
}

model::Covariate covariate_of(const NeedleSystem& system, const Fit& fit) {
  if (!fit.layout.set().empty()) return system.physics(fit.layout.set().front()).covariate();
  if (!fit.scales.curves.empty())  // of the likeliest, if there are several
    return system.needle_curve(fit.scales.curves.front().curve).covariate;
  return model::Covariate::time_s;
}

}  // namespace

std::vector<Location> locate(const NeedleSystem& system, const ChosenModel& before, const ChosenModel& after,
                             std::size_t at_most) {
  std::vector<Location> all;
  const auto covariate = covariate_of(system, *after.fit);
  double total = 0;
  for (std::size_t r = 0; r < system.recorded().recordings.size(); ++r) {
    const Recording& recording = system.recorded().recordings[r];
    if (system.recorded().two_groups() && !recording.changed) continue;
    const auto white_before = white_of(before, r);
    const auto white_after = white_of(after, r);
    const auto covariates = covariates_of(recording);
    const Begin begin = begin_of(system, *after.fit, r);
    Location best;
    double most = 0;
    for (std::size_t c = 0; c < std::min(white_before.size(), white_after.size()); ++c) {
      const VectorXd fall = (white_before[c].array().square() - white_after[c].array().square()).matrix();
      const double sum = fall.sum();
      total += std::max(sum, 0.0);
      if (!(sum > most)) continue;
      most = sum;
      best.log = recording.name;
      best.channel = system.recorded().channels[c].name;
      best.share = sum;
    }
    const auto onset = most > 0 ? onset_of(system, after, r) : std::nullopt;
    if (!onset) continue;
    best.covariate = model::name_of(covariate);
    best.from_s = onset->from_s;
    if (begin.at_s > 0) best.from_s = begin.at_s;
    if (begin.depth_mm >= 0)
      for (const auto& at : covariates)
        if (at[model::Covariate::depth_mm] >= begin.depth_mm) {
          best.from_s = at[model::Covariate::time_s];
          break;
        }
    best.to_s = std::max(onset->to_s, best.from_s);
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto& at : covariates)
      if (at[model::Covariate::time_s] >= best.from_s && at[model::Covariate::time_s] <= best.to_s)
        low = std::min(low, at[covariate]), high = std::max(high, at[covariate]);
    best.range = low <= high ? std::array{low, high} : std::array{0.0, 0.0};  // no measurement gives the tip's place
    all.push_back(best);
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.share > b.share; });
  if (all.size() > at_most) all.resize(at_most);
  for (auto& one : all) one.share /= std::max(total, 1e-9);
  return all;
}

std::vector<Trace> make_traces(const NeedleSystem& system, const inference::Readings& outliers,
                               const ChosenModel& before, const ChosenModel& after,
                               const model::NeedleParameters& model_file) {
  std::vector<Trace> traces;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t r = 0; r < system.recorded().recordings.size(); ++r) {
    const Recording& recording = system.recorded().recordings[r];
    Trace trace;
    trace.log = recording.name;
    const auto covariates = covariates_of(recording);
    for (const std::size_t node : recording.motion.at) {
      trace.time_s.push_back(recording.motion.nodes[node].time_s);
      trace.covariates.push_back(covariates[node]);
    }
    trace.measured_mm = recording.position_mm;
    const std::vector<Eigen::Vector3d> nowhere(trace.time_s.size(), Eigen::Vector3d::Constant(nan));
    trace.model_file_mm = nowhere;
    model::OpenLoop path;
    if (model::predict(model::AugmentedNeedle(model_file, system.known(static_cast<int>(r))), recording.motion, path))
      trace.model_file_mm = path.position_mm;
    const auto predicted = [&](const ChosenModel& model) {
      const Fit& fit = *model.fit;
      model::OpenLoop out;
      if (!system.tip_path(fit.layout.set(), recording.motion, static_cast<int>(r), fit.shared, fit.local[r],
                           model.discrepancy, out))
        out.position_mm = nowhere;
      return out.position_mm;
    };
    trace.before_mm = predicted(before);
    trace.after_mm = predicted(after);
    trace.outlier.assign(trace.time_s.size(), 0);
    for (const std::size_t reading : outliers[r]) trace.outlier[reading] = 1;
    for (const ChosenModel* model : {&before, &after}) {
      auto& out = model == &before ? trace.white_before : trace.white_after;
      const auto white = white_of(*model, r);
      for (std::size_t c = 0; c < white.size(); ++c) {
        const auto& message = model->fit->likelihood->data().recordings[r].series[c].message;
        out.emplace_back(trace.time_s.size(), nan);
        for (std::size_t i = 0; i < message.size(); ++i) out.back()[message[i]] = white[c][static_cast<Index>(i)];
      }
    }
    traces.push_back(std::move(trace));
  }
  return traces;
}

}  // namespace bevel::diagnosis
