// The cameras' noise: whitening against the dense covariance, and what calibration makes of series of known noise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <iostream>
#include <set>

#include "tests/mismatch/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

constexpr double kFrame_s = 1.0 / 30;

struct Made {
  RecordedCase recorded;
  Errors errors;
  std::vector<std::vector<std::size_t>> outliers;
};

// Series without a needle: errors are misfit + coloured noise + outliers. Two channels, four recordings of 12 s.
struct Recipe {
  double sigma_mm[2] = {0.15, 0.25};
  double ar1 = 0;
  double misfit_mm = 0;  // amplitude of a smooth curve: a slope, and a swing of 7 s
  double outlier_share = 0;
  double dropped_share = 0;
  double duration_s = 12;
};

Made make_series(const Recipe& recipe, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  Made made;
  made.recorded.frame_s = kFrame_s;
  made.recorded.channels = {{0, Eigen::Vector3d::UnitY(), "tip.y", recipe.sigma_mm[0]},
                            {0, Eigen::Vector3d::UnitZ(), "tip.z", recipe.sigma_mm[1]}};
  for (int r = 0; r < 4; ++r) {
    Recording recording;
    Series series;
    for (int i = 0; i * kFrame_s < recipe.duration_s; ++i) {
      if (uniform(random) < recipe.dropped_share) continue;
      series.reading.push_back(series.time_s.size());
      series.time_s.push_back(i * kFrame_s);
    }
    series.relative_sd.assign(series.time_s.size(), 1);
    series.measured_mm.assign(series.time_s.size(), 0);
    recording.motion.at.resize(series.time_s.size());
    recording.series = {series, series};
    std::vector<Eigen::VectorXd> errors;
    for (int c = 0; c < 2; ++c) {
      Eigen::VectorXd e = coloured_noise(series.time_s, recipe.sigma_mm[c], recipe.ar1, kFrame_s, random);
      for (Eigen::Index i = 0; i < e.size(); ++i) {
        const double t = series.time_s[static_cast<std::size_t>(i)];
        e[i] += recipe.misfit_mm * (0.1 * t + std::sin(2 * 3.14159 * t / 7 + r + c));
      }
      errors.push_back(e);
    }
    std::vector<std::size_t> outliers;
    for (Eigen::Index i = 1; i + 1 < errors[0].size(); ++i)
      if (uniform(random) < recipe.outlier_share) {
        const double direction = 6.28 * uniform(random);
        const double sigmas = 12 + 10 * uniform(random);
        errors[0][i] += sigmas * recipe.sigma_mm[0] * std::cos(direction);
        errors[1][i] += sigmas * recipe.sigma_mm[1] * std::sin(direction);
        outliers.push_back(static_cast<std::size_t>(i));
        ++i;  // two in a row are another matter
      }
    made.outliers.push_back(outliers);
    made.errors.push_back(errors);
    made.recorded.recordings.push_back(std::move(recording));
  }
  return made;
}

TEST(Whitening, IsTheInverseCholeskyFactorOfTheCovariance) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  for (const double ar1 : {0.0, 0.3, 0.9}) {
    Series series;
    for (int i = 0; i < 60; ++i) {
      if (uniform(random) < 0.3) continue;  // gaps
      series.time_s.push_back(i * kFrame_s + 0.004 * uniform(random));
      series.relative_sd.push_back(0.5 + uniform(random));
    }
    const auto n = static_cast<Eigen::Index>(series.time_s.size());
    const Noise noise{.sigma_mm = {0.2}, .ar1 = ar1, .outlier_share = 0, .frame_s = kFrame_s};
    Eigen::MatrixXd covariance(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j) {
        const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
        const double frames = std::abs(series.time_s[a] - series.time_s[b]) / kFrame_s;
        covariance(i, j) =
            0.04 * series.relative_sd[a] * series.relative_sd[b] * (i == j ? 1.0 : std::pow(ar1, frames));
      }
    Eigen::MatrixXd rows(n, 3);
    for (double& x : rows.reshaped()) x = normal(random);
    const Eigen::MatrixXd dense = covariance.llt().matrixL().solve(rows);
    whiten(make_whitening(series, noise, 0.2), rows);
    EXPECT_LT((rows - dense).cwiseAbs().maxCoeff(), 1e-9 * dense.cwiseAbs().maxCoeff()) << "ar1 " << ar1;
  }
}

// Of second order, variance one, neighbours correlated by ar1.
std::vector<double> correlations_of(double ar1, double ar2, std::size_t count) {
  std::vector<double> r{1, ar1};
  while (r.size() < count) r.push_back(ar1 * (1 - ar2) * r.back() + ar2 * r[r.size() - 2]);
  return r;
}

