#include "diagnosis/mismatch/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::VectorXd;
using inference::Fit;
using inference::Likelihood;

namespace {

// Sums over readings of one recording.
struct Sums {
  double squares = 0, largest = 0, positions = 0;  // of positions, mm
  double chi2 = 0, log_density = 0, count = 0;
};

FitFigures figures_of(const std::vector<Sums>& all) {
  FitFigures out;
  Sums sum;
  for (const Sums& one : all) {
    sum.squares += one.squares, sum.positions += one.positions;
    sum.chi2 += one.chi2, sum.log_density += one.log_density, sum.count += one.count;
    out.max_mm = std::max(out.max_mm, one.largest);
  }
  const double n = std::max(sum.count, 1.0), positions = std::max(sum.positions, 1.0);
  out.rmse_mm = std::sqrt(sum.squares / positions);
  out.chi2_per_dof = sum.chi2 / n;
  out.log_density = sum.log_density / n;
  if (all.size() < 2) return out;
  // From recording to recording, weighed by their readings: of the mean square, and of the mean logarithm.
  double square = 0, log = 0;
  for (const Sums& one : all) {
    square += std::pow(one.squares - one.positions * sum.squares / positions, 2);
    log += std::pow(one.log_density - one.count * out.log_density, 2);
  }
  const auto r = static_cast<double>(all.size());
  const double error = std::sqrt(square * r / (r - 1)) / positions;
  out.rmse_se_mm = out.rmse_mm > 0 ? error / (2 * out.rmse_mm) : 0;
  out.log_density_se = std::sqrt(log * r / (r - 1)) / n;
  return out;
}

double constant_of(double count) { return -0.5 * count * std::log(2 * std::numbers::pi); }

void add_errors(const NeedleSystem& system, const Likelihood& likelihood, std::size_t r, const VectorXd& errors,
                Sums& sums) {
  sums.count = static_cast<double>(errors.size());
  const auto by_channel = inference::by_channel(likelihood.data().recordings[r], errors);
  for (std::size_t c = 0; c < by_channel.size(); ++c) {
    if (system.recorded().channels[c].heading || by_channel[c].size() == 0) continue;
    sums.squares += by_channel[c].squaredNorm();
    sums.largest = std::max(sums.largest, by_channel[c].cwiseAbs().maxCoeff());
    sums.positions += static_cast<double>(by_channel[c].size());
  }
}

// As a new insertion: what differs between insertions at its mean. Phases and instants are the recording's own: nobody
// predicts them.
VectorXd new_insertion(const Fit& fit, std::size_t r) {
  VectorXd local = fit.local[r];
  for (std::size_t i = 0; i < fit.layout.local().size(); ++i)
    if (!fit.layout.is_scanned(i)) local[static_cast<Index>(i)] = 0;
  return local;
}

// Refitted without the recording: where much is missing, the linear model about all of them says little of it.
Fit refit_without(const inference::Search& search, const Fit& whole, std::size_t r) {
  const Likelihood& all = *whole.likelihood;
  inference::Readings without = all.outliers();
  without[r].resize(all.system().data().recordings[r].messages);
  std::iota(without[r].begin(), without[r].end(), std::size_t{0});
  const Likelihood others(all.system(), without, all.noise());
  const auto curve =
      whole.scales.curve ? search.discrepancy().columns(others, *whole.scales.curve) : inference::CurveColumns{};
  Fit out = inference::fit(others, whole.layout, whole.shared, whole.local, whole.scales, curve);
  if (!out.valid) out = whole;
  out.local[r] = whole.local[r];
  return out;
}

// judge: by whose noise and variation chi2 and density are.
Sums sums_of(const NeedleSystem& system, const inference::Search& search, const Fit& whole, const Fit& judge,
             std::size_t r) {
  Sums out;
  Fit fit = refit_without(search, whole, r);
  fit.likelihood = judge.likelihood;
  fit.scales.nuisance_sd = judge.scales.nuisance_sd;
  const auto curve = curve_of(search, fit);
  VectorXd errors = fit.likelihood->errors(fit.layout, r, fit.shared, new_insertion(fit, r));
  const auto blocks = linearise(*fit.likelihood, fit, curve);
  if (errors.size() == 0 || blocks.empty()) return out;
  if (curve) errors -= curve.raw[r] * fit.curve_values;
  add_errors(system, *fit.likelihood, r, errors, out);
  const auto predictive = predictive_of(fit, blocks, curve, r);
  out.chi2 = predictive.chi2;
  out.log_density = predictive.log_density + constant_of(out.count);
  return out;
}

// By the model file as it is: nothing is refitted, and it knows of no variation.
Sums as_it_stands(const NeedleSystem& system, const Likelihood& likelihood, std::size_t r) {
  Sums out;
  const inference::Layout nothing(system, {});
  const VectorXd shared = nothing.shared_start(), local = nothing.local_start();
  inference::Residuals residuals;
  if (!likelihood.evaluate(nothing, r, shared, local, false, residuals)) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    return {.squares = none, .largest = none, .positions = 1, .chi2 = none, .log_density = none, .count = 1};
  }
  add_errors(system, likelihood, r, likelihood.errors(nothing, r, shared, local), out);
  out.chi2 = residuals.white.squaredNorm();
  out.log_density = constant_of(out.count) + likelihood.log_weights(r) - 0.5 * out.chi2;
  return out;
}

// Of errors that are the noise and nothing else, in the mean.
Sums noise_floor(const NeedleSystem& system, const Likelihood& likelihood, std::size_t r) {
  Sums out;
  const auto& series = likelihood.data().recordings[r].series;
  for (std::size_t c = 0; c < series.size(); ++c)
    for (const double relative : series[c].relative_sd) {
      ++out.count;
      if (system.recorded().channels[c].heading) continue;
      out.squares += std::pow(likelihood.noise().sigma[c] * relative, 2);
      ++out.positions;
    }
  out.chi2 = out.count;
  out.log_density = constant_of(out.count) + likelihood.log_weights(r) - 0.5 * out.count;
  return out;
}

}  // namespace

HeldOut hold_out(const NeedleSystem& system, const inference::Search& search, const Fit& judge) {
  HeldOut out;
  const Likelihood& likelihood = *judge.likelihood;
  const Fit& base = search.visited().at({}).at->fit;
  const auto selected = leave_out_selection(search);
  std::vector<Sums> file, before, after, floor;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    const Recording& recording = system.recorded().recordings[r];
    if (system.recorded().two_groups() && !recording.changed) continue;
    file.push_back(as_it_stands(system, likelihood, r));
    before.push_back(sums_of(system, search, base, judge, r));
    after.push_back(sums_of(system, search, *selected[r].fit, *selected[r].fit, r));
    after.back().log_density = selected[r].log_density + constant_of(after.back().count);
    floor.push_back(noise_floor(system, likelihood, r));
    out.recordings.push_back(
        {.log = recording.name, .before = figures_of({before.back()}), .after = figures_of({after.back()})});
    out.gain += after.back().log_density - before.back().log_density;
  }
  out.as_it_stands = figures_of(file);
  out.before = figures_of(before);
  out.after = figures_of(after);
  out.noise_floor = figures_of(floor);
  return out;
}

}  // namespace bevel::diagnosis
