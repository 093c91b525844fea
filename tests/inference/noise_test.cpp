// SPDX-License-Identifier: MIT
// The noise: found beside structure that is no noise, its outliers, and again about a model.
#include <gtest/gtest.h>

#include <random>

#include <bevel/diagnosis/inference/outliers.hpp>

namespace bevel::inference {
namespace {

struct Made {
  Dataset data;
  Errors errors;
  Readings outliers;
};

// Two channels of autocorrelated noise at 30 Hz over a slow curve, outliers of 10 to 50 deviations in both.
Made make(double ar1, double outlier_share, double dropped_share, std::uint64_t seed) {
  constexpr std::size_t kMessages = 400, kRecordings = 6;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const double sigma[] = {0.1, 0.25};
  Made out;
  out.data.claimed_sd = {0.1, 0.25};
  out.data.frame_s = 1.0 / 30;
  out.outliers.resize(kRecordings);
  for (std::size_t r = 0; r < kRecordings; ++r) {
    SeriesSet set;
    set.messages = kMessages;
    set.series.resize(2);
    std::vector<std::vector<double>> values(2);
    double state[] = {normal(random), normal(random)};
    for (std::size_t i = 0; i < kMessages; ++i) {
      const bool dropped = uniform(random) < dropped_share;
      const bool outlier = !dropped && uniform(random) < outlier_share;
      if (outlier) out.outliers[r].push_back(i);
      const double size = outlier ? 10 + 40 * uniform(random) : 0, angle = 6.28 * uniform(random);
      for (std::size_t c = 0; c < 2; ++c) {
        state[c] = ar1 * state[c] + std::sqrt(1 - ar1 * ar1) * normal(random);
        if (dropped) continue;
        const double t = static_cast<double>(i) / 30;
        set.series[c].message.push_back(i);
        set.series[c].time_s.push_back(t);
        set.series[c].relative_sd.push_back(1);
        set.series[c].measured.push_back(0);
        values[c].push_back(0.8 * std::sin(0.9 * t + static_cast<double>(r)) +
                            sigma[c] * (state[c] + size * (c == 0 ? std::cos(angle) : std::sin(angle))));
      }
    }
    out.errors.emplace_back();
    for (const auto& one : values)
      out.errors.back().emplace_back(
          Eigen::Map<const Eigen::VectorXd>(one.data(), static_cast<Eigen::Index>(one.size())));
    out.data.recordings.push_back(std::move(set));
  }
  return out;
}

// A curve goes through four readings and fewer, whatever they are.
TEST(Noise, RecordingsOfFourReadingsAndFewerSayNothingOfIt) {
  for (const std::size_t few : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{4}}) {
    Made made = make(0.6, 0, 0, 7);
    const Noise without = estimate_noise(made.data, made.errors);
    made.data.recordings.push_back(made.data.recordings.front());
    made.errors.push_back(made.errors.front());
    for (std::size_t c = 0; c < 2; ++c) {
      Series& series = made.data.recordings.back().series[c];
      for (auto* of : {&series.time_s, &series.measured, &series.relative_sd}) of->resize(few);
      series.message.resize(few);
      made.errors.back()[c] = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(few), 100);
    }
    const Noise with = estimate_noise(made.data, made.errors);
    EXPECT_EQ(with.sigma, without.sigma) << few;
    EXPECT_EQ(with.ar1, without.ar1) << few;
  }
}

class NoiseBesideACurve : public ::testing::TestWithParam<double> {};

TEST_P(NoiseBesideACurve, IsFoundWithItsOutliers) {
  const double ar1 = GetParam();
  const Made made = make(ar1, 0.02, 0.05, 17);
  const Calibration found = calibrate_noise(made.data, made.errors);
  EXPECT_NEAR(found.noise.sigma[0], 0.1, 0.012);
  EXPECT_NEAR(found.noise.sigma[1], 0.25, 0.03);
  EXPECT_NEAR(found.noise.ar1, ar1, 0.05);
  std::size_t planted = 0, hit = 0, all = 0;
  for (std::size_t r = 0; r < made.outliers.size(); ++r) {
    planted += made.outliers[r].size();
    all += found.outliers[r].size();
    EXPECT_TRUE(std::is_sorted(found.outliers[r].begin(), found.outliers[r].end()));
    for (const auto i : made.outliers[r])
      hit += std::binary_search(found.outliers[r].begin(), found.outliers[r].end(), i) ? 1 : 0;
  }
  EXPECT_GE(hit + 1, planted);        // but for one that another's neighbourhood hides
  EXPECT_LE(all - hit, all / 5 + 3);  // and hardly any that is none
}

INSTANTIATE_TEST_SUITE_P(Autocorrelations, NoiseBesideACurve, ::testing::Values(0.0, 0.6, 0.85));

// The curve follows the last readings of a series most. Two outliers of the last three, 15 to 35 deviations, are two
// all the same, and the good one between them is none.
TEST(Noise, OutliersAtTheEndOfASeriesAreFound) {
  Made made = make(0.85, 0, 0, 21);
  const std::vector<std::size_t> planted{397, 399};
  for (std::size_t r = 0; r < 6; r += 2) {
    made.errors[r][0](397) -= 3.5, made.errors[r][0](399) -= 2.3;
    made.errors[r][1](397) += 5.2, made.errors[r][1](399) += 4.1;
  }
  const Calibration found = calibrate_noise(made.data, made.errors);
  for (std::size_t r = 0; r < 6; ++r)
    EXPECT_EQ(found.outliers[r], r % 2 == 0 ? planted : std::vector<std::size_t>()) << "recording " << r;
}

