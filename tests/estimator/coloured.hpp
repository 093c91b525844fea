// SPDX-License-Identifier: MIT
#pragma once
// Errors of readings that are alike from frame to frame.
#include <map>

#include "tests/estimator/insertion.hpp"

namespace bevel::estimator::testing {

struct Colour {
  double share = 0;           // of the variance; the rest is white
  double correlation_s = 0;   // first-order Gauss-Markov in time,
  double correlation_mm = 0;  // and in what is inserted; 0: not
};

// Puts the errors in of an insertion that was made with plan.sigma_mm = sigma_mm * sqrt(1 - share): each axis that a
// camera sees has its own. The readings then claim sigma_mm each.
inline void colour(Insertion& data, const Colour& with, double sigma_mm, double rate_mm_s, std::mt19937_64& rng) {
  struct Last {
    std::int64_t utime;
    Eigen::Vector3d error_mm;
  };
  std::map<int, Last> last;
  std::normal_distribution<double> normal(0, 1);
  const auto drawn = [&] { return Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); };
  const double sd_mm = sigma_mm * std::sqrt(with.share);
  for (model::TipMeasurement& m : data.measurements) {
    const auto before = last.find(m.camera);
    Eigen::Vector3d error_mm = sd_mm * drawn();
    if (before != last.end()) {
      const double dt_s = static_cast<double>(m.utime - before->second.utime) * 1e-6;
      const double rho = (with.correlation_s > 0 ? std::exp(-dt_s / with.correlation_s) : 1) *
                         (with.correlation_mm > 0 ? std::exp(-dt_s * rate_mm_s / with.correlation_mm) : 1);
      error_mm = rho * before->second.error_mm + std::sqrt(1 - rho * rho) * error_mm;
    }
    last[m.camera] = {m.utime, error_mm};
    for (int i = 0; i < 3; ++i) {
      double& information = m.information_per_mm2(i, i);
      if (!(information > 0)) continue;
      m.position_mm[i] += error_mm[i];
      information = 1 / (sigma_mm * sigma_mm);
    }
  }
}

}  // namespace bevel::estimator::testing
