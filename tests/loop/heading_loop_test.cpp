// SPDX-License-Identifier: MIT
// The loop with a sensor in the needle that tells its heading: it arrives, and false headings stop it.
#include <gtest/gtest.h>

#include <iostream>

#include <bevel/error.hpp>
#include <bevel/estimator/health.hpp>
#include <bevel/io/config.hpp>
#include "tests/loop/simulated_loop.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel {
namespace {

using test::SimulatedLoop;
constexpr unsigned kSeed = 9;
const Eigen::Vector3d kTarget(6, -9, 100);

nodes::SystemConfig with_heading(double sd_rad) {
  nodes::SystemConfig config = test::loop_config();
  config.rig.heading.sd_rad = sd_rad;
  return config;
}

// Of the model of the simulated loop's heading, by hand.
tip_heading_t message_of(const SimulatedLoop& loop, const Eigen::Vector3d& ahead, std::int64_t seq, int camera) {
  model::TipHeading m;
  m.utime = loop.utime();
  m.seq = seq;
  m.camera = camera;
  m.heading = ahead.normalized();
  m.information_per_rad2 = 2500 * (Eigen::Matrix3d::Identity() - m.heading * m.heading.transpose());
  return io::to_message(m);
}

TEST(HeadingLoop, SteersToATargetAndKnowsItsHeadingBetterThanWithout) {
  std::array<double, 2> tilt_sd_rad{}, lambda2_sd{};
  for (const bool sensor : {false, true}) {
    SimulatedLoop loop(kSeed, with_heading(sensor ? 0.02 : 0));
    ASSERT_EQ(loop.steer_to(kTarget), "");
    ASSERT_TRUE(loop.run(60, [&loop] { return loop.state() != controller::State::steering; }));
    EXPECT_EQ(loop.state(), controller::State::hold) << controller::to_string(loop.reason());
    loop.run(0.5);
    const auto estimate = loop.estimator->estimator().estimate(loop.utime());
    const auto& counters = loop.estimator->estimator().counters();
    const double miss_mm = (loop.tip() - kTarget).norm();
    const auto i = static_cast<std::size_t>(sensor);
    tilt_sd_rad.at(i) = std::sqrt(estimate.state.covariance(3, 3));
    lambda2_sd.at(i) = std::sqrt(estimate.state.covariance(8, 8));
    std::cout << "seed " << kSeed << (sensor ? ", with" : ", without") << " headings: tip to target " << miss_mm
              << " mm, tilt +- " << tilt_sd_rad.at(i) << " rad, lambda2 +- " << lambda2_sd.at(i) << ", "
              << counters.headings.offered << " headings\n";
    EXPECT_LT(miss_mm, 0.8);
    EXPECT_EQ(counters.headings.offered > 300, sensor);
    EXPECT_EQ(counters.headings.not_usable + counters.headings.duplicate, 0);
    if (sensor) {  // too old: from before the first actuator state, as of each of the two cameras
      EXPECT_NEAR(static_cast<double>(counters.headings.too_old), 0.5 * static_cast<double>(counters.positions.too_old),
                  2);
    }
    EXPECT_EQ(estimate.state.heading_rejects_in_row, 0);
    const Eigen::Vector3d ahead = loop.rig->plant().tip().R.col(2);
    EXPECT_LT((estimate.state.pose.R.col(2) - ahead).norm(), 4 * std::sqrt(2) * tilt_sd_rad.at(i));
  }
  EXPECT_LT(tilt_sd_rad[1], tilt_sd_rad[0]);
  EXPECT_LT(lambda2_sd[1], lambda2_sd[0]);
}

// To the last bit, by its minors in more digits than it has: what rounds below zero is no inverse of a covariance.
TEST(HeadingLoop, ItsInformationIsPositiveSemidefiniteAndZeroAlongTheHeading) {
  constexpr double kSd_rad = 0.02;
  int headings = 0;
  for (const std::int64_t seed : {1, 2, 3}) {
    nodes::SystemConfig config = with_heading(kSd_rad);
    config.rig.seed = seed;
    SimulatedLoop loop(kSeed, config);
    loop.port.subscribe<tip_heading_t>(io::channel::kTipHeading, [&headings](const tip_heading_t& m) {
      using Matrix = Eigen::Matrix<long double, 3, 3>;
      const Matrix W = Eigen::Map<const Eigen::Matrix3d>(m.information_per_rad2).cast<long double>();
      EXPECT_EQ(W, W.transpose());
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        EXPECT_GE(W(i, i), 0);
        EXPECT_GE(W(i, i) * W(j, j) - W(i, j) * W(j, i), 0);
      }
      EXPECT_GE(W.row(0).dot(W.row(1).cross(W.row(2))), 0) << Eigen::Vector3d::Map(m.heading).transpose();
      const Eigen::Vector3d h = Eigen::Vector3d::Map(m.heading);
      const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - h * h.transpose()) / (kSd_rad * kSd_rad);
      EXPECT_LT((W.cast<double>() - across).norm(), 1e-14 * across.norm());
      ++headings;
    });
    loop.run(2);
  }
  std::cout << headings << " headings of seeds 1, 2, 3\n";
  EXPECT_GT(headings, 150);
}

