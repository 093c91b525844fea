// SPDX-License-Identifier: MIT
// Effects of the cameras: maps of the point seen, and its stamp.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/effects/script.hpp"

namespace bevel::model::testing {
namespace {

using Eigen::Vector3d;

Vector3d seen(const ActiveEffect& effect, const Vector3d& point_mm) {
  const AugmentedNeedle needle(agar(), {effect});
  TipReading reading{point_mm, PointColumns(3, 0)};
  needle.through_cameras(reading);
  return reading.position_mm;
}

TEST(CameraScale, StretchesTheImagePlane) {
  EXPECT_LT((seen(active("camera_scale", {1.04}), {7, -12, 60}) - Vector3d(7, -12.48, 62.4)).norm(), 1e-12);
}

TEST(CameraRotation, TurnsTheImageTheOtherWay) {
  // A camera turned by +a about x sees the world turned by -a: z_A leans toward +y in its picture.
  const Vector3d p = seen(active("camera_rotation", {0.03, 0}), {7, 0, 60});
  EXPECT_LT((p - Vector3d(7, 60 * std::sin(0.03), 60 * std::cos(0.03))).norm(), 1e-12);
}

TEST(Refraction, IsCubicAboutItsCentre) {
  const auto effect = active("refraction", {0.03, 40});
  EXPECT_LT((seen(effect, {7, 0, 90}) - Vector3d(7, 0, 40 + 50 * 1.03)).norm(), 1e-12);
  EXPECT_LT(
      (seen(effect, {7, -3, 36}) - Vector3d(7, -3 * (1 + 0.03 * 25 / 2500), 40 - 4 * (1 + 0.03 * 25 / 2500))).norm(),
      1e-12);
  EXPECT_LT((seen(effect, {7, 0, 40}) - Vector3d(7, 0, 40)).norm(), 1e-12);
}

TEST(Cameras, ActInTheOrderOfTheRegistry) {  // the window bends the light, then the camera is turned, then its scale
  const AugmentedNeedle needle(
      agar(), {active("refraction", {0.03, 40}), active("camera_scale", {1.04}), active("camera_rotation", {0.03, 0})});
  TipReading reading{Vector3d(7, -5, 60), PointColumns(3, 0)};
  needle.through_cameras(reading);
  Vector3d by_hand = seen(active("refraction", {0.03, 40}), {7, -5, 60});
  by_hand = seen(active("camera_scale", {1.04}), seen(active("camera_rotation", {0.03, 0}), by_hand));
  EXPECT_EQ(reading.position_mm, by_hand);
}

TEST(CameraLatency, ShowsThePathAsItWas) {
  const Script script = rich_script();
  Motion motion = script.fine();
  const auto late = path_of(agar(), {active("camera_latency", {0.08})}, motion);
  for (auto& node : motion.at) node -= std::min<std::size_t>(node, 80);  // legs of 1 ms
  EXPECT_LT(largest_distance_mm(late, path_of(agar(), {}, motion)), 1e-9);
  EXPECT_GT(largest_distance_mm(late, path_of(agar(), {}, script.fine())), 1);
}

// The same motion, each reading where it is 0.1234 s before.
Motion seen_earlier(const Script& script, std::size_t readings) {
  const auto samples = script.actuators(0.01);
  std::vector<std::int64_t> earlier;
  for (std::size_t i = 0; i < readings; ++i)
    earlier.push_back(samples.front().utime + 33'333 * static_cast<std::int64_t>(i) - 123'400);
  return make_motion(samples, earlier);
}

TEST(CameraLatency, IsRightBetweenTheLegsOfARecording) {
  const Script script = rich_script();
  const auto late = path_of(agar(), {active("camera_latency", {0.1234})}, script.recorded());
  EXPECT_LT(largest_distance_mm(late, path_of(agar(), {}, seen_earlier(script, late.size()))), 0.02);
}

// A tip that jumps between two nodes is before its jump or after it.
TEST(CameraLatency, IsRightBetweenTheLegsWhereTheTipJumps) {
  const Script script = rich_script();
  const std::vector<ActiveEffect> jumps = {active("stick_slip", {1.3})};
  const auto late = path_of(agar(), {jumps[0], active("camera_latency", {0.1234})}, script.recorded());
  const auto there = path_of(agar(), jumps, seen_earlier(script, late.size()));
  std::size_t apart = 0;
  for (std::size_t i = 0; i < late.size(); ++i) apart += (late[i] - there[i]).norm() > 0.05 ? 1 : 0;
  EXPECT_LE(apart, 1) << "of " << late.size();
}

TEST(CameraLatency, LeavesTheEntryWhereItIs) {
  const auto late = path_of(agar(), {active("camera_latency", {0.5})}, Script{{0.4, 10, 0}}.recorded());
  for (const auto& p : late) EXPECT_EQ(p, Vector3d::Zero());
}

}  // namespace
}  // namespace bevel::model::testing
