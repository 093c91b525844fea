// SPDX-License-Identifier: MIT
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {

model::testing::Script script_of(int recording) {
  const double turn = 2.5 + 0.5 * (recording % 4);
  const double sense = recording % 2 == 0 ? 1 : -1;
  if (recording % 3 == 0)
    return {{1.0, 12, 0}, {0.6, 0, sense * turn}, {1.2, 12, 0}, {0.8, 0, -sense * turn}, {0.5, 0, 0},
            {1.2, 16, 0}, {0.5, 0, sense * turn}, {1.5, 8, 0},  {0.5, -10, 0},           {0.6, 14, 0}};
  if (recording % 3 == 1)
    return {{0.8, 10, 0}, {1.0, 10, sense * 4}, {1.0, 14, 0},  {0.6, 0, -sense * turn},
            {1.0, 18, 0}, {1.2, 0, 0},          {1.2, 10, -5}, {1.2, 8, 0}};
  return {{0.6, 6, sense * 3}, {1.4, 18, 0}, {0.5, 0, -sense * turn}, {0.8, 6, 0}, {0.6, 0, sense * turn}, {1.0, 12, 0},
          {0.7, 8, 6},         {0.4, -8, 0}, {1.4, 12, -0.5}};
}

Eigen::VectorXd coloured_noise(const std::vector<double>& time_s, double sigma, double ar1, double frame_s,
                               std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd noise(static_cast<Eigen::Index>(time_s.size()));
  for (Eigen::Index i = 0; i < noise.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double kept = i == 0 ? 0 : std::pow(ar1, (time_s[at] - time_s[at - 1]) / frame_s);
    noise[i] = (i == 0 ? 0 : kept * noise[i - 1]) + sigma * std::sqrt(1 - kept * kept) * normal(random);
  }
  return noise;
}

std::vector<RawRecording> record(const SimulatedRig& rig, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  std::vector<RawRecording> all;
  for (int r = 0; r < rig.recordings; ++r) {
    RawRecording raw{.name = "rec" + std::to_string(r + 1), .actuators = rig.script(r).actuators(0.02), .tips = {}};
    std::vector<std::int64_t> utimes;
    std::vector<double> time_s;
    const int frames = static_cast<int>(std::ceil(rig.script(r).duration_s() / rig.frame_s));
    for (int i = 0; i < frames; ++i) {
      const double t = i * rig.frame_s;
      if (uniform(random) < rig.dropped_share) continue;
      utimes.push_back(raw.actuators.front().utime + std::llround(t * 1e6));
      time_s.push_back(t);
    }
    auto base = raw.actuators;
    if (rig.true_motion) rig.true_motion(base);
    auto effects = rig.effects;
    if (rig.effects_in)
      for (const auto& effect : rig.effects_in(r)) effects.push_back(effect);
    const auto run = model::testing::run(model::AugmentedNeedle(rig.needle, effects), model::make_motion(base, utimes),
                                         rig.heading_sd_rad > 0);
    const auto& path = run.position_mm;
    raw.changed = rig.changed_from >= 0 && r >= rig.changed_from;
    Eigen::MatrixXd noise(static_cast<Eigen::Index>(path.size()), 3);
    for (Eigen::Index i = 0; i < 3; ++i)
      noise.col(i) = coloured_noise(time_s, rig.sigma_mm[i], rig.ar1, rig.frame_s, random);
    for (std::size_t i = 0; i < path.size(); ++i) {
      model::TipMeasurement tip;
      tip.utime = utimes[i];
      tip.seq = static_cast<std::int64_t>(i);
      tip.position_mm = path[i] + noise.row(static_cast<Eigen::Index>(i)).transpose();
      if (uniform(random) < rig.outlier_share)
        tip.position_mm +=
            20 * rig.sigma_mm.mean() * Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      tip.information_per_mm2 = rig.sigma_mm.cwiseAbs2().cwiseInverse().asDiagonal();
      raw.tips.push_back(tip);
    }
    for (std::size_t i = 0; i < run.heading.size(); ++i) {
      model::TipHeading heading;
      heading.utime = utimes[i];
      heading.seq = static_cast<std::int64_t>(i);
      const double sd = rig.heading_sd_rad;
      const Eigen::Vector3d error(sd * normal(random), sd * normal(random), sd * normal(random));
      heading.heading = (run.heading[i] + error).normalized();
      heading.information_per_rad2 =
          (Eigen::Matrix3d::Identity() - heading.heading * heading.heading.transpose()) / (sd * sd);
      raw.headings.push_back(heading);
    }
    all.push_back(std::move(raw));
  }
  return all;
}

RecordedCase record_case(const SimulatedRig& rig, std::uint64_t seed) { return make_case(record(rig, seed)); }

}  // namespace bevel::diagnosis::testing