TEST(HeadingLoop, TheSameSeedGivesTheSameHeadings) {
  const auto headings = [](std::int64_t seed) {
    nodes::SystemConfig config = with_heading(0.02);
    config.rig.seed = seed;
    SimulatedLoop loop(kSeed, config);
    std::vector<double> said;
    loop.port.subscribe<tip_heading_t>(io::channel::kTipHeading,
                                       [&said](const tip_heading_t& m) { said.push_back(m.heading[0]); });
    loop.run(1);
    return said;
  };
  const auto once = headings(3);
  EXPECT_NEAR(static_cast<double>(once.size()), 30, 1);
  EXPECT_EQ(once, headings(3));
  EXPECT_NE(once, headings(4));
}

TEST(HeadingLoop, ASensorThatPointsBackwardsIsRefusedAndStopsTheNeedle) {
  SimulatedLoop loop(kSeed);
  ASSERT_EQ(loop.steer_to(kTarget), "");
  loop.run(3);
  const Eigen::Vector3d before = loop.estimator->estimator().estimate(loop.utime()).state.pose.R.col(2);
  std::int64_t seq = 0;
  loop.run(1, [&] {
    if (loop.ms % 33 == 0)
      loop.port.publish(io::channel::kTipHeading, message_of(loop, -loop.rig->plant().tip().R.col(2), seq++, 4));
    return loop.state() == controller::State::stopped;
  });
  EXPECT_EQ(loop.reason(), controller::Reason::state_unhealthy);
  EXPECT_NE(loop.needle_state->health & estimator::kRejecting, 0);
  EXPECT_EQ(loop.needle_state->reset_count, 0);
  EXPECT_LT((loop.estimator->estimator().estimate(loop.utime()).state.pose.R.col(2) - before).norm(), 0.1);
}

TEST(HeadingLoop, AFrozenSensorStopsTheNeedleASilentOneDoesNot) {
  SimulatedLoop loop(kSeed);
  ASSERT_EQ(loop.steer_to(kTarget), "");
  loop.run(1);
  std::int64_t seq = 0;
  loop.port.publish(io::channel::kTipHeading, message_of(loop, loop.rig->plant().tip().R.col(2), seq++, 4));
  loop.run(1);
  EXPECT_EQ(loop.state(), controller::State::steering) << "silent since";
  const Eigen::Vector3d frozen = loop.rig->plant().tip().R.col(2);
  loop.run(1, [&] {
    if (loop.ms % 33 == 0) loop.port.publish(io::channel::kTipHeading, message_of(loop, frozen, seq++, 4));
    return loop.state() == controller::State::stopped;
  });
  EXPECT_EQ(loop.state(), controller::State::stopped);
  EXPECT_NE(loop.needle_state->health & estimator::kCameraFrozen, 0);
}

TEST(HeadingLoop, ASecondSenderOfHeadingsIsDeclared) {
  SimulatedLoop loop(kSeed, with_heading(0.02));
  ASSERT_EQ(loop.steer_to(kTarget), "");
  loop.run(2);
  std::int64_t seq = 0;
  loop.run(1, [&] {
    if (loop.ms % 33 == 5)
      loop.port.publish(io::channel::kTipHeading,
                        message_of(loop, loop.rig->plant().tip().R.col(2), seq++, loop.config.rig.heading.camera));
    return loop.state() == controller::State::stopped;
  });
  EXPECT_EQ(loop.state(), controller::State::stopped);
  EXPECT_NE(loop.needle_state->health & estimator::kInputRefused, 0);
}

TEST(HeadingLoop, TheRigsFileSaysWhetherThereIsASensor) {
  const test::TemporaryFolder folder;
  const std::string needle =
      "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n";
  const auto heading = [&](const std::string& text) {
    return nodes::load_system_config(folder.write("rig.toml", needle + text)).rig.heading;
  };
  EXPECT_EQ(heading("").sd_rad, 0);
  EXPECT_EQ(heading("[rig.heading]\nsd_rad = 0.01\n").rate_hz, 30);
  EXPECT_EQ(heading("[rig.heading]\nsd_rad = 0.01\nrate_hz = 10.0\ncamera = 3\n").camera, 3);
  EXPECT_THROW(heading("[rig.heading]\nrate_hz = 10.0\n"), io::ConfigError);
  EXPECT_THROW(heading("[rig.heading]\nsd_rad = 2.0\n"), io::ConfigError);
  EXPECT_THROW(heading("[rig.heading]\nsd_deg = 2.0\n"), io::ConfigError);
}

}  // namespace
}  // namespace bevel
