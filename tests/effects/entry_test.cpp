// SPDX-License-Identifier: MIT
// Effects on the pose at the entry point.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/effects/brute_force.hpp"

namespace bevel::model::testing {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(BevelOffset, TurnsTheWholePathAboutZ) {
  const Motion motion = rich_script().recorded();
  const auto nominal = path_of(agar(), {}, motion);
  const auto path = path_of(agar(), {active("bevel_offset", {0.7})}, motion);
  for (std::size_t i = 0; i < path.size(); ++i)
    EXPECT_LT((path[i] - AngleAxisd(0.7, Vector3d::UnitZ()) * nominal[i]).norm(), 1e-9);
  EXPECT_GT(largest_distance_mm(path, nominal), 1);
}

TEST(EntryAngle, TurnsTheWholePathOfABicycle) {
  const Motion motion = rich_script().recorded();
  const Vector3d tilt(0.06, -0.04, 0);
  const Matrix3d R = AngleAxisd(tilt.norm(), tilt.normalized()).toRotationMatrix();
  const auto nominal = path_of(bicycle(), {}, motion);
  const auto path = path_of(bicycle(), {active("entry_angle", {0.06, -0.04})}, motion);
  for (std::size_t i = 0; i < path.size(); ++i) EXPECT_LT((path[i] - R * nominal[i]).norm(), 1e-9);
}

TEST(EntryAngle, SlipsAlongItsOwnTilt) {  // slip knows z_A: the path is more than turned
  const Vector3d tilt(0.06, -0.04, 0);
  BruteForce brute{.needle = agar()};
  brute.entry = AngleAxisd(tilt.norm(), tilt.normalized()).toRotationMatrix();
  const Motion motion = rich_script().fine();
  EXPECT_LT(largest_distance_mm(path_of(agar(), {active("entry_angle", {0.06, -0.04})}, motion),
                                brute.path(rich_script(), motion)),
            1e-4);
}

TEST(EntryPose, TiltComesBeforeRoll) {
  const Vector3d tilt(0.06, -0.04, 0);
  BruteForce brute{.needle = agar()};
  brute.entry = (AngleAxisd(tilt.norm(), tilt.normalized()) * AngleAxisd(0.5, Vector3d::UnitZ())).toRotationMatrix();
  const Motion motion = rich_script().fine();
  const std::vector<ActiveEffect> both{active("bevel_offset", {0.5}), active("entry_angle", {0.06, -0.04})};
  EXPECT_LT(largest_distance_mm(path_of(agar(), both, motion), brute.path(rich_script(), motion)), 1e-4);
}

}  // namespace
}  // namespace bevel::model::testing