TEST(Whitening, OfSecondOrderIsTheInverseCholeskyFactorWhereNoFrameIsMissing) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  for (const double ar2 : {-0.35, 0.15}) {
    constexpr Eigen::Index kCount = 60;
    Series series;
    for (int i = 0; i < kCount; ++i) {
      series.time_s.push_back(i * kFrame_s);
      series.relative_sd.push_back(0.5 + uniform(random));
    }
    const auto r = correlations_of(0.85, ar2, kCount);
    Eigen::MatrixXd covariance(kCount, kCount);
    for (Eigen::Index i = 0; i < kCount; ++i)
      for (Eigen::Index j = 0; j < kCount; ++j)
        covariance(i, j) = 0.04 * series.relative_sd[static_cast<std::size_t>(i)] *
                           series.relative_sd[static_cast<std::size_t>(j)] *
                           r[static_cast<std::size_t>(std::abs(i - j))];
    Eigen::MatrixXd rows(kCount, 3);
    for (double& x : rows.reshaped()) x = normal(random);
    const Eigen::MatrixXd dense = covariance.llt().matrixL().solve(rows);
    const Noise noise{.sigma_mm = {0.2}, .ar1 = 0.85, .ar2 = ar2, .outlier_share = 0, .frame_s = kFrame_s};
    whiten(make_whitening(series, noise, 0.2), rows);
    EXPECT_LT((rows - dense).cwiseAbs().maxCoeff(), 1e-9 * dense.cwiseAbs().maxCoeff()) << "ar2 " << ar2;
  }
}

