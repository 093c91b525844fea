#include "diagnosis/mismatch/location.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::diagnosis {
namespace {

constexpr double kSpanShare = 0.8;  // of a series' fall of chi2 that a located span holds

// White residuals of one recording by channel, in the order of its series.
std::vector<Eigen::VectorXd> white_of(const Evidence& evidence, const Fit& fit, std::size_t r) {
  Workspace workspace;
  std::vector<Eigen::VectorXd> out;
  if (!evaluate(evidence, fit.hypothesis, r, fit.values, false, workspace)) return out;
  Eigen::Index row = 0;
  for (const auto& series : evidence.recorded->recordings[r].series) {
    const auto count = static_cast<Eigen::Index>(series.time_s.size());
    out.emplace_back(workspace.residuals.white.segment(row, count));
    row += count;
  }
  return out;
}

// Shortest run of readings that holds the share of the positive fall.
std::pair<std::size_t, std::size_t> shortest_span(const Eigen::VectorXd& fall) {
  const double wanted = kSpanShare * fall.sum();
  const auto n = static_cast<std::size_t>(fall.size());
  std::pair<std::size_t, std::size_t> best{0, n - 1};
  double sum = 0;
  for (std::size_t from = 0, to = 0; to < n; ++to) {
    sum += fall[static_cast<Eigen::Index>(to)];
    while (from < to && sum - fall[static_cast<Eigen::Index>(from)] >= wanted)
      sum -= fall[static_cast<Eigen::Index>(from++)];
    if (sum >= wanted && to - from < best.second - best.first) best = {from, to};
  }
  return best;
}

struct Begin {
  double depth_mm = -1;  // of an effect that begins at a depth
  double at_s = -1;      // of one that begins at an instant in this recording
};

Begin begin_of(const Fit& after, std::size_t r) {
  Begin begin;
  const auto& set = after.hypothesis.set();
  for (std::size_t m = 0; m < set.size(); ++m)
    for (std::size_t p = 0; p < set[m].effect->parameters().size(); ++p) {
      const auto name = set[m].effect->parameters()[p].name;
      if (name == "depth_mm") begin.depth_mm = after.hypothesis.parameter(after.values, m, p);
      if (name == "at_s") begin.at_s = after.hypothesis.parameter(after.values, m, p, static_cast<int>(r));
    }
  return begin;
}

}  // namespace

std::vector<Location> locate(const Evidence& evidence, const Fit& before, const Fit& after, std::size_t at_most) {
  std::vector<Location> all;
  const auto& set = after.hypothesis.set();
  const auto covariate = set.empty() ? model::Covariate::time_s : set.front().effect->covariate();
  double total = 0;
  for (std::size_t r = 0; r < evidence.recorded->recordings.size(); ++r) {
    const Recording& recording = evidence.recorded->recordings[r];
    const auto white_before = white_of(evidence, before, r);
    const auto white_after = white_of(evidence, after, r);
    const auto covariates = find_covariates(recording.motion);
    const Begin begin = begin_of(after, r);
    Location best;
    double most = 0;
    for (std::size_t c = 0; c < std::min(white_before.size(), white_after.size()); ++c) {
      const Eigen::VectorXd fall = (white_before[c].array().square() - white_after[c].array().square()).matrix();
      const double sum = fall.sum();
      total += sum;
      if (!(sum > most)) continue;
      most = sum;
      const Series& series = recording.series[c];
      const auto [from, to] = shortest_span(fall);
      best.log = recording.name;
      best.channel = evidence.recorded->channels[c].name;
      best.from_s = series.time_s[from];
      best.to_s = series.time_s[to];
      best.covariate = model::name_of(covariate);
      best.share = sum;
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (std::size_t i = from; i <= to; ++i) {
        const double x = covariates[recording.motion.at[series.reading[i]]][covariate];
        low = std::min(low, x), high = std::max(high, x);
      }
      best.range = {low, high};
      if (begin.at_s > 0) best.from_s = begin.at_s;
      if (begin.depth_mm >= 0) {
        best.range = {begin.depth_mm, std::max(begin.depth_mm, covariates.back().depth_mm)};
        for (const auto& at : covariates)
          if (at.depth_mm >= begin.depth_mm) {
            best.from_s = at.time_s;
            break;
          }
      }
      best.to_s = std::max(best.to_s, best.from_s);
    }
    if (most > 0) all.push_back(best);
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.share > b.share; });
  if (all.size() > at_most) all.resize(at_most);
  for (auto& one : all) one.share /= std::max(total, 1e-9);
  return all;
}

