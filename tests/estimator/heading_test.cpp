// SPDX-License-Identifier: MIT
// The heading as a measurement: derivatives, the update against its closed form, the gate, order, and what is counted.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <numbers>

#include <bevel/estimator/health.hpp>
#include "tests/estimator/play.hpp"

namespace bevel::estimator {
namespace {

using testing::agar_config;
using testing::Insertion;
using testing::InsertionPlan;

Eigen::Vector3d random_vector(std::mt19937_64& rng, double size) {
  std::uniform_real_distribution<double> unit(-1, 1);
  return size * Eigen::Vector3d(unit(rng), unit(rng), unit(rng));
}

// Anywhere in the workspace, with a covariance that correlates everything.
FilterState random_state(const NeedleFilter& filter, std::mt19937_64& rng) {
  FilterState state = filter.initial();
  state.pose.R = model::exp_so3(random_vector(rng, 0.5));
  state.pose.p_mm = Eigen::Vector3d(0, 0, 50) + random_vector(rng, 30);
  std::normal_distribution<double> normal(0, 1);
  const Matrix9d mixed = Matrix9d::NullaryExpr([&] { return 0.3 * normal(rng); }) + Matrix9d::Identity();
  const Vector9d sd = state.covariance.diagonal().cwiseSqrt();
  const Matrix9d P = sd.asDiagonal() * (mixed * mixed.transpose()) * sd.asDiagonal();
  state.covariance = 0.5 * (P + P.transpose());
  return state;
}

model::TipHeading heading_of(const Eigen::Vector3d& along, double sd_rad = 0.02) {
  model::TipHeading m;
  m.utime = testing::kStart_utime;
  m.heading = along.normalized();
  m.information_per_rad2 = (Eigen::Matrix3d::Identity() - m.heading * m.heading.transpose()) / (sd_rad * sd_rad);
  return m;
}

TEST(Heading, DerivativesAreThoseOfPerturbation) {
  for (const bool effects : {false, true}) {
    EstimatorConfig config = agar_config();
    if (effects)
      for (const auto& [name, value] :
           {std::pair("camera_scale", 1.04), {"camera_rotation", 0.05}, {"refraction", 0.03}}) {
        model::ActiveEffect active;
        active.effect = model::find_effect(name);
        ASSERT_NE(active.effect, nullptr) << name;
        active.parameters[0] = value;
        config.effects.push_back(active);
      }
    const NeedleFilter filter(config);
    std::mt19937_64 rng(31);
    double largest = 0;
    for (int trial = 0; trial < 50; ++trial) {
      const FilterState state = random_state(filter, rng);
      const SeenHeading seen = filter.seen_heading(state);
      EXPECT_NEAR(seen.along.norm(), 1, 1e-12);
      if (!effects) {
        EXPECT_LT((seen.along - state.pose.R.col(2)).norm(), 1e-12);
      }
      // Of refraction the direction changes with the place too, by some 1e-4 rad over a standard deviation of it: left
      // out.
      for (int i = effects ? 3 : 0; i < 6; ++i) {
        constexpr double kStep = 1e-5;
        FilterState up = state, down = state;
        move<9>(up, kStep * Vector9d::Unit(i));
        move<9>(down, -kStep * Vector9d::Unit(i));
        const Eigen::Vector3d numeric = (filter.seen_heading(up).along - filter.seen_heading(down).along) / (2 * kStep);
        largest = std::max(largest, (numeric - seen.by_error.col(i)).norm());
      }
    }
    std::printf("largest difference, %s effects: %.1e\n", effects ? "with" : "without", largest);
    EXPECT_LT(largest, 1e-8);
  }
}

// Of what is predicted, by the error of the state: central differences of the innovation.
Eigen::Matrix<double, 3, 9> by_perturbation(const NeedleFilter& filter, const FilterState& at,
                                            const model::TipHeading& measured) {
  Eigen::Matrix<double, 3, 9> H = Eigen::Matrix<double, 3, 9>::Zero();
  for (int i = 0; i < 9; ++i) {
    constexpr double kStep = 1e-6;
    FilterState up = at, down = at;
    move<9>(up, kStep * Vector9d::Unit(i));
    move<9>(down, -kStep * Vector9d::Unit(i));
    H.col(i) = (filter.update(down, measured).innovation - filter.update(up, measured).innovation) / (2 * kStep);
  }
  return H;
}

// Information form, P^-1 + H^T R^-1 H, with H by central differences of the innovation where it is, not at zero.
TEST(Heading, TheUpdateIsTheClosedFormWithDerivativesByPerturbation) {
  const NeedleFilter filter(agar_config());
  std::mt19937_64 rng(32);
  double largest = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const FilterState before = random_state(filter, rng);
    const Eigen::Vector3d ahead = before.pose.R.col(2);
    constexpr double kSd_rad = 0.02;
    const bool one_camera = trial % 2 == 1;
    // One camera: the angle in its picture, which may be far from the heading itself.
    model::TipHeading m =
        one_camera ? testing::picture_heading(ahead, 1, 1, 0, {1, 0, 0}, kSd_rad, rng)
                   : heading_of(model::exp_so3(before.pose.R * Eigen::Vector3d(0.01, -0.02, 0)) * ahead, kSd_rad);
    FilterState after = before;
    const Update update = filter.update(after, m);
    ASSERT_TRUE(update.accepted);
    ASSERT_EQ(update.rank, one_camera ? 1 : 2);
    if (!one_camera) {
      EXPECT_NEAR(update.innovation.head<2>().norm(), std::hypot(0.01, 0.02), 1e-5);
    }
    const auto H = by_perturbation(filter, before, m);
    EXPECT_LT((H.leftCols<3>().norm() + H.rightCols<4>().norm()), 1e-9) << "neither place nor roll nor parameters";
    const Matrix9d P = (before.covariance.inverse() + H.transpose() * H / (kSd_rad * kSd_rad)).inverse();
    const Vector9d correction = P * H.transpose() * update.innovation / (kSd_rad * kSd_rad);
    const Vector9d sd = P.diagonal().cwiseSqrt();
    const Matrix9d off = after.covariance - P;
    largest = std::max(largest, (sd.cwiseInverse().asDiagonal() * off * sd.cwiseInverse().asDiagonal()).norm());
    EXPECT_LT((difference<9>(before, after) - correction).cwiseQuotient(sd).norm(), 1e-6);
    const Eigen::Matrix3d S = H * before.covariance * H.transpose() + kSd_rad * kSd_rad * Eigen::Matrix3d::Identity();
    const double d2 = update.innovation.dot(S.inverse() * update.innovation);
    EXPECT_NEAR(update.mahalanobis2, d2, 1e-6 * d2 + 1e-12);
  }
  std::printf("covariance off by at most %.1e of it\n", largest);
  EXPECT_LT(largest, 1e-6);
}

// The same for cameras that see the shaft, which ends in the direction of motion: lambda takes part.
TEST(Heading, OfTheShaftTheUpdateIsTheClosedFormToo) {
  EstimatorConfig config = agar_config();
  config.shaft_cameras = {0, 3};
  const NeedleFilter filter(config);
  std::mt19937_64 rng(42);
  double largest = 0, by_slip = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const FilterState before = random_state(filter, rng);
    const SeenHeading motion = filter.seen_motion(before).value();
    constexpr double kSd_rad = 0.02;
    model::TipHeading m = trial % 2 == 1 ? testing::picture_heading(motion.along, 1, 1, 0, {1, 0, 0}, kSd_rad, rng)
                                         : heading_of(motion.along, kSd_rad);
    FilterState after = before;
    const Update update = filter.update(after, m);
    ASSERT_TRUE(update.accepted);
    const auto H = by_perturbation(filter, before, m);
    EXPECT_LT(H.leftCols<3>().norm() + H.col(6).norm(), 1e-9) << "neither place nor k";
    by_slip = std::max(by_slip, H.rightCols<2>().norm());
    const Matrix9d P = (before.covariance.inverse() + H.transpose() * H / (kSd_rad * kSd_rad)).inverse();
    const Vector9d sd = P.diagonal().cwiseSqrt();
    const auto off_by = [&](const Matrix9d& other) {
      const Matrix9d off = other - P;
      return (sd.cwiseInverse().asDiagonal() * off * sd.cwiseInverse().asDiagonal()).norm();
    };
    largest = std::max(largest, off_by(after.covariance));
    const DirectionReading linear = filter.made_linear(m, before);
    Eigen::Matrix<double, 3, 9> L = Eigen::Matrix<double, 3, 9>::Zero();
    L.leftCols<6>() = motion.by_error;
    L.rightCols<2>() = motion.by_slip;
    EXPECT_LT(off_by((before.covariance.inverse() + L.transpose() * linear.information_per_rad2 * L).inverse()), 1e-5);
    m.camera = 1;  // not of the shaft
    FilterState other = before;
    EXPECT_TRUE(filter.update(other, m).accepted);
    EXPECT_NE(other.pose.R, after.pose.R);
  }
  std::printf("covariance off by at most %.1e of it\n", largest);
  EXPECT_LT(largest, 1e-6);
  EXPECT_GT(by_slip, 0.1);
}