TEST(SplineBasis, IsAPartitionOfUnityThatHoldsCubics) {
  Series series;
  for (int i = 0; i < 200; ++i) series.time_s.push_back(2 + 0.04 * i);
  const Eigen::MatrixXd X = spline_basis(series, kKnot_s);
  EXPECT_EQ(X.cols(), 8 + 3);
  EXPECT_LT((X.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-12);
  Eigen::VectorXd cubic(200);
  for (int i = 0; i < 200; ++i) {
    const double t = 0.04 * i;
    cubic[i] = 1 - t + 0.3 * t * t - 0.02 * t * t * t;
  }
  EXPECT_LT((X * X.householderQr().solve(cubic).eval() - cubic).norm(), 1e-9);
}

// Mean and deviation of what calibration finds, over replicates.
struct Spread {
  double mean = 0, sd = 0;
  double error() const { return sd / std::sqrt(static_cast<double>(count)); }
  int count = 0;
};
Spread spread_of(const std::vector<double>& values) {
  Spread out{.count = static_cast<int>(values.size())};
  for (double v : values) out.mean += v / out.count;
  for (double v : values) out.sd += (v - out.mean) * (v - out.mean) / (out.count - 1);
  out.sd = std::sqrt(out.sd);
  return out;
}

class NoiseUnderMisfit : public ::testing::TestWithParam<double> {};

// Bounds: four standard errors of the mean over replicates, and what bias is tolerated.
TEST_P(NoiseUnderMisfit, IsFound) {
  const double ar1 = GetParam();
  constexpr int kReplicates = 20;
  const Recipe recipe{.ar1 = ar1, .misfit_mm = 1.0, .dropped_share = 0.05};
  std::vector<double> innovation, sigma, found_ar1, plain_sigma;
  for (std::uint64_t i = 0; i < kReplicates; ++i) {
    const Made made = make_series(recipe, 100 + i);
    const Noise noise = calibrate_noise(made.recorded, made.errors).noise;
    ASSERT_EQ(noise.sigma_mm.size(), 2U);
    EXPECT_LT(noise.outlier_share, 0.002);
    const double ratio = std::sqrt(noise.sigma_mm[0] / recipe.sigma_mm[0] * noise.sigma_mm[1] / recipe.sigma_mm[1]);
    sigma.push_back(ratio);
    innovation.push_back(ratio * std::sqrt((1 - noise.ar1 * noise.ar1) / (1 - ar1 * ar1)));
    found_ar1.push_back(noise.ar1);
    const Noise plain = estimate_noise(made.recorded, made.errors, false);
    plain_sigma.push_back(plain.sigma_mm[0] / recipe.sigma_mm[0]);
  }
  const Spread a = spread_of(innovation), b = spread_of(sigma), c = spread_of(found_ar1),
               plain = spread_of(plain_sigma);
  std::cout << "seeds 100 to " << 100 + kReplicates - 1 << ": innovation/true " << a.mean << " +- " << a.sd
            << ", sigma/true " << b.mean << " +- " << b.sd << ", ar1 " << c.mean << " +- " << c.sd
            << "; sigma/true without the curve " << plain.mean << '\n';
  EXPECT_NEAR(a.mean, 1, 4 * a.error() + 0.005);
  EXPECT_NEAR(c.mean, ar1, 4 * c.error() + 0.005);
  // What is left of noise so slow beside a knot a second says little of its deviation, and what it says is skewed.
  EXPECT_NEAR(b.mean, 1, 4 * b.error() + (ar1 > 0.9 ? 0.05 : 0.01));
  EXPECT_LT(b.sd, ar1 > 0.9 ? 0.35 : 0.08);
  EXPECT_GT(plain.mean, ar1 > 0.9 ? 1.4 : 2.0) << "a curve that passes for noise";
}
INSTANTIATE_TEST_SUITE_P(Ar1, NoiseUnderMisfit, ::testing::Values(0.0, 0.6, 0.85, 0.95),
                         [](const auto& of) { return std::to_string(std::lround(100 * of.param)); });

class NoiseOfSecondOrder : public ::testing::TestWithParam<double> {};

// The colour at high frequencies foretells the slow part, which the curve hides: taken for first order it is wrong.
TEST_P(NoiseOfSecondOrder, IsFoundUnderMisfit) {
  constexpr double kAr1 = 0.85;
  const double ar2 = GetParam();
  constexpr int kReplicates = 20;
  std::vector<double> found_ar1, found_ar2, sigma, first_order;
  int taken = 0;
  for (std::uint64_t i = 0; i < kReplicates; ++i) {
    Made made = make_series({.misfit_mm = 1.0}, 500 + i);
    std::mt19937_64 random(700 + i);
    std::normal_distribution<double> normal;
    for (std::size_t r = 0; r < made.errors.size(); ++r)
      for (std::size_t c = 0; c < 2; ++c) {
        const Made quiet = make_series({.sigma_mm = {0, 0}, .misfit_mm = 1.0}, 500 + i);
        const double a1 = kAr1 * (1 - ar2);
        const double scale = (c == 0 ? 0.15 : 0.25) * std::sqrt(1 - a1 * kAr1 - ar2 * (a1 * kAr1 + ar2));
        double last = 0, before = 0;
        for (Eigen::Index k = -100; k < made.errors[r][c].size(); ++k) {
          const double now = a1 * last + ar2 * before + scale * normal(random);
          before = last;
          last = now;
          if (k >= 0) made.errors[r][c][k] = quiet.errors[r][c][k] + now;
        }
      }
    const Noise noise = estimate_noise(made.recorded, made.errors, true);
    const Noise first = estimate_noise(made.recorded, made.errors, true, false);
    taken += noise.ar2 != 0 ? 1 : 0;
    found_ar1.push_back(noise.ar1);
    found_ar2.push_back(noise.ar2);
    sigma.push_back(std::sqrt(noise.sigma_mm[0] / 0.15 * noise.sigma_mm[1] / 0.25));
    first_order.push_back(first.ar1);
  }
  const Spread one = spread_of(found_ar1), two = spread_of(found_ar2), s = spread_of(sigma), f = spread_of(first_order);
  std::cout << "seeds 500 and 700 on: ar1 " << one.mean << " +- " << one.sd << ", ar2 " << two.mean << " +- " << two.sd
            << " (in " << taken << " of " << kReplicates << "), sigma/true " << s.mean << " +- " << s.sd
            << "; ar1 of first order " << f.mean << '\n';
  if (ar2 == 0) {
    // One in 1000 by chance.
    EXPECT_LE(taken, 1);
    return;
  }
  EXPECT_EQ(taken, kReplicates);
  EXPECT_NEAR(two.mean, ar2, 4 * two.error() + 0.01);
  EXPECT_NEAR(one.mean, kAr1, 4 * one.error() + 0.01);
  EXPECT_NEAR(s.mean, 1, 4 * s.error() + 0.02);
}
INSTANTIATE_TEST_SUITE_P(Ar2, NoiseOfSecondOrder, ::testing::Values(-0.3, 0.0, 0.12), [](const auto& of) {
  return (of.param < 0 ? "minus" : "") + std::to_string(std::lround(100 * std::abs(of.param)));
});

TEST(NoiseWithoutMisfit, IsFoundWithoutTheCurveToo) {
  const Recipe recipe{.ar1 = 0.6};
  const Made made = make_series(recipe, 12);
  const Noise noise = calibrate_noise(made.recorded, made.errors, false).noise;
  // Of 2880 readings, of which (1 - r^2)/(1 + r^2) count for a deviation; four deviations.
  EXPECT_NEAR(noise.sigma_mm[0] / recipe.sigma_mm[0], 1, 4 / std::sqrt(2 * 1440 * 0.47));
  EXPECT_NEAR(noise.ar1, 0.6, 4 * 0.8 / std::sqrt(2880));
}

// What the power of slow noise is found to be, over many draws, spreads by what each says of its own error.
TEST(SlowPower, SpreadsAsItsErrorSays) {
  constexpr int kDraws = 80;
  for (const double ar1 : {0.6, 0.9}) {
    double sum = 0, squares = 0, error = 0;
    for (int seed = 1; seed <= kDraws; ++seed) {
      const Made made = make_series({.ar1 = ar1, .misfit_mm = 1}, static_cast<std::uint64_t>(seed));
      const Noise noise = estimate_noise(made.recorded, made.errors, true, false);
      const double power = std::log((1 + noise.ar1) / (1 - noise.ar1) * noise.sigma_mm[0] * noise.sigma_mm[1]);
      sum += power;
      squares += power * power;
      error += noise.slow_error / kDraws;
    }
    const double mean = sum / kDraws;
    const double spread = std::sqrt(squares / kDraws - mean * mean);
    const double truth = std::log((1 + ar1) / (1 - ar1) * 0.15 * 0.25);
    std::cout << "ar1 " << ar1 << ": spread " << spread << ", by its own word " << error << ", mean " << mean - truth
              << " off, " << kDraws << " draws\n";
    EXPECT_NEAR(spread / error, 1, 0.3);
    EXPECT_NEAR(mean, truth, 0.5 * error);
  }
}

class OutliersIn : public ::testing::TestWithParam<double> {};

TEST_P(OutliersIn, ColouredNoiseAreFoundAndNothingElse) {
  const Recipe recipe{.ar1 = GetParam(), .misfit_mm = 1.0, .outlier_share = 0.02};
  constexpr int kReplicates = 10;
  std::size_t missed = 0, there = 0, wrong = 0, messages = 0;
  std::vector<double> sigma;
  for (std::uint64_t i = 0; i < kReplicates; ++i) {
    const Made made = make_series(recipe, 300 + i);
    const Calibration found = calibrate_noise(made.recorded, made.errors);
    sigma.push_back(
        std::sqrt(found.noise.sigma_mm[0] / recipe.sigma_mm[0] * found.noise.sigma_mm[1] / recipe.sigma_mm[1]));
    std::size_t dropped = 0, in_this_case = 0;
    for (std::size_t r = 0; r < made.outliers.size(); ++r) {
      const std::set<std::size_t> is(found.outliers[r].begin(), found.outliers[r].end());
      EXPECT_EQ(is.size(), found.outliers[r].size()) << "counted twice";
      dropped += is.size();
      in_this_case += made.recorded.recordings[r].motion.at.size();
      there += made.outliers[r].size();
      for (const std::size_t one : made.outliers[r]) missed += 1 - is.count(one);
      wrong += is.size();
      for (const std::size_t one : made.outliers[r]) wrong -= is.count(one);
    }
    EXPECT_NEAR(found.noise.outlier_share, static_cast<double>(dropped) / static_cast<double>(in_this_case), 1e-12);
    messages += in_this_case;
  }
  const Spread s = spread_of(sigma);
  std::cout << "seeds 300 to " << 300 + kReplicates - 1 << ": " << missed << " of " << there << " missed, " << wrong
            << " of " << messages << " taken for one, sigma/true " << s.mean << " +- " << s.sd << '\n';
  ASSERT_GT(there, 200U);
  // They are 12 to 22 deviations off: missed at most one in a hundred.
  EXPECT_LE(missed, there / 100);
  // Of Gaussian messages one in 1e6 lies as far out as the limit of 28 for two axes.
  EXPECT_LE(wrong, messages / 5000);
  EXPECT_NEAR(s.mean, 1, 4 * s.error() + 0.01);
}
INSTANTIATE_TEST_SUITE_P(Ar1, OutliersIn, ::testing::Values(0.0, 0.6, 0.9),
                         [](const auto& of) { return std::to_string(std::lround(100 * of.param)); });

TEST(Without, DropsThoseReadingsAndKeepsTheRestInOrder) {
  const Made made = make_series({}, 1);
  const auto fewer = without(made.recorded, {{3, 5}, {}, {0}, {}});
  EXPECT_EQ(fewer.measurements() + 6, made.recorded.measurements());
  const auto& kept = fewer.recordings[0].series[1];
  const auto& all = made.recorded.recordings[0].series[1];
  EXPECT_EQ(kept.reading[3], 4U);
  EXPECT_EQ(kept.reading[4], 6U);
  EXPECT_EQ(kept.time_s[4], all.time_s[6]);
  EXPECT_EQ(fewer.recordings[2].series[0].reading.front(), 1U);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
