// SPDX-License-Identifier: MIT
// Readings whose errors are alike: the six states for what they share, against closed forms and on drawn insertions.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <boost/math/distributions/chi_squared.hpp>
#include <iostream>

#include <bevel/estimator/error_state.hpp>
#include "tests/estimator/coloured.hpp"
#include "tests/estimator/play.hpp"

namespace bevel::estimator {
namespace {

EstimatorConfig told(EstimatorConfig config, const ReadingNoise& noise) {
  config.reading = noise;
  return config;
}

model::TipMeasurement reading_at(double x_mm, int camera, std::int64_t utime, double sigma_mm) {
  model::TipMeasurement m;
  m.utime = utime, m.camera = camera;
  m.position_mm = {x_mm, 0, 0};
  m.information_per_mm2 = Eigen::Vector3d(1 / (sigma_mm * sigma_mm), 0, 0).asDiagonal();
  return m;
}

// A needle at rest is a constant in coloured noise: generalised least squares, by the full covariance of all readings
// of two cameras, has the same mean and variance.
TEST(ColouredNoise, OfANeedleAtRestIsGeneralisedLeastSquares) {
  constexpr double kShare = 0.8, kOver_s = 0.1, kSigma_mm = 0.2;
  constexpr int kReadings = 40;
  const EstimatorConfig config = told({}, {.correlated_share = kShare, .correlation_s = kOver_s});
  const NeedleFilter filter(config);
  FilterState state = filter.initial();
  std::mt19937_64 rng(61);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> gap_s(0, 0.08);
  Eigen::VectorXd seen(kReadings), at_s(kReadings), camera(kReadings);
  double now_s = 0;
  for (int i = 0; i < kReadings; ++i) {
    const double dt_s = gap_s(rng);
    now_s += dt_s;
    at_s[i] = now_s, camera[i] = i % 3 == 0 ? 1 : 0, seen[i] = 0.2 * normal(rng);
    filter.predict(state, 0, 0, dt_s);
    ASSERT_TRUE(filter.update(state, reading_at(seen[i], static_cast<int>(camera[i]), 1 + i, kSigma_mm)).accepted);
  }
  Eigen::MatrixXd C(kReadings, kReadings);
  for (int i = 0; i < kReadings; ++i)
    for (int j = 0; j < kReadings; ++j)
      C(i, j) = kSigma_mm * kSigma_mm *
                (kShare * (camera[i] == camera[j]) * std::exp(-std::abs(at_s[i] - at_s[j]) / kOver_s) +
                 (1 - kShare) * (i == j));
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(kReadings), weights = C.ldlt().solve(one);
  const double prior = 1 / (config.prior.position_sd_mm * config.prior.position_sd_mm);
  const double variance = 1 / (prior + one.dot(weights));
  EXPECT_NEAR(state.covariance(0, 0), variance, 1e-9 * variance);
  EXPECT_NEAR(state.pose.p_mm.x(), variance * weights.dot(seen), 1e-9);
  // As white they would be worth several times as much.
  EXPECT_GT(variance, 2 / (prior + kReadings / (kSigma_mm * kSigma_mm)));
}

// What a reading is worth to the past that is run again: of a constant in Gauss-Markov noise exactly its information.
TEST(ColouredNoise, TheWorthOfReadingsAddsUpToTheirInformation) {
  const NeedleFilter filter(told({}, {.correlated_share = 1, .correlation_s = 0.1}));
  constexpr int kReadings = 30;
  std::mt19937_64 rng(62);
  std::uniform_real_distribution<double> gap_s(0.001, 0.1);
  Eigen::VectorXd at_s(kReadings);
  double worth = 0, now_s = 0;
  for (int i = 0; i < kReadings; ++i) {
    const double dt_s = gap_s(rng);
    at_s[i] = now_s += dt_s;
    worth += filter.worth(i == 0 ? std::numeric_limits<double>::infinity() : filter.forgotten(0, 0, dt_s));
  }
  Eigen::MatrixXd C(kReadings, kReadings);
  for (int i = 0; i < kReadings; ++i)
    for (int j = 0; j < kReadings; ++j) C(i, j) = std::exp(-std::abs(at_s[i] - at_s[j]) / 0.1);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(kReadings);
  EXPECT_NEAR(worth, one.dot(C.ldlt().solve(one)), 1e-9 * worth);
}

TEST(ColouredNoise, IsForgottenByTimeInsertionAndTurning) {
  const NeedleFilter filter(
      told({}, {.correlated_share = 0.5, .correlation_s = 2, .correlation_mm = 4, .correlation_rad = 0.5}));
  EXPECT_NEAR(filter.forgotten(-2, 0.25, 1), 0.5 + 0.5 + 0.5, 1e-12);
  const NeedleFilter by_way(told({}, {.correlated_share = 0.5, .correlation_mm = 4}));
  EXPECT_EQ(by_way.forgotten(0, 1, 1000), 0);  // at rest: the same pixels, the same error
  EXPECT_EQ(NeedleFilter(EstimatorConfig{}).worth(0.1), 1);
}

// The covariance of state and shared errors after a step, F by central differences of the mean: of a tip that cuts, and
// of one that is drawn back through its channel.
TEST(ColouredNoise, MovesWithTheStateByItsDerivative) {
  const ReadingNoise noise{.correlated_share = 0.7, .correlation_mm = 3, .correlation_rad = 1};
  for (const bool drawn_back : {false, true}) {
    EstimatorConfig config = told(testing::agar_config(), noise);
    config.through_channel = drawn_back;
    if (drawn_back) config.midpoint_derivatives = false;
    const double by_mm = drawn_back ? -1.3 : 0.3, by_rad = 0.04;
    const NeedleFilter filter(config);
    FilterState state = filter.initial();
    std::mt19937_64 rng(63);
    for (int i = 0; i < 200; ++i) {
      filter.predict(state, drawn_back && i > 170 ? -0.2 : 0.2, 0.03);
      filter.update(state, testing::measure(state.pose.p_mm, i + 1, i, i % 2,
                                            i % 2 ? Eigen::Vector3d(1, 0, 1) : Eigen::Vector3d(0, 1, 1), 0.1, rng));
    }
    Error<9> scale;
    scale << 1e-3, 1e-3, 1e-3, 1e-5, 1e-5, 1e-5, 1e-6, 1e-4, 1e-4;
    const auto moved = [&](const Error<9>& by) {
      FilterState s = state;
      move<9>(s, by);
      filter.predict_mean(s, by_mm, by_rad);
      return s;
    };
    const FilterState middle = moved(Error<9>::Zero());
    Matrix9d F;
    for (int i = 0; i < 9; ++i) {
      const Error<9> by = scale[i] * Error<9>::Unit(i);
      F.col(i) = (difference<9>(middle, moved(by)) - difference<9>(middle, moved(-by))) / (2 * scale[i]);
    }
    const auto had = state.shared;
    filter.predict(state, by_mm, by_rad);
    const double left = std::exp(-std::abs(by_mm) / 3 - by_rad);
    const Eigen::Matrix<double, 9, 6> expected = left * F * had.with_state.topRows<9>();
    ASSERT_GT(expected.norm(), 1e-2);
    EXPECT_LT((state.shared.with_state.topRows<9>() - expected).norm(), 1e-4 * expected.norm()) << drawn_back;
    EXPECT_NEAR(state.shared.covariance(1, 1), left * left * had.covariance(1, 1) + 1 - left * left, 1e-12);
  }
}

TEST(ColouredNoise, OfNoShareIsThePlainFilterBitForBit) {
  std::mt19937_64 rng(64);
  testing::InsertionPlan plan;
  plan.cameras = 2;
  const EstimatorConfig plain = testing::agar_config();
  const auto data = testing::draw_insertion(plain.prior, plan, rng).data;
  NeedleEstimator a(plain), b(told(plain, {.correlated_share = 0, .correlation_s = 0.3, .correlation_mm = 2}));
  testing::play(a, data), testing::play(b, data);
  const auto now = data.actuators.back().utime;
  EXPECT_EQ(a.estimate(now).state.pose.p_mm, b.estimate(now).state.pose.p_mm);
  EXPECT_EQ(a.estimate(now).state.covariance, b.estimate(now).state.covariance);
}

// Of a correlation that is gone by the next frame nothing is left but white noise.
TEST(ColouredNoise, ForgottenAtOnceIsWhite) {
  std::mt19937_64 rng(65);
  testing::InsertionPlan plan;
  plan.cameras = 2;
  const EstimatorConfig plain = testing::agar_config();
  const auto data = testing::draw_insertion(plain.prior, plan, rng).data;
  NeedleEstimator a(plain), b(told(plain, {.correlated_share = 0.9, .correlation_s = 1e-4}));
  testing::play(a, data), testing::play(b, data);
  const FilterState white = a.estimate(data.actuators.back().utime).state,
                    coloured = b.estimate(data.actuators.back().utime).state;
  const Error<9> sd = white.covariance.diagonal().cwiseSqrt();
  EXPECT_LT(difference<9>(white, coloured).cwiseQuotient(sd).norm(), 1e-6);
  EXPECT_LT((white.covariance - coloured.covariance).cwiseQuotient(sd * sd.transpose()).norm(), 1e-6);
}

TEST(ColouredNoise, ShuffledInputGivesTheSameStateBitForBit) {
  std::mt19937_64 rng(66);
  const EstimatorConfig config =
      told(testing::agar_config(), {.correlated_share = 0.8, .correlation_s = 0.2, .correlation_mm = 2});
  testing::InsertionPlan plan;
  plan.cameras = 2, plan.length_mm = 20;
  const auto data = testing::draw_insertion(config.prior, plan, rng).data;
  NeedleEstimator sorted(config, 1024), shuffled(config, 1024);
  testing::play(sorted, data), testing::play_shuffled(shuffled, data, rng);
  const auto now = data.actuators.back().utime;
  const FilterState a = sorted.estimate(now).state, b = shuffled.estimate(now).state;
  EXPECT_GT(shuffled.counters().positions.late, 50);
  EXPECT_EQ(a.pose.p_mm, b.pose.p_mm);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.shared.mean, b.shared.mean);
  EXPECT_EQ(a.shared.covariance, b.shared.covariance);
}

// In and out by 40 mm, cutting anew and through the channel.
TEST(ColouredNoise, AHundredThousandStepsStayPositiveDefinite) {
  for (const bool through_channel : {false, true}) {
    EstimatorConfig config = told(testing::agar_config(), {.correlated_share = 0.95, .correlation_mm = 2});
    config.through_channel = through_channel;
    const NeedleFilter filter(config);
    FilterState state = filter.initial();
    std::mt19937_64 rng(67);
    for (int i = 0; i < 100'000; ++i) {
      filter.predict(state, (i / 400) % 2 ? -0.1 : 0.1, 0.01);
      if (i % 3 == 0)
        filter.update(state, testing::measure(state.pose.p_mm, i, i, i % 2,
                                              i % 2 ? Eigen::Vector3d(1, 0, 1) : Eigen::Vector3d(0, 1, 1), 0.1, rng));
      if (i % 1'000 != 0) continue;
      const Covariance<15> P = covariance_of<15>(state);
      ASSERT_EQ(P, P.transpose());
      const Error<15> unit = P.diagonal().cwiseSqrt().cwiseInverse();
      const Covariance<15> correlation = unit.asDiagonal() * P * unit.asDiagonal();
      ASSERT_GT(Eigen::SelfAdjointEigenSolver<Covariance<15>>(correlation).eigenvalues()[0], 0)
          << i << " " << through_channel;
    }
  }
}

struct Consistency {
  double nees = 0, pose = 0, parameters = 0, nis = 0, axes = 0;
};
constexpr int kRuns = 200;
constexpr unsigned kSeed = 4;

std::pair<double, double> band(double degrees) {
  const boost::math::chi_squared chi2(degrees);
  return {boost::math::quantile(chi2, 0.025) / degrees, boost::math::quantile(chi2, 0.975) / degrees};
}

// Of the variance of a reading; the rest is white.
constexpr double kShare = 0.8;
ReadingNoise of_frames(double rho) { return {.correlated_share = kShare, .correlation_s = -0.033 / std::log(rho)}; }

// Insertions whose readings' errors are alike, by rho from frame to frame of 33 ms.
Consistency insert_many(double rho, bool on_and_on, const ReadingNoise& noise) {
  testing::InsertionPlan plan;
  plan.cameras = 2, plan.lost_share = 0.1;
  if (on_and_on) plan.one_way = true, plan.rate_mm_s = 5, plan.rotation_rate_rad_s = 8;
  constexpr double kSigma_mm = 0.15;
  plan.sigma_mm = kSigma_mm * std::sqrt(1 - kShare);
  EstimatorConfig config = testing::agar_config();
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};  // the plant is the model
  config.reading = noise;
  std::mt19937_64 rng(kSeed);
  Consistency out;
  for (int run = 0; run < kRuns; ++run) {
    auto drawn = testing::draw_insertion(config.prior, plan, rng);
    testing::colour(drawn.data, {.share = kShare, .correlation_s = of_frames(rho).correlation_s}, kSigma_mm,
                    plan.rate_mm_s, rng);
    NeedleEstimator estimator(config);
    estimator.observe(
        [](void* context, const NeedleEstimator::Applied& a) {
          auto& sums = *static_cast<Consistency*>(context);
          sums.nis += a.update.mahalanobis2, sums.axes += a.update.rank;
        },
        &out);
    testing::play(estimator, drawn.data, 50'000);
    const FilterState state = estimator.estimate(drawn.data.actuators.back().utime).state;
    const Error<9> e = testing::error_of(state, drawn.data.final_pose, drawn.needle);
    const Matrix9d& P = state.covariance;
    out.nees += e.dot(P.ldlt().solve(e)) / 9 / kRuns;
    out.pose += e.head<6>().dot(P.topLeftCorner<6, 6>().ldlt().solve(e.head<6>())) / 6 / kRuns;
    out.parameters += e.tail<3>().dot(P.bottomRightCorner<3, 3>().ldlt().solve(e.tail<3>())) / 3 / kRuns;
  }
  std::cout << "seed " << kSeed << ", rho " << rho << (on_and_on ? ", on and on" : ", to and fro") << ", told "
            << noise.correlated_share << ": NEES/9 " << out.nees << ", pose " << out.pose << ", parameters "
            << out.parameters << ", NIS/axis " << out.nis / out.axes << " of " << out.axes << "\n";
  return out;
}

TEST(ColouredNoise, TwoHundredInsertionsAreConsistentWhereTheFilterIsTold) {
  for (const bool on_and_on : {false, true})
    for (const double rho : {0.6, 0.9}) {
      const Consistency it = insert_many(rho, on_and_on, of_frames(rho));
      // The posterior of k and lambda is bent, and the filter known to be too sure by 2 to 3 % in standard deviation.
      EXPECT_GT(it.nees, band(9.0 * kRuns).first);
      EXPECT_LT(it.nees, 1.06 * band(9.0 * kRuns).second);
      EXPECT_LT(it.pose, 1.06 * band(6.0 * kRuns).second);
      EXPECT_LT(it.parameters, 1.2);
      const auto nis = band(it.axes);
      EXPECT_GT(it.nis / it.axes, nis.first);
      EXPECT_LT(it.nis / it.axes, nis.second);
    }
}

TEST(ColouredNoise, TakenForWhiteItIsNotConsistent) {
  EXPECT_GT(insert_many(0.9, false, {}).parameters, 2);
  EXPECT_GT(insert_many(0.9, true, {}).parameters, 2);
}

}  // namespace
}  // namespace bevel::estimator
