// SPDX-License-Identifier: MIT
// Obstacles and way-points through all the nodes: the file, the operator's words, drives and messages as they run live.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "tests/loop/simulated_loop.hpp"

namespace bevel {
namespace {

using controller::Reason;
using controller::State;
using nodes::Word;

constexpr unsigned kSeed = 23;
const Eigen::Vector3d kTarget(6, -9, 100);

nodes::SystemConfig config_with(const controller::Obstacle& obstacle) {
  nodes::SystemConfig config = test::loop_config();
  config.controller.obstacles = {obstacle};
  return config;
}

// Until it holds at the target; the least distance of its true tip from a point on the way.
double nearest_mm(test::SimulatedLoop& loop, const Eigen::Vector3d& point_mm) {
  double nearest_mm = 1e9;
  EXPECT_TRUE(loop.run(60, [&] {
    nearest_mm = std::min(nearest_mm, (loop.tip() - point_mm).norm());
    return loop.state() != State::steering;
  }));
  EXPECT_EQ(loop.state(), State::hold) << loop.said("bevel-controller").reason;
  loop.run(0.5);
  const double miss_mm = (loop.tip() - kTarget).norm();
  std::cout << "seed " << kSeed << ": tip to target " << miss_mm << " mm, to the point on the way " << nearest_mm
            << " mm\n";
  EXPECT_LT(miss_mm, 0.8);
  return nearest_mm;
}

// The obstacle stands where the tip passes at half depth if nothing is in the way.
TEST(PathLoop, GoesRoundAnObstacle) {
  test::SimulatedLoop without(kSeed);
  ASSERT_EQ(without.steer_to(kTarget), "");
  ASSERT_TRUE(without.run(60, [&] { return without.tip().z() >= kTarget.z() / 2; }));
  const controller::Obstacle obstacle{without.tip(), without.tip(), 1, 1};
  test::SimulatedLoop loop(kSeed, config_with(obstacle));
  ASSERT_EQ(loop.steer_to(kTarget), "");
  EXPECT_GT(nearest_mm(loop, obstacle.from_mm), 1.5) << "radius and clearance, less the error of the estimate";
}

TEST(PathLoop, PassesAWayPoint) {
  const Eigen::Vector3d way_point(3, -1, 55);
  test::SimulatedLoop loop(kSeed);
  loop.run(0.5);
  loop.say(Word::way_point, way_point);
  ASSERT_EQ(loop.steer_to(kTarget), "");
  EXPECT_LT(nearest_mm(loop, way_point), 1);
}

TEST(PathLoop, NoPathIsARefusalWithItsReason) {
  test::SimulatedLoop loop(kSeed, config_with({{6, -9, 90}, {6, -9, 90}, 6, 1}));
  EXPECT_NE(loop.steer_to(kTarget), "");
  loop.run(0.5);
  EXPECT_EQ(loop.reason(), Reason::path_blocked);
  EXPECT_EQ(loop.said("bevel-controller").reason.substr(0, 49), "no path to the target is clear of the obstacles (");
  EXPECT_LT(loop.tip().norm(), 0.5) << "nothing moved";
}

}  // namespace
}  // namespace bevel
