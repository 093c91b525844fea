#include "diagnosis/mismatch/gates.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/mismatch/freedom.hpp"
#include "diagnosis/mismatch/local_unknowns.hpp"
#include "diagnosis/mismatch/parallel.hpp"
#include "diagnosis/statistics/ljung_box.hpp"

namespace bevel::diagnosis {
namespace {
constexpr int kLags = 12;                // at most, and a third of the readings
constexpr double kBandQuantile = 2.576;  // 99 %
}  // namespace

double HeldOutFit::total() const { return std::accumulate(chi2.begin(), chi2.end(), 0.0); }

HeldOutFit leave_one_out(const Evidence& evidence, const Fit& whole, int threads) {
  const std::size_t recordings = evidence.recorded->recordings.size();
  HeldOutFit out;
  out.values.resize(recordings);
  out.chi2.resize(recordings);
  out.count.resize(recordings);
  const Hypothesis& hypothesis = whole.hypothesis;
  // What the others do not tell of a curve, because only the one held out goes so deep or lasts so long, is as smooth
  // and as large as the rest of it.
  const FitRules smooth{.precision = precision_of_curves(whole)};
  parallel_for(recordings, threads, [&](std::size_t r) {
    Evidence others = evidence;
    others.used.assign(recordings, true);
    others.used[r] = false;
    const Fit without = fit(others, hypothesis, whole.values, smooth);
    // Its own phase or instant, all else held.
    Evidence alone = evidence;
    alone.used.assign(recordings, false);
    alone.used[r] = true;
    FitRules rules;
    bool local = false;
    for (std::size_t i = 0; i < hypothesis.unknowns().size(); ++i) {
      if (hypothesis.unknowns()[i].recording == static_cast<int>(r))
        local = true;
      else
        rules.held.push_back(static_cast<int>(i));
    }
    Eigen::VectorXd values = without.valid ? without.values : whole.values;
    if (local) values = fit(alone, hypothesis, scan_local_unknowns(alone, hypothesis, values), rules).values;
    Workspace workspace;
    out.values[r] = values;
    if (!evaluate(evidence, hypothesis, r, values, false, workspace)) {
      // Out of the model's domain: as wrong as can be, not free of error.
      Eigen::Index rows = 0;
      for (const auto& series : evidence.recorded->recordings[r].series)
        rows += static_cast<Eigen::Index>(series.time_s.size());
      workspace.residuals.white.setConstant(rows, 1e3);
    }
    out.chi2[r] = workspace.residuals.white.squaredNorm();
    out.count[r] = static_cast<std::size_t>(workspace.residuals.white.size());
  });
  return out;
}

Remains examine_remains(const Evidence& evidence, const Fit& fit) {
  Remains out;
  Workspace workspace;
  double energy = 0, dof = 0;
  int series_count = 0;
  double smallest_p = 1;
  for (std::size_t r = 0; r < evidence.recorded->recordings.size(); ++r) {
    if (!evaluate(evidence, fit.hypothesis, r, fit.values, false, workspace)) continue;
    const Recording& recording = evidence.recorded->recordings[r];
    Eigen::Index row = 0;
    for (std::size_t c = 0; c < recording.series.size(); ++c) {
      const Series& series = recording.series[c];
      const auto count = static_cast<Eigen::Index>(series.time_s.size());
      if (count < 8) {
        row += count;
        continue;
      }
      const Eigen::VectorXd white = workspace.residuals.white.segment(row, count);
      row += count;
      ++series_count;
      const auto& noise = evidence.noise;
      const int lags = std::min(kLags, static_cast<int>(count) / 3);
      smallest_p =
          std::min(smallest_p, ljung_box(white, lags, (noise.ar1 > 0 ? 1 : 0) + (noise.ar2 != 0 ? 1 : 0)).p_value);
      Eigen::MatrixXd X = spline_basis(series, kKnot_s);
      whiten(make_whitening(series, evidence.noise, evidence.noise.sigma_mm[c]), X);
      const Eigen::HouseholderQR<Eigen::MatrixXd> qr(X);
      const Eigen::VectorXd rotated = qr.householderQ().transpose() * white;
      energy += rotated.head(X.cols()).squaredNorm();
      dof += static_cast<double>(X.cols());
    }
  }
  const auto count = static_cast<double>(fit.count());
  out.chi2_per_dof = fit.chi2 / count;
  // The noise was found on these same readings, from what the splines leave: its own variance is in the band.
  const double sd = std::sqrt(2 / count + 2 / std::max(count - dof, 1.0));
  out.band = {1 - kBandQuantile * sd, 1 + kBandQuantile * sd};
  out.structure_energy = energy - dof;
  // The splines' energy varies by itself, and all of it together with the colour that the noise was found to have.
  const double slow_sd = std::hypot(std::sqrt(2 * dof), evidence.noise.slow_error * dof);
  out.structure_sigmas = dof > 0 ? (energy - dof) / slow_sd : 0;
  out.ljung_box_p = std::min(1.0, smallest_p * series_count);
  return out;
}

}  // namespace bevel::diagnosis