// Where a tip jumps no curve follows, and readings are off to one side before it and to the other after it; but they
// agree with their own side, and an outlier beside the jump does not.
TEST(Noise, WhatAgreesWithOneSideOfAJumpIsNoOutlier) {
  Made made = make(0.6, 0, 0, 33);
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t c = 0; c < 2; ++c) {
      made.errors[r][c].tail(200).array() += c == 0 ? 3.0 : 1.5;
      made.errors[r][c](r % 2 == 0 ? 198 : 201) += c == 0 ? 2.0 : -3.0;
    }
  const Calibration found = calibrate_noise(made.data, made.errors);
  for (std::size_t r = 0; r < 6; ++r)
    EXPECT_EQ(found.outliers[r], std::vector<std::size_t>{r % 2 == 0 ? 198UL : 201UL}) << "recording " << r;
}

// Readings with an error of their own beside autocorrelated noise, frames missing: against the dense covariance.
TEST(Noise, AReadingsOwnErrorIsWhitenedExactly) {
  Noise noise{.sigma = {0.3}, .ar1 = 0.7};
  Series series;
  for (const int frame : {0, 1, 2, 4, 5, 6, 9, 10, 11, 12}) {
    series.time_s.push_back(frame * noise.frame_s);
    series.relative_sd.push_back(frame % 3 == 0 ? 1.5 : 1);
    series.input_sd.push_back(frame == 2 || frame == 5 || frame == 6 ? 3 : frame == 12 ? 0.5 : 0);
  }
  const auto n = static_cast<Eigen::Index>(series.time_s.size());
  Eigen::MatrixXd covariance(n, n), white = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      const double frames = std::abs(series.time_s[a] - series.time_s[b]) / noise.frame_s;
      covariance(i, j) = series.relative_sd[a] * series.relative_sd[b] * std::pow(noise.ar1, frames);
      if (i == j) covariance(i, j) += series.input_sd[a] * series.input_sd[a];
      covariance(i, j) *= 0.3 * 0.3;
    }
  const Whitening whitening = make_whitening(series, noise, 0.3);
  whiten(whitening, white);  // now the whitening matrix
  EXPECT_LT((white * covariance * white.transpose() - Eigen::MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Noise, WithoutItsOutliersTheRestIsLeft) {
  const Made made = make(0.3, 0.02, 0, 5);
  const Dataset rest = without(made.data, made.outliers);
  const auto rows = rows_left(made.data, made.outliers);
  for (std::size_t r = 0; r < rest.recordings.size(); ++r) {
    EXPECT_EQ(rest.recordings[r].rows(),
              made.data.recordings[r].rows() - 2 * static_cast<Eigen::Index>(made.outliers[r].size()));
    EXPECT_EQ(static_cast<Eigen::Index>(rows[r].size()), rest.recordings[r].rows());
  }
}

// Of second order, over gaps, and with errors of their own in some readings.
TEST(ExpectedErrors, AreWhitenedAsTheirColumnsAre) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  Series series;
  double time_s = 0;
  for (int i = 0; i < 40; ++i) {
    time_s += i % 7 == 3 ? 0.5 : 0.1;
    series.time_s.push_back(time_s);
    series.relative_sd.push_back(1 + 0.2 * (i % 3));
  }
  const Eigen::MatrixXd columns = Eigen::MatrixXd::NullaryExpr(40, 5, [&] { return normal(random); });
  const ExpectedErrors errors(columns);
  const auto check = [&](double ar1, double ar2) {
    Noise noise;
    noise.frame_s = 0.1, noise.ar1 = ar1, noise.ar2 = ar2;
    const Whitening whitening = make_whitening(series, noise, 0.3);
    Eigen::MatrixXd white = columns;
    whiten(whitening, white);
    EXPECT_NEAR(errors.whitened_squares(whitening).sum(), white.squaredNorm(), 1e-9 * white.squaredNorm());
  };
  check(0, 0), check(0.7, 0), check(0.7, 0.2), check(0.5, -0.4);
  for (int i = 0; i < 40; ++i) series.input_sd.push_back(i % 5 == 0 ? 0.8 : 0);
  check(0.7, 0);
}

TEST(Noise, AboutAModelIsTheLikeliest) {
  Made made = make(0.6, 0, 0.05, 3);
  for (std::size_t r = 0; r < made.errors.size(); ++r)
    for (std::size_t c = 0; c < 2; ++c)
      for (Eigen::Index i = 0; i < made.errors[r][c].size(); ++i)
        made.errors[r][c][i] -=
            0.8 * std::sin(0.9 * made.data.recordings[r].series[c].time_s[static_cast<std::size_t>(i)] +
                           static_cast<double>(r));
  Noise start;
  start.frame_s = made.data.frame_s;
  start.ar1 = 0.95;
  start.sigma = {1, 1};
  std::vector<std::vector<ExpectedErrors>> errors(made.errors.size());
  for (std::size_t r = 0; r < errors.size(); ++r)
    for (const auto& one : made.errors[r]) errors[r].emplace_back(one);
  const Noise found = refine_noise(made.data, errors, start);
  EXPECT_NEAR(found.ar1, 0.6, 0.03);
  EXPECT_NEAR(found.sigma[0], 0.1, 0.006);
  EXPECT_NEAR(found.sigma[1], 0.25, 0.015);
  EXPECT_TRUE(alike(found, refine_noise(made.data, errors, found)));
}

}  // namespace
}  // namespace bevel::inference
