// SPDX-License-Identifier: MIT
// Effects that move the point which the cameras see.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "tests/effects/brute_force.hpp"

namespace bevel::model::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBuild_mm = 4;

TEST(Relaxation, BuildsWhileCuttingAndDecaysAtRest) {
  const auto effect = active("relaxation", {1.2, 2.5, kBuild_mm});
  const Script script{{2, 15, 0}, {6, 0, 0}};
  const Motion motion = script.recorded();
  const auto path = path_of(bicycle(), {effect}, motion);
  const auto nominal = path_of(bicycle(), {}, motion);
  // In the plane the side stays -y but for the tilt: y of the body in {A} is cos(theta).
  for (std::size_t i = 0; i < path.size(); ++i) {
    const BaseMotion& base = motion.nodes[motion.at[i]];
    const double cut_mm = std::min(base.insertion_mm, 30.0);
    const double rest_s = std::max(0.0, base.time_s - 2);
    const double expected = -1.2 * (1 - std::exp(-cut_mm / kBuild_mm)) * std::exp(-rest_s / 2.5);
    const double tilt_rad = bicycle().curvature_per_mm * cut_mm;
    EXPECT_NEAR((path[i] - nominal[i]).y(), expected, 1.2 * (1 - std::cos(tilt_rad)) + 1e-9);
    EXPECT_EQ(path[i].z(), nominal[i].z());
  }
  EXPECT_NEAR(path.back().y() - nominal.back().y(), 0, 0.12);
}

TEST(Relaxation, FollowsTheBevelAndStaysInTheWorldAtRest) {
  const Script script = rich_script();
  const auto seen = std::make_shared<std::vector<Vector2d>>();
  BruteForce brute{.needle = agar()};
  brute.after = [seen, offset = Vector2d(0, 0)](const Instant& now) mutable {
    const Vector2d side = (now.R * Vector3d(0, -1, 0)).head<2>();  // where a needle with k > 0 bends
    if (now.ds_mm > 0)
      offset += (1.2 * side - offset) * now.ds_mm / kBuild_mm;
    else if (now.ds_mm == 0)  // it is held while the needle is drawn back
      offset -= offset * now.step_s / 2.5;
    seen->push_back(offset);
  };
  const Motion motion = script.fine();
  const auto nominal = brute.path(script, motion);
  const auto path = path_of(agar(), {active("relaxation", {1.2, 2.5, kBuild_mm})}, motion);
  const std::size_t steps = (seen->size()) / (motion.nodes.size() - 1);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vector2d offset = seen->at(motion.at[i] * steps - 1);
    EXPECT_LT((path[i] - nominal[i] - Vector3d(offset.x(), offset.y(), 0)).norm(), 5e-3) << i;
  }
}

TEST(TissueMotion, IsASineInTheLateralPlane) {
  const Motion motion = rich_script().recorded();
  const auto nominal = path_of(agar(), {}, motion);
  const auto path = path_of(agar(), {active("tissue_motion", {1.5, 0.3, 0.8, 2.1})}, motion);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double t = motion.nodes[motion.at[i]].time_s;
    const double swing = 1.5 * std::sin(2 * std::numbers::pi * 0.3 * t + 2.1);
    EXPECT_LT((path[i] - nominal[i] - swing * Vector3d(std::cos(0.8), std::sin(0.8), 0)).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace bevel::model::testing
