#include "diagnosis/inference/calibrate.hpp"

#include <stdexcept>

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd middle_nuisance_sd(const System& system) {
  VectorXd out(static_cast<Index>(system.nuisance_groups().size()));
  for (Index g = 0; g < out.size(); ++g) {
    const auto& values = system.nuisance_groups()[static_cast<std::size_t>(g)].standard_deviations;
    out[g] = values[values.size() / 2];
  }
  return out;
}

Calibration calibrate(const System& system) {
  const std::size_t recordings = system.data().recordings.size();
  Noise claimed;
  claimed.frame_s = system.data().frame_s;
  claimed.sigma = system.data().claimed_sd;
  const Layout nothing(system, {});
  const std::vector<VectorXd> local(recordings, nothing.local_start());
  const Likelihood likelihood(system, Readings(recordings), claimed);
  const Fit base =
      fit(likelihood, nothing, nothing.shared_start(), local, {.nuisance_sd = middle_nuisance_sd(system), .curve = {}});
  if (!base.valid) throw std::domain_error("the model cannot follow the recordings");
  Errors errors(recordings);
  for (std::size_t r = 0; r < recordings; ++r) {
    const VectorXd all = likelihood.errors(nothing, r, base.shared, base.local[r]);
    Index row = 0;
    for (const Series& series : system.data().recordings[r].series) {
      errors[r].push_back(all.segment(row, static_cast<Index>(series.time_s.size())));
      row += static_cast<Index>(series.time_s.size());
    }
  }
  return calibrate_noise(system.data(), errors);
}

}  // namespace bevel::inference
