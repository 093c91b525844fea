// SPDX-License-Identifier: MIT
#include "proof/camera_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace bevel::proof {
namespace {

constexpr double kTransport_s = 0.009;

// One axis over consecutive frames, variance one.
std::vector<double> coloured(const CameraNoise& noise, std::size_t count, Random& random) {
  const auto innovation = [&] {
    return noise.tail_degrees > 0 ? random.heavy_tailed(noise.tail_degrees) : random.normal();
  };
  const double a1 = noise.ar1 * (1.0 - noise.ar2);  // so that neighbours correlate by ar1
  const double variance = 1.0 - noise.ar1 * a1 - noise.ar2 * noise.correlations(3)[2];
  const double scale = std::sqrt(variance);
  constexpr int kSettle = 200;
  double last = 0;
  double before = 0;
  std::vector<double> values;
  values.reserve(count);
  for (std::size_t i = 0; i < count + kSettle; ++i) {
    const double now = a1 * last + noise.ar2 * before + scale * innovation();
    before = last;
    last = now;
    if (i >= kSettle) values.push_back(now);
  }
  return values;
}

}  // namespace

std::vector<double> CameraNoise::correlations(std::size_t count) const {
  std::vector<double> r(std::max<std::size_t>(count, 2));
  r[0] = 1.0;
  r[1] = ar1;
  for (std::size_t i = 2; i < r.size(); ++i) r[i] = ar1 * (1.0 - ar2) * r[i - 1] + ar2 * r[i - 2];
  return r;
}

CameraNoise draw_camera_noise(Random& random) {
  CameraNoise noise;
  noise.sigma_mm = random.uniform(0.10, 0.27);
  noise.ar1 = random.pick(std::vector<double>{0.0, 0.0, 0.6, 0.6, 0.85, 0.9});
  if (noise.ar1 > 0.0 && random.chance(0.25)) noise.ar2 = random.uniform(-0.35, 0.15);
  if (random.chance(0.35)) noise.tail_degrees = 5;
  noise.outlier_share = random.pick(std::vector<double>{0.0, 0.01, 0.02});
  noise.dropout_share = random.pick(std::vector<double>{0.0, 0.02, 0.05});
  noise.late_share = random.pick(std::vector<double>{0.0, 0.03});
  noise.claim_ratio = std::exp(0.1 * random.normal());
  return noise;
}

Frames draw_frames(const CameraNoise& noise, double duration_s, Random& random) {
  const auto count = static_cast<std::size_t>(duration_s / kFramePeriod_s);
  std::array<std::vector<double>, 3> axes;
  for (auto& axis : axes) axis = coloured(noise, count, random);
  Frames frames;
  std::vector<Eigen::Vector3d> kept;
  const double first_s = random.uniform(0.0, kFramePeriod_s);
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Vector3d n(axes[0][i], axes[1][i], axes[2][i]);
    n = n.cwiseProduct(noise.sigmas_mm());
    const bool lost = random.chance(noise.dropout_share);
    const bool wild = random.chance(noise.outlier_share);
    const bool late = random.chance(noise.late_share);
    if (wild) {
      const Eigen::Vector3d way(random.normal(), random.normal(), random.normal());
      n += random.uniform(1.5, 6.0) * way.normalized();
    }
    const double delay_s = kTransport_s + (late ? random.uniform(0.03, 0.15) : 0.0);
    if (lost) continue;
    const double t = first_s + kFramePeriod_s * static_cast<double>(i);
    frames.times_s.push_back(t);
    frames.arrivals_s.push_back(t + delay_s);
    frames.numbers.push_back(static_cast<Eigen::Index>(i));
    kept.push_back(n);
  }
  frames.noise_mm.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i) frames.noise_mm.col(static_cast<Eigen::Index>(i)) = kept[i];
  return frames;
}

Whitener::Whitener(const CameraNoise& noise, const Frames& frames) : sigmas_mm_(noise.sigmas_mm()) {
  const auto n = static_cast<Eigen::Index>(frames.size());
  const auto r = noise.correlations(n > 0 ? static_cast<std::size_t>(frames.numbers.back()) + 1 : 2);
  Eigen::MatrixXd correlation(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      correlation(i, j) = r[static_cast<std::size_t>(
          std::abs(frames.numbers[static_cast<std::size_t>(i)] - frames.numbers[static_cast<std::size_t>(j)]))];
  correlation_.compute(correlation);
}

Eigen::VectorXd Whitener::operator()(const Eigen::Matrix3Xd& difference_mm) const {
  Eigen::MatrixXd scaled = (difference_mm.array().colwise() / sigmas_mm_.array()).matrix().transpose();
  correlation_.matrixL().solveInPlace(scaled);
  return scaled.reshaped();
}

}  // namespace bevel::proof
