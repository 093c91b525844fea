// SPDX-License-Identifier: MIT
// A line thinner than the lens's blur, located across: against made profiles of known place.
#include <bevel/drivers/camera/line_location.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

namespace bevel::camera {
namespace {

constexpr int kReach_px = 11;
constexpr double kBlur_px = 2.1, kPrior_px = 3.5;

std::vector<double> made(double at_px, double height) {
  std::vector<double> dark;
  for (int k = -kReach_px; k <= kReach_px; ++k)
    dark.push_back(height * std::exp(-0.5 * (k - at_px) * (k - at_px) / (kBlur_px * kBlur_px)));
  return dark;
}

TEST(LineLocation, IsWhereTheLineLies) {
  for (const double at_px : {-2.7, -0.4, 0.0, 0.25, 1.9}) {
    const LineLocation line = locate_line(made(at_px, 30.0), kBlur_px, kPrior_px);
    ASSERT_TRUE(line.found);
    EXPECT_NEAR(line.offset_px, at_px, 0.01);
    EXPECT_NEAR(line.height, 30.0, 0.05);
  }
}

TEST(LineLocation, VarianceIsThatOfTheErrors) {
  constexpr uint64_t seed = 41;
  constexpr int profiles = 2000;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-1.5, 1.5);
  std::normal_distribution<double> noise(0.0, 2.0);
  double squared = 0.0, squares = 0.0;
  for (int i = 0; i < profiles; ++i) {
    const double at_px = place(random);
    auto dark = made(at_px, 20.0);
    for (double& d : dark) d += noise(random);
    const LineLocation line = locate_line(dark, kBlur_px, kPrior_px);
    ASSERT_TRUE(line.found);
    const double e = line.offset_px - at_px;
    squares += e * e / profiles, squared += e * e / line.variance_px2 / profiles;
  }
  // Closed form for white noise: sd = noise / (height sqrt(sum of slopes^2)), that sum being sqrt(pi) / (2 blur).
  const double expected_px = 2.0 / (20.0 * std::sqrt(std::sqrt(std::numbers::pi) / (2.0 * kBlur_px)));
  std::printf("seed %llu, %d profiles: RMS %.4f px (%.4f by closed form), squared / 1 %.2f\n",
              static_cast<unsigned long long>(seed), profiles, std::sqrt(squares), expected_px, squared);
  EXPECT_NEAR(std::sqrt(squares) / expected_px, 1.0, 0.05);
  EXPECT_GT(squared, 0.8);
  EXPECT_LT(squared, 1.25);
}

// What a centre of gravity cannot do: darkness of 6 of 255 over five pixels beside a line of 25.
TEST(LineLocation, APaleShadeBesideTheLineHardlyMovesIt) {
  auto dark = made(0.0, 25.0);
  double* const middle = dark.data() + kReach_px;
  for (int k = 5; k <= 9; ++k) middle[k] += 6.0;
  double sum = 0.0, moment = 0.0;
  for (int k = -kReach_px; k <= kReach_px; ++k) sum += middle[k], moment += k * middle[k];
  const LineLocation line = locate_line(dark, kBlur_px, kPrior_px);
  ASSERT_TRUE(line.found);
  EXPECT_GT(moment / sum, 1.2);
  EXPECT_LT(std::abs(line.offset_px), 0.25);
  EXPECT_LT(line.offset_px * line.offset_px, 9.0 * line.variance_px2);
}

TEST(LineLocation, NothingDarkIsNoLine) {
  EXPECT_FALSE(locate_line(std::vector<double>(2 * kReach_px + 1, -3.0), kBlur_px, kPrior_px).found);
  EXPECT_FALSE(locate_line(made(0.0, 30.0), 0.0, kPrior_px).found);
  EXPECT_FALSE(locate_line({}, kBlur_px, kPrior_px).found);
}

}  // namespace
}  // namespace bevel::camera
