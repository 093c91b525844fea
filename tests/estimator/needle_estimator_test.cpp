// SPDX-License-Identifier: MIT
#include <bevel/estimator/needle_estimator.hpp>

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <iostream>
#include <numbers>

#include <bevel/estimator/health.hpp>
#include "tests/estimator/batch_map.hpp"
#include "tests/estimator/play.hpp"

namespace bevel::estimator {
namespace {

using testing::agar_config;
using testing::Insertion;
using testing::InsertionPlan;
using testing::play;

TEST(NeedleEstimator, TwoHundredInsertionsAreConsistent) {
  constexpr int kRuns = 200;
  constexpr unsigned kSeed = 4;
  EstimatorConfig config = agar_config();
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};  // the plant is the model: no process noise to cover
  double nees = 0, nis = 0, batch_nees = 0;
  double squares = 0, batch_squares = 0;
  int measurements = 0, axes = 0, redrawn = 0;
  std::mt19937_64 rng(kSeed);
  for (int run = 0; run < kRuns; ++run) {
    InsertionPlan plan;
    plan.cameras = 1 + run % 2;
    plan.lost_share = 0.1;
    const auto [truth, data, again] = testing::draw_insertion(config.prior, plan, rng);
    redrawn += again;
    NeedleEstimator estimator(config);
    struct Sum {
      double d2 = 0;
      int n = 0, axes = 0;
    } sum;
    estimator.observe(
        [](void* context, const NeedleEstimator::Applied& a) {
          auto& s = *static_cast<Sum*>(context);
          s.d2 += a.update.mahalanobis2, s.axes += a.update.rank, ++s.n;
        },
        &sum);
    play(estimator, data, 50'000);
    const FilterState state = estimator.estimate(data.actuators.back().utime).state;
    nees += testing::nees_of(state, data.final_pose, truth);
    const FilterState batch = testing::solve_batch_map(config, data).state;
    batch_nees += testing::nees_of(batch, data.final_pose, truth);
    squares += testing::error_of(state, data.final_pose, truth).head<3>().squaredNorm();
    batch_squares += testing::error_of(batch, data.final_pose, truth).head<3>().squaredNorm();
    nis += sum.d2, measurements += sum.n, axes += sum.axes;
  }
  // Sums of squares of independent unit normals if the filter is consistent: 9 per run, `axes` innovations.
  const auto band = [](double dof) {
    const boost::math::chi_squared chi2(dof);
    return std::pair(boost::math::quantile(chi2, 0.025) / dof, boost::math::quantile(chi2, 0.975) / dof);
  };
  const auto nees_band = band(9.0 * kRuns);
  const auto nis_band = band(axes);
  std::cout << "seed " << kSeed << ", " << kRuns << " insertions, " << measurements << " measurements\n"
            << "NEES/9   " << nees / (9.0 * kRuns) << "  95 % band [" << nees_band.first << ", " << nees_band.second
            << "]\n"
            << "NIS/axis " << nis / axes << "  95 % band [" << nis_band.first << ", " << nis_band.second << "]\n";
  std::cout << "NEES/9   " << batch_nees / (9.0 * kRuns) << "  of the batch maximum a posteriori on the same data\n"
            << "RMSE of the tip at the end over the batch's: " << std::sqrt(squares / batch_squares) << "\n"
            << redrawn << " insertions redrawn: they left the model's domain\n";
  EXPECT_GT(nis / axes, nis_band.first);
  EXPECT_LT(nis / axes, nis_band.second);
  EXPECT_LT(std::sqrt(squares / batch_squares), 1.05);
  // The posterior of (k, lambda1, lambda2) is bent: the batch's covariance is too small by what it prints above.
  EXPECT_GT(nees / (9.0 * kRuns), nees_band.first);
  EXPECT_LT(nees / (9.0 * kRuns), nees_band.second);
}

TEST(NeedleEstimator, ANarrowerPriorOfLambdaIsConsistentToo) {
  constexpr int kRuns = 200;
  constexpr unsigned kSeed = 4;
  EstimatorConfig config = agar_config();
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};
  config.prior.lambda1_sd_per_rad *= 0.3;
  config.prior.lambda2_sd *= 0.3;
  std::mt19937_64 rng(kSeed);
  double nees = 0;
  for (int run = 0; run < kRuns; ++run) {
    const auto truth = testing::draw_needle(config.prior, rng);
    InsertionPlan plan;
    plan.cameras = 1 + run % 2;
    plan.lost_share = 0.1;
    const Insertion data = testing::insert(truth, testing::draw_start(config.prior, rng), plan, rng);
    ASSERT_TRUE(data.in_domain);
    NeedleEstimator estimator(config);
    play(estimator, data, 50'000);
    const FilterState state = estimator.estimate(data.actuators.back().utime).state;
    nees += testing::nees_of(state, data.final_pose, truth);
  }
  const boost::math::chi_squared chi2(9.0 * kRuns);
  std::cout << "seed " << kSeed << ": NEES/9 " << nees / (9.0 * kRuns) << "\n";
  EXPECT_GT(nees, boost::math::quantile(chi2, 0.025));
  EXPECT_LT(nees, boost::math::quantile(chi2, 0.975));
}

TEST(NeedleEstimator, ShuffledInputGivesTheSameStateBitForBit) {
  std::mt19937_64 rng(7);
  EstimatorConfig config = agar_config();
  InsertionPlan plan;
  plan.cameras = 2;
  plan.length_mm = 20;
  const Insertion data = testing::insert(config.prior.needle, {}, plan, rng);
  NeedleEstimator sorted(config, 1024), shuffled(config, 1024);
  play(sorted, data);
  play_shuffled(shuffled, data, rng);

  const auto now = data.actuators.back().utime;
  const FilterState a = sorted.estimate(now).state, b = shuffled.estimate(now).state;
  EXPECT_GT(shuffled.counters().positions.late, 50);
  EXPECT_EQ(shuffled.counters().positions.too_old, 0);
  EXPECT_EQ(a.pose.p_mm, b.pose.p_mm);
  EXPECT_EQ(a.pose.R, b.pose.R);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.lambda2, b.lambda2);
}

TEST(NeedleEstimator, OlderThanTheHistoryIsRefusedAndCounted) {
  std::mt19937_64 rng(8);
  EstimatorConfig config = agar_config();
  const Insertion data = testing::insert(config.prior.needle, {}, {}, rng);
  NeedleEstimator estimator(config, 64);
  play(estimator, data);
  const FilterState before = estimator.estimate(data.actuators.back().utime).state;
  estimator.add(data.measurements[3]);
  EXPECT_EQ(estimator.counters().positions.too_old, 1);
  EXPECT_EQ(estimator.estimate(data.actuators.back().utime).state.pose.p_mm, before.pose.p_mm);
  model::TipMeasurement unusable = data.measurements.back();
  unusable.status = 1;
  estimator.add(unusable);
  EXPECT_EQ(estimator.counters().positions.not_usable, 1);
  estimator.add(data.measurements.back());
  EXPECT_EQ(estimator.counters().positions.duplicate, 1);
}

TEST(NeedleEstimator, MeasurementsWithoutActuatorsKeepTheAnchor) {
  EstimatorConfig config = agar_config();
  NeedleEstimator estimator(config, 16);
  std::mt19937_64 rng(3);
  model::ActuatorState a;
  a.utime = testing::kStart_utime;
  estimator.add(a);
  for (int i = 1; i < 100; ++i)
    estimator.add(testing::measure({0, 0, 0}, a.utime + std::int64_t{1000} * i, i, 0, {1, 1, 1}, 0.1, rng));
  EXPECT_GT(estimator.counters().positions.too_old, 0);
  EXPECT_TRUE(estimator.estimate(a.utime).state.pose.p_mm.allFinite());
  EXPECT_GT(estimator.estimate(a.utime).state.covariance(0, 0), 0);
}

TEST(NeedleEstimator, AJumpOfThreeFramesIsRejectedAndOneForEverIsADeclaredReset) {
  for (const bool for_ever : {false, true}) {
    std::mt19937_64 rng(11);
    EstimatorConfig config = agar_config();
    Insertion data = testing::insert(config.prior.needle, {}, {}, rng);
    const std::size_t from = data.measurements.size() / 2;
    for (std::size_t i = from; i < (for_ever ? data.measurements.size() : from + 3); ++i)
      data.measurements[i].position_mm += Eigen::Vector3d(5, 0, 0);
    NeedleEstimator estimator(config);
    play(estimator, data);
    const Estimate estimate = estimator.estimate(data.actuators.back().utime);
    EXPECT_EQ(estimate.state.reset_count, for_ever ? 1 : 0);
    EXPECT_EQ(estimate.state.reset_cause, for_ever ? ResetCause::measurements_rejected : ResetCause::none);
    EXPECT_EQ(estimate.health, kHealthy) << describe_health(estimate.health);
    const Eigen::Vector3d seen = data.final_pose.p_mm + Eigen::Vector3d(for_ever ? 5 : 0, 0, 0);
    EXPECT_LT((estimate.state.pose.p_mm - seen).norm(), 0.4);
  }
}

// Two outliers in a row are a doubt that the next good reading takes away; six are no outliers.
TEST(NeedleEstimator, DoubtsBeforeItIsLost) {
  for (const int spoiled : {1, 2, 5, 6}) {
    std::mt19937_64 rng(12);
    EstimatorConfig config = agar_config();
    Insertion data = testing::insert(config.prior.needle, {}, {}, rng);
    const std::size_t from = data.measurements.size() / 2;
    for (int i = 0; i < spoiled; ++i)
      data.measurements[from + static_cast<std::size_t>(i)].position_mm += Eigen::Vector3d(5, -3, 0);
    NeedleEstimator estimator(config);
    std::size_t next = 0;
    std::int32_t said = kHealthy, last = kHealthy;
    for (const auto& actuator : data.actuators) {
      for (; next < data.measurements.size() && data.measurements[next].utime < actuator.utime; ++next)
        estimator.add(data.measurements[next]);
      estimator.add(actuator);
      if (next <= from) continue;
      last = estimator.estimate(actuator.utime).health;
      said |= last;
    }
    EXPECT_EQ(said & kUnsure, spoiled >= 2 ? kUnsure : 0) << spoiled;
    EXPECT_EQ(lost(said), spoiled >= 6 ? kRejecting : 0) << spoiled << ": " << describe_health(said);
    EXPECT_EQ(last, kHealthy) << spoiled << ": " << describe_health(last);
  }
}

// A bevel that was mounted the wrong way round. Of a k that is known the side is what is wrong, and a declared reset
// puts it right; of one that is hardly known, k is held at straight.
TEST(NeedleEstimator, TheCurvatureNeverChangesItsSideWithoutADeclaredReset) {
  for (const double side : {1.0, -1.0})
    for (const bool known : {true, false}) {
      std::mt19937_64 rng(13);
      EstimatorConfig config = agar_config();
      config.prior.needle.curvature_per_mm *= side;
      config.prior.curvature_sd_per_mm = known ? 0.001 : 0.003;
      model::NeedleParameters truth = config.prior.needle;
      truth.curvature_per_mm *= -1;
      InsertionPlan plan;
      plan.rotation_rate_rad_s = 0.2;
      const Insertion data = testing::insert(truth, {}, plan, rng);
      NeedleEstimator estimator(config);
      std::size_t next = 0;
      for (const auto& actuator : data.actuators) {
        while (next < data.measurements.size() && data.measurements[next].utime < actuator.utime)
          estimator.add(data.measurements[next++]);
        estimator.add(actuator);
        const Estimate now = estimator.estimate(actuator.utime);
        ASSERT_GT(side * now.state.curvature_per_mm, 0);
        if (now.state.reset_count > 0 && actuator.utime - now.state.reset_utime < 500'000) {
          EXPECT_EQ(now.state.reset_cause, ResetCause::bevel_turned_over);
          if (actuator.utime - now.state.reset_utime < 200'000) {  // for so long the cause is in the health word
            EXPECT_NE(describe_health(now.health).find("reset: the bevel is on the other side"), std::string::npos);
          }
        }
      }
      const Estimate end = estimator.estimate(data.actuators.back().utime);
      EXPECT_EQ(end.state.reset_count, known ? 1 : 0);
      EXPECT_LT((end.state.pose.p_mm - data.final_pose.p_mm).norm(), 0.3);
      if (!known) {
        EXPECT_LT(std::abs(end.state.curvature_per_mm), 0.2 * std::abs(truth.curvature_per_mm));
        continue;
      }
      EXPECT_EQ(end.health, kHealthy) << describe_health(end.health);
      EXPECT_NEAR(end.state.curvature_per_mm, -truth.curvature_per_mm, 3 * std::sqrt(end.state.covariance(6, 6)));
      // The bevel is where it is: half a turn from where it was thought to be.
      const Eigen::Matrix3d between = data.final_pose.R.transpose() * end.state.pose.R;
      EXPECT_NEAR(std::abs(std::atan2(between(1, 0), between(0, 0))), std::numbers::pi, 0.1);
    }
}

TEST(NeedleEstimator, ASingleCameraLeavesItsOpticalAxisToTheModel) {
  std::mt19937_64 rng(12);
  EstimatorConfig config = agar_config();
  InsertionPlan plan;
  plan.rotation_rate_rad_s = 0;
  plan.cameras = 2;
  Insertion data = testing::insert(config.prior.needle, {}, plan, rng);
  std::erase_if(data.measurements, [](const auto& m) { return m.camera == 1; });
  NeedleEstimator estimator(config);
  play(estimator, data);
  const FilterState state = estimator.estimate(data.actuators.back().utime).state;
  const Eigen::Matrix3d position = state.pose.R * state.covariance.topLeftCorner<3, 3>() * state.pose.R.transpose();
  EXPECT_GT(std::sqrt(position(0, 0)), 5 * std::sqrt(position(1, 1)));  // x unseen: tilt and roll of the prior
  // Roll is hardly observable from a planar insertion: its variance must not fall below a good part of the prior.
  EXPECT_GT(std::sqrt(state.covariance(5, 5)), 0.5 * config.prior.roll_sd_rad);
}

TEST(NeedleEstimator, AMeasurementOfTheNewestActuatorStatesOwnInstantIsAppliedAtOnce) {
  NeedleEstimator estimator(agar_config());
  std::mt19937_64 rng(15);
  model::ActuatorState a;
  a.utime = testing::kStart_utime;
  estimator.add(a);
  estimator.add(testing::measure({0, 0, 0}, a.utime, 0, 0, {0, 1, 1}, 0.1, rng));
  estimator.add(testing::measure({0, 0, 0}, a.utime, 1, 1, {1, 0, 1}, 0.1, rng));
  EXPECT_EQ(estimator.estimate(a.utime).state.measurement_utime, a.utime);
  EXPECT_EQ(estimator.estimate(a.utime).newest_update.rank, 2);
}

TEST(NeedleEstimator, AheadIsWhatTheNextActuatorStateWouldGiveAndLeavesNoTrace) {
  constexpr unsigned kSeed = 21;
  std::mt19937_64 rng(kSeed);
  const EstimatorConfig config = agar_config();
  InsertionPlan plan;
  plan.cameras = 2;
  const Insertion data = testing::draw_insertion(config.prior, plan, rng).data;
  NeedleEstimator estimator(config), looked_ahead(config);
  int waited = 0;
  std::size_t next = 0;
  for (const model::ActuatorState& axes : data.actuators) {
    // What was measured since the actuator state before waits for this one.
    for (; next < data.measurements.size() && data.measurements[next].utime < axes.utime; ++next) {
      estimator.add(data.measurements[next]);
      looked_ahead.add(data.measurements[next]);
      ++waited;
    }
    const Estimate ahead = looked_ahead.estimate_ahead(axes, axes.utime);
    const std::int64_t runs = estimator.counters().relinearised;
    estimator.add(axes);
    looked_ahead.add(axes);
    const Estimate then = estimator.estimate(axes.utime), now = looked_ahead.estimate(axes.utime);
    ASSERT_EQ(now.state.covariance, then.state.covariance);
    ASSERT_EQ(now.state.pose.p_mm, then.state.pose.p_mm);
    if (&axes == &data.actuators.front()) continue;  // there was nothing to look ahead from
    ASSERT_EQ(ahead.utime, then.utime);
    ASSERT_EQ(ahead.state.measurement_utime, then.state.measurement_utime);
    ASSERT_EQ(ahead.health, then.health);
    // The positions between are interpolated along the way and not anew for each: the same but for rounding, and but
    // for the past that a new node may have run again.
    if (estimator.counters().relinearised > runs) continue;
    ASSERT_NEAR((ahead.tip.p_mm - then.tip.p_mm).norm(), 0, 1e-9);
    ASSERT_NEAR((ahead.state.covariance - then.state.covariance).norm(), 0, 1e-9);
  }
  EXPECT_GT(waited, 500);
}

TEST(NeedleEstimator, AnActuatorStateThatFindsTheHistoryFullOfWaitingMeasurementsIsTaken) {
  std::mt19937_64 rng(16);
  constexpr std::size_t kHistory = 16;
  NeedleEstimator estimator(agar_config(), kHistory);
  model::ActuatorState a;
  a.utime = testing::kStart_utime;
  estimator.add(a);
  // More measurements than there is room for, all newer than the axes: the oldest of them go, the anchor stays.
  for (int i = 1; i <= 40; ++i)
    estimator.add(testing::measure({0, 0, 0.1 * i}, a.utime + std::int64_t{1000} * i, i, 0, {1, 1, 1}, 0.1, rng));
  EXPECT_EQ(estimator.estimate(a.utime).state.measurement_utime, 0);
  a.utime += 40'000;
  a.insertion_mm = 4;
  estimator.add(a);
  const Estimate estimate = estimator.estimate(a.utime);
  EXPECT_EQ(estimate.utime, a.utime);
  EXPECT_EQ(estimate.state.measurement_utime, a.utime);
  EXPECT_NEAR(estimate.state.pose.p_mm.z(), 4, 0.1);
  EXPECT_EQ(estimator.counters().actuators_refused, 0);
  EXPECT_GT(estimator.counters().positions.too_old, 20);
}

TEST(NeedleEstimator, ZeroWidthPriorsKeepTheBicycle) {
  std::mt19937_64 rng(13);
  EstimatorConfig config;
  config.prior.lambda1_sd_per_rad = config.prior.lambda2_sd = 0;
  const Insertion data = testing::insert(config.prior.needle, {}, {}, rng);
  NeedleEstimator estimator(config);
  play(estimator, data);
  const FilterState state = estimator.estimate(data.actuators.back().utime).state;
  EXPECT_EQ(state.lambda1_per_rad, 0.0);
  EXPECT_EQ(state.lambda2, 0.0);
  EXPECT_NEAR(state.curvature_per_mm, config.prior.needle.curvature_per_mm, 5e-4);
}

TEST(NeedleEstimator, AMillionStepsStayPositiveDefiniteAndSymmetric) {
  EstimatorConfig config = agar_config();
  const NeedleFilter filter(config);
  FilterState state = filter.initial();
  std::mt19937_64 rng(14);
  for (int i = 0; i < 1'000'000; ++i) {
    // Back and forth over 40 mm, turning slowly.
    filter.predict(state, (i / 400) % 2 ? -0.1 : 0.1, 0.01);
    if (i % 3 == 0) {
      auto m = testing::measure(state.pose.p_mm, i, i, i % 2,
                                i % 2 ? Eigen::Vector3d(1, 0, 1) : Eigen::Vector3d(0, 1, 1), 0.1, rng);
      filter.update(state, m);
    }
    if (i % 50'000 == 0) {
      ASSERT_TRUE(state.covariance.allFinite());
      ASSERT_EQ(state.covariance, state.covariance.transpose());
      ASSERT_GT(Eigen::SelfAdjointEigenSolver<Matrix9d>(state.covariance).eigenvalues()[0], 0) << i;
    }
  }
}

}  // namespace
}  // namespace bevel::estimator