// A picture's angle as the tracker gives it, vector and information: nothing of the slope out of the picture enters.
TEST(Heading, APicturesAngleIsExactHoweverFarTheNeedlePointsOutOfIt) {
  EstimatorConfig config = agar_config();
  std::mt19937_64 rng(43);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const bool of_shaft : {false, true}) {
    config.shaft_cameras = of_shaft ? std::vector<int>{0} : std::vector<int>{};
    const NeedleFilter filter(config);
    for (int trial = 0; trial < 100; ++trial) {
      FilterState state = random_state(filter, rng);
      state.pose.R = model::exp_so3({0.5 * unit(rng), 0.5 * unit(rng), 0});  // x out of the picture y-z
      const Eigen::Vector3d h = of_shaft ? filter.seen_motion(state).value().along : state.pose.R.col(2).eval();
      const double in_picture = std::atan2(h.y(), h.z()), measured = in_picture + 0.05 * unit(rng);
      model::TipHeading m;
      m.heading = {0, std::sin(measured), std::cos(measured)};
      const Eigen::Vector3d across(0, m.heading.z(), -m.heading.y());
      m.information_per_rad2 = across * across.transpose() / (0.02 * 0.02);
      const Update update = filter.update(state, m);
      ASSERT_EQ(update.rank, 1);
      EXPECT_NEAR(std::abs(update.innovation[0]), std::abs(measured - in_picture), 1e-12);
    }
  }
}

