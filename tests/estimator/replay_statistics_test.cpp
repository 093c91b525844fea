// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <bevel/analysis/replay/statistics.hpp>

namespace bevel::analysis {
namespace {

// A curved path with first-order noise, one reading in a hundred an outlier, one in twenty lost.
std::vector<AxisSample> readings(double sd_mm, double rho, std::mt19937_64& rng) {
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<AxisSample> samples;
  double noise = sd_mm * normal(rng);
  for (int frame = 0; frame < 2000; ++frame) {
    const double depth_mm = 0.05 * frame;
    noise = rho * noise + sd_mm * std::sqrt(1 - rho * rho) * normal(rng);
    const double outlier_mm = unit(rng) < 0.01 ? 5 : 0;
    if (unit(rng) > 0.05) samples.push_back({frame, depth_mm, 0.0025 * depth_mm * depth_mm + noise + outlier_mm});
  }
  return samples;
}

TEST(ReplayStatistics, NoiseIsMeasuredWithoutAModelOfThePath) {
  std::mt19937_64 rng(5);
  for (const double rho : {0.0, 0.6, 0.85}) {
    const NoiseColour noise = measure_noise({readings(0.2, rho, rng), readings(0.2, rho, rng)});
    EXPECT_NEAR(noise.sd_mm, 0.2, 0.02) << "rho " << rho;
    EXPECT_NEAR(noise.rho, rho, 0.05);
  }
}

TEST(ReplayStatistics, WhiteningTakesTheColourOut) {
  std::mt19937_64 rng(6);
  std::normal_distribution<double> normal(0, 1);
  std::vector<Innovation> coloured;
  std::vector<double> plain;
  double noise = 0.3 * normal(rng);
  for (int frame = 0; frame < 1000; ++frame) {
    noise = 0.6 * noise + 0.3 * 0.8 * normal(rng);
    coloured.push_back({frame, noise, 0});
    plain.push_back(noise);
  }
  EXPECT_LT(ljung_box(plain).p_value, 1e-6);
  const auto white = whiten(coloured, {0.3, 0.6});
  EXPECT_GT(ljung_box(white).p_value, 0.01);
  ChiSquareMean squares;
  for (const double u : white) squares.add(u * u, 1);
  EXPECT_TRUE(squares.in_band()) << squares.mean();
}

TEST(ReplayStatistics, TooFewReadingsGiveNoNoise) {
  EXPECT_EQ(measure_noise({{{0, 0, 0}, {1, 1, 0}, {2, 2, 0}}}).sd_mm, 0);
  EXPECT_EQ(ljung_box({1, 2}).p_value, 1);
}

}  // namespace
}  // namespace bevel::analysis
