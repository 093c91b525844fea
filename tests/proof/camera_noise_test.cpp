// SPDX-License-Identifier: MIT
#include "proof/camera_noise.hpp"

#include <gmock/gmock.h>

namespace bevel::proof {
namespace {

double correlation(const Eigen::VectorXd& values, Eigen::Index lag) {
  const Eigen::Index n = values.size() - lag;
  return values.head(n).dot(values.tail(n)) / values.squaredNorm() * static_cast<double>(values.size()) /
         static_cast<double>(n);
}

struct Colour {
  double ar1, ar2;
  int tail;
};

class Noise : public testing::TestWithParam<Colour> {};

TEST_P(Noise, HasItsVarianceAndColourAndTheWhitenerTakesThemOut) {
  CameraNoise noise;
  noise.sigma_mm = 0.2;
  noise.ar1 = GetParam().ar1;
  noise.ar2 = GetParam().ar2;
  noise.tail_degrees = GetParam().tail;
  Random random(11);
  double variance = 0;
  double first = 0;
  Eigen::VectorXd white(0);
  const int runs = 12;
  for (int run = 0; run < runs; ++run) {
    const Frames frames = draw_frames(noise, 15.0, random);
    const Eigen::VectorXd y = frames.noise_mm.row(1).transpose();
    variance += y.squaredNorm() / static_cast<double>(y.size()) / runs;
    first += correlation(y, 1) / runs;
    const Eigen::VectorXd part = Whitener(noise, frames)(frames.noise_mm);
    white.conservativeResize(white.size() + part.size());
    white.tail(part.size()) = part;
  }
  // About 5000 values an axis; with rho = 0.9 worth some 300 independent ones.
  EXPECT_NEAR(variance, 0.04, 0.04 * (GetParam().ar1 > 0.8 ? 0.3 : 0.1));
  EXPECT_NEAR(first, noise.ar1, 0.06);
  EXPECT_NEAR(white.squaredNorm() / static_cast<double>(white.size()), 1.0, 0.06);
  EXPECT_NEAR(correlation(white, 1), 0.0, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Colours, Noise,
                         testing::Values(Colour{0, 0, 0}, Colour{0.6, 0, 0}, Colour{0.9, 0, 0}, Colour{0.85, -0.3, 0},
                                         Colour{0.6, 0, 5}));

TEST(Frames, LostOnesLeaveGapsAndTheWhitenerKnows) {
  CameraNoise noise;
  noise.ar1 = 0.85;
  noise.dropout_share = 0.2;
  Random random(5);
  double squares = 0;
  double count = 0;
  bool gap = false;
  for (int run = 0; run < 10; ++run) {
    const Frames frames = draw_frames(noise, 12.0, random);
    for (std::size_t i = 1; i < frames.size(); ++i) gap = gap || frames.numbers[i] > frames.numbers[i - 1] + 1;
    const Eigen::VectorXd white = Whitener(noise, frames)(frames.noise_mm);
    squares += white.squaredNorm();
    count += static_cast<double>(white.size());
  }
  EXPECT_TRUE(gap);
  EXPECT_NEAR(squares / count, 1.0, 0.05);
}

TEST(Frames, LateOnesKeepTheirStamp) {
  CameraNoise noise;
  noise.late_share = 0.2;
  Random random(5);
  const Frames frames = draw_frames(noise, 12.0, random);
  int late = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_NEAR(frames.times_s[i] - frames.times_s[0], kFramePeriod_s * static_cast<double>(frames.numbers[i]), 1e-9);
    late += frames.arrivals_s[i] - frames.times_s[i] > 0.03 ? 1 : 0;
  }
  EXPECT_GT(late, 30);
  EXPECT_LT(late, 120);
}

TEST(Frames, OutliersAreAsManyAsSaid) {
  CameraNoise noise;
  noise.sigma_mm = 0.1;
  noise.outlier_share = 0.02;
  Random random(8);
  int wild = 0;
  int count = 0;
  for (int run = 0; run < 20; ++run) {
    const Frames frames = draw_frames(noise, 12.0, random);
    for (Eigen::Index i = 0; i < frames.noise_mm.cols(); ++i) wild += frames.noise_mm.col(i).norm() > 1.0 ? 1 : 0;
    count += static_cast<int>(frames.size());
  }
  EXPECT_NEAR(static_cast<double>(wild) / count, 0.02, 0.006);
}

}  // namespace
}  // namespace bevel::proof