// What the past is run again with says of a heading what the update does, near the state about which it was made.
TEST(Heading, MadeLinearItSaysTheSame) {
  const NeedleFilter filter(agar_config());
  std::mt19937_64 rng(39);
  for (int trial = 0; trial < 50; ++trial) {
    const FilterState before = random_state(filter, rng);
    const Eigen::Vector3d ahead = before.pose.R.col(2);
    const model::TipHeading m = trial % 2 == 1 ? testing::picture_heading(ahead, 1, 1, 0, {0, 1, 0}, 0.02, rng)
                                               : testing::measure_heading(ahead, 1, 1, 0, 0.02, rng);
    FilterState after = before;
    ASSERT_TRUE(filter.update(after, m).accepted);
    const DirectionReading linear = filter.made_linear(m, before);
    const Eigen::Matrix3d& W = linear.information_per_rad2;
    EXPECT_LT((W * ahead).norm(), 1e-9 * W.trace());
    Eigen::Matrix<double, 3, 9> H = Eigen::Matrix<double, 3, 9>::Zero();
    H.leftCols<6>() = filter.seen_heading(before).by_error;
    const Matrix9d P = (before.covariance.inverse() + H.transpose() * W * H).inverse();
    const Vector9d sd = P.diagonal().cwiseSqrt();
    const Vector9d correction = P * H.transpose() * W * (linear.seen - ahead);
    EXPECT_LT((difference<9>(before, after) - correction).cwiseQuotient(sd).norm(), 1e-6);
  }
}