std::vector<Trace> make_traces(const Evidence& evidence, const RecordedCase& with_outliers, const Fit& before,
                               const Fit& after, const model::NeedleParameters& model_file) {
  std::vector<Trace> traces;
  model::OpenLoop path;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t r = 0; r < evidence.recorded->recordings.size(); ++r) {
    const Recording& recording = evidence.recorded->recordings[r];
    Trace trace;
    trace.log = recording.name;
    const auto covariates = find_covariates(recording.motion);
    for (const std::size_t node : recording.motion.at) {
      trace.time_s.push_back(recording.motion.nodes[node].time_s);
      trace.covariates.push_back(covariates[node]);
    }
    trace.measured_mm = recording.position_mm;
    const auto predicted = [&](const model::AugmentedNeedle& needle) {
      if (model::predict(needle, recording.motion, path)) return path.position_mm;
      return std::vector<Eigen::Vector3d>(trace.time_s.size(), Eigen::Vector3d::Constant(nan));
    };
    trace.model_file_mm = predicted(model::AugmentedNeedle(model_file));
    trace.before_mm = predicted(before.hypothesis.make_needle(r, before.values, false));
    trace.after_mm = predicted(after.hypothesis.make_needle(r, after.values, false));
    trace.outlier.assign(trace.time_s.size(), 0);
    for (const auto& series : with_outliers.recordings[r].series)
      for (const std::size_t reading : series.reading) trace.outlier[reading] = 1;
    for (const auto& series : recording.series)
      for (const std::size_t reading : series.reading) trace.outlier[reading] = 0;
    for (const Fit* fit : {&before, &after}) {
      auto& out = fit == &before ? trace.white_before : trace.white_after;
      const auto white = white_of(evidence, *fit, r);
      for (std::size_t c = 0; c < white.size(); ++c) {
        out.emplace_back(trace.time_s.size(), nan);
        for (std::size_t i = 0; i < recording.series[c].reading.size(); ++i)
          out.back()[recording.series[c].reading[i]] = white[c][static_cast<Eigen::Index>(i)];
      }
    }
    traces.push_back(std::move(trace));
  }
  return traces;
}

FitFigures figures_of(const Evidence& evidence, const Hypothesis& hypothesis, std::size_t r,
                      const Eigen::VectorXd& values, FitFigures& sum, std::size_t& sum_count) {
  FitFigures out;
  Workspace workspace;
  if (!evaluate(evidence, hypothesis, r, values, false, workspace)) return out;
  const Recording& recording = evidence.recorded->recordings[r];
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t c = 0; c < recording.series.size(); ++c) {
    const Eigen::VectorXd errors_mm =
        errors_of(recording.series[c], evidence.recorded->channels[c], workspace.open_loop);
    if (errors_mm.size() == 0) continue;
    squares += errors_mm.squaredNorm();
    out.max_mm = std::max(out.max_mm, errors_mm.cwiseAbs().maxCoeff());
    count += recording.series[c].reading.size();
  }
  const double chi2 = workspace.residuals.white.squaredNorm();
  const auto n = static_cast<double>(std::max<std::size_t>(count, 1));
  out.rmse_mm = std::sqrt(squares / n);
  out.chi2_per_dof = chi2 / n;
  // `sum` holds sums of squares until its owner divides.
  sum.rmse_mm += squares;
  sum.chi2_per_dof += chi2;
  sum.max_mm = std::max(sum.max_mm, out.max_mm);
  sum_count += count;
  return out;
}

}  // namespace bevel::diagnosis
