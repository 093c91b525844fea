// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/calibrate.hpp>

#include <algorithm>
#include <cmath>

#include <bevel/diagnosis/inference/nuisance_grid.hpp>
#include <bevel/error.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// Of each recording, a series per channel; none outside the model's domain.
Errors errors_by_series(const Likelihood& likelihood, const Layout& layout, const VectorXd& shared,
                        const std::vector<VectorXd>& local) {
  Errors out;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    const VectorXd all = likelihood.errors(layout, r, shared, local[r]);
    if (all.size() != likelihood.data().recordings[r].rows()) return {};
    out.push_back(by_channel(likelihood.data().recordings[r], all));
  }
  return out;
}

// White noise as large as these errors, no smaller than `least`.
Noise noise_of(const Errors& errors, const Noise& least) {
  Noise out = least;
  out.ar1 = out.ar2 = 0;
  std::vector<double> squares(least.sigma.size(), 0), counts(least.sigma.size(), 0);
  for (std::size_t r = 0; r < errors.size(); ++r)
    for (std::size_t c = 0; c < errors[r].size(); ++c) {
      squares[c] += errors[r][c].squaredNorm();
      counts[c] += static_cast<double>(errors[r][c].size());
    }
  for (std::size_t c = 0; c < squares.size(); ++c)
    out.sigma[c] = std::max(out.sigma[c], std::sqrt(squares[c] / std::max(counts[c], 1.0)));
  return out;
}

}  // namespace

Fit tempered_base(const System& system, const Readings& outliers, const Noise& noise) {
  constexpr int kSteps = 6;
  constexpr double kSettled = 0.05;  // of the largest standard deviation, in its logarithm
  const Layout nothing(system, {});
  Fit now(nothing);
  now.shared = nothing.shared_start();
  now.local.assign(system.data().recordings.size(), nothing.local_start());
  Noise before = noise;
  for (int step = 0; step < kSteps; ++step) {
    const Likelihood by(system, outliers, before);
    const Errors errors = errors_by_series(by, nothing, now.shared, now.local);
    if (errors.empty()) break;
    const Noise sigma = noise_of(errors, noise);
    double change = 0;
    for (std::size_t c = 0; c < sigma.sigma.size(); ++c)
      change = std::max(change, std::abs(std::log(sigma.sigma[c] / before.sigma[c])));
    if (step > 0 && change < kSettled) break;
    before = sigma;
    now = fit(Likelihood(system, outliers, sigma), nothing, now.shared, now.local,
              {.nuisance_sd = middle_nuisance_sd(system), .curves = {}});
    if (!now.valid) break;
  }
  return now;
}

Calibration calibrate(const System& system) {
  const Readings none(system.data().recordings.size());
  Noise claimed;
  claimed.frame_s = system.data().frame_s;
  claimed.sigma = system.data().claimed_sd;
  const Fit base = tempered_base(system, none, claimed);
  if (!base.valid) throw DomainError("the model cannot follow the recordings");
  return calibrate_noise(system.data(),
                         errors_by_series(Likelihood(system, none, claimed), base.layout, base.shared, base.local));
}

}  // namespace bevel::inference