TEST(Heading, OneThatPointsBackwardsIsRefusedWhateverItClaims) {
  const NeedleFilter filter(agar_config());
  std::mt19937_64 rng(33);
  for (int trial = 0; trial < 20; ++trial)
    for (const double sd_rad : {1e-3, 0.02, 0.5, 3.0})
      for (const double off_rad : {0.0, 1e-9, 0.3, 1.5}) {
        const FilterState before = random_state(filter, rng);
        const Eigen::Matrix3d off = model::exp_so3(before.pose.R * Eigen::Vector3d(off_rad, 0, 0));
        for (const bool one_camera : {false, true}) {
          model::TipHeading m = heading_of(-(off * before.pose.R.col(2)), sd_rad);
          if (one_camera) {
            const Eigen::Vector3d across = m.heading.cross(Eigen::Vector3d::UnitX()).normalized();
            m.information_per_rad2 = across * across.transpose() / (sd_rad * sd_rad);
          }
          FilterState after = before;
          const Update update = filter.update(after, m);
          EXPECT_FALSE(update.accepted) << sd_rad << " " << off_rad;
          EXPECT_GT(update.test_ratio, 1);
          EXPECT_TRUE(std::isfinite(update.test_ratio));
          EXPECT_EQ(after.pose.R, before.pose.R);
          EXPECT_EQ(after.covariance, before.covariance);
          EXPECT_EQ(after.heading_rejects_in_row, 1);
          EXPECT_EQ(after.rejects_in_row, 0);
        }
      }
}

TEST(Heading, ASensorThatIsTurnedAboutIsSaidAndThrowsNothingAway) {
  std::mt19937_64 rng(34);
  const EstimatorConfig config = agar_config();
  InsertionPlan plan;
  plan.heading_sd_rad = 0.02;
  Insertion data = testing::insert(config.prior.needle, {}, plan, rng);
  Insertion without = data;
  without.headings.clear();
  for (auto& m : data.headings) m.heading *= -1;
  NeedleEstimator estimator(config), alone(config);
  testing::play(estimator, data);
  testing::play(alone, without);
  const auto now = data.actuators.back().utime;
  const Estimate estimate = estimator.estimate(now);
  EXPECT_EQ(estimate.health, kRejecting) << describe_health(estimate.health);
  EXPECT_EQ(estimate.state.reset_count, 0);
  EXPECT_EQ(estimate.state.rejects_in_row, 0);
  EXPECT_LT((estimate.state.pose.p_mm - alone.estimate(now).state.pose.p_mm).norm(), 1e-3);
  for (auto& m : data.headings) m.heading *= -1;
  NeedleEstimator right(config);
  testing::play(right, data);
  EXPECT_EQ(right.estimate(now).health, kHealthy) << describe_health(right.estimate(now).health);
}

TEST(Heading, NotUsableOldAndTwiceAreCountedApartFromPositions) {
  std::mt19937_64 rng(35);
  const EstimatorConfig config = agar_config();
  InsertionPlan plan;
  plan.heading_sd_rad = 0.02;
  const Insertion data = testing::insert(config.prior.needle, {}, plan, rng);
  NeedleEstimator estimator(config);
  testing::play(estimator, data);
  const auto now = data.actuators.back().utime;
  const FilterState before = estimator.estimate(now).state;
  model::TipHeading unusable = data.headings.back();
  unusable.seq += 1;
  unusable.status = 1;
  estimator.add(unusable);
  unusable.status = 0;
  unusable.information_per_rad2.setZero();
  estimator.add(unusable);
  estimator.add(data.headings.back());
  estimator.add(data.headings.front());
  const Counters& counters = estimator.counters();
  EXPECT_EQ(counters.headings.offered, static_cast<std::int64_t>(data.headings.size()) + 4);
  EXPECT_EQ(counters.headings.not_usable, 2);
  EXPECT_EQ(counters.headings.duplicate, 1);
  EXPECT_EQ(counters.headings.too_old, 1);
  EXPECT_EQ(counters.positions.offered, static_cast<std::int64_t>(data.measurements.size()));
  EXPECT_EQ(counters.positions.not_usable + counters.positions.duplicate + counters.positions.too_old, 0);
  EXPECT_EQ(estimator.estimate(now).state.covariance, before.covariance);
  EXPECT_EQ(estimator.estimate(now).state.pose.R, before.pose.R);
}

TEST(Heading, ShuffledInputGivesTheSameStateBitForBit) {
  std::mt19937_64 rng(36);
  const EstimatorConfig config = agar_config();
  InsertionPlan plan;
  plan.cameras = 2;
  plan.length_mm = 20;
  plan.heading_sd_rad = 0.02;
  const Insertion data = testing::insert(config.prior.needle, {}, plan, rng);
  NeedleEstimator sorted(config, 4096), shuffled(config, 4096);
  testing::play(sorted, data);
  testing::play_shuffled(shuffled, data, rng);
  const auto now = data.actuators.back().utime;
  const FilterState a = sorted.estimate(now).state, b = shuffled.estimate(now).state;
  EXPECT_GT(shuffled.counters().headings.late, 50);
  EXPECT_EQ(shuffled.counters().headings.too_old, 0);
  EXPECT_EQ(a.pose.p_mm, b.pose.p_mm);
  EXPECT_EQ(a.pose.R, b.pose.R);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.lambda2, b.lambda2);
}

// Headings at the rate of the axes: what leaves the history is still joined to few steps, and nothing of it is lost.
TEST(Heading, ThePastIsRunAgainWithItsHeadingsHoweverMany) {
  std::mt19937_64 rng(37);
  EstimatorConfig config = agar_config();
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};
  const model::NeedleParameters truth = config.prior.needle;
  Insertion data = testing::insert(truth, {}, {}, rng);
  for (std::size_t i = 0; i < data.actuators.size(); ++i)
    data.headings.push_back(testing::measure_heading(data.poses[i].R.col(2), data.actuators[i].utime,
                                                     static_cast<std::int64_t>(i), 7, 0.05, rng));
  EstimatorConfig once = config;
  once.relinearised_steps = 0;
  NeedleEstimator estimator(config), linear(once);
  testing::play(estimator, data);
  testing::play(linear, data);
  const auto now = data.actuators.back().utime;
  const FilterState a = estimator.estimate(now).state, b = linear.estimate(now).state;
  EXPECT_GT(estimator.counters().relinearised, 2);
  // The needle is the prior's mean: derivatives taken once are near those of the path, and both see the same.
  const Vector9d ratio = (a.covariance.diagonal().array() / b.covariance.diagonal().array()).sqrt();
  std::cout << "standard deviations, past run again over once: " << ratio.transpose() << "\n";
  EXPECT_GT(ratio.minCoeff(), 0.9);
  EXPECT_LT(ratio.maxCoeff(), 1.1);
  EXPECT_LT(testing::nees_of(a, data.final_pose, truth), 25);
}

TEST(Heading, AHundredThousandStepsStayPositiveDefiniteAndSymmetric) {
  const NeedleFilter filter(agar_config());
  FilterState state = filter.initial();
  std::mt19937_64 rng(38);
  for (int i = 0; i < 100'000; ++i) {
    filter.predict(state, (i / 400) % 2 ? -0.1 : 0.1, 0.01);
    if (i % 3 == 0) filter.update(state, testing::measure(state.pose.p_mm, i, i, 0, {1, 1, 1}, 0.1, rng));
    if (i % 3 == 1)
      filter.update(state, i % 2 ? testing::measure_heading(state.pose.R.col(2), i, i, 0, 0.01, rng)
                                 : testing::picture_heading(state.pose.R.col(2), i, i, 0, {1, 0, 0}, 0.01, rng));
    if (i % 10'000 == 0) {
      ASSERT_TRUE(state.covariance.allFinite());
      ASSERT_EQ(state.covariance, state.covariance.transpose());
      ASSERT_GT(Eigen::SelfAdjointEigenSolver<Matrix9d>(state.covariance).eigenvalues()[0], 0) << i;
    }
  }
}

}  // namespace
}  // namespace bevel::estimator
