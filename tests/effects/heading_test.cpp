// SPDX-License-Identifier: MIT
// Measured headings, and the effects that only they or a shift of the readings show.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/effects/script.hpp"

namespace bevel::model::testing {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

OpenLoop with(const NeedleParameters& needle, const std::vector<ActiveEffect>& effects, const Motion& motion) {
  return run(AugmentedNeedle(needle, effects), motion, true);
}

// Without slip and without turning the path is a circle: after s the heading has turned by k s about x.
TEST(Heading, TurnsWithTheArc) {
  const Script script{{4, 10, 0}};
  const Motion motion = script.recorded();
  const OpenLoop path = with(bicycle(), {}, motion);
  for (std::size_t i = 0; i < path.heading.size(); ++i) {
    const double angle_rad = bicycle().curvature_per_mm * motion.nodes[motion.at[i]].insertion_mm;
    EXPECT_LT((path.heading[i] - Vector3d(0, -std::sin(angle_rad), std::cos(angle_rad))).norm(), 1e-9);
  }
}

// Without slip the tip moves along its heading: the chord of a leg is the mean of the headings at its ends, to second
// order in the leg.
TEST(Heading, IsTheTangentOfABicyclesPath) {
  const Motion motion = rich_script().fine();
  const OpenLoop path = with(bicycle(), {}, motion);
  for (std::size_t i = 1; i < path.heading.size(); ++i) {
    const Vector3d chord = path.position_mm[i] - path.position_mm[i - 1];
    const double advance_mm = motion.nodes[motion.at[i]].insertion_mm - motion.nodes[motion.at[i - 1]].insertion_mm;
    if (std::abs(advance_mm) < 0.05) continue;
    const Vector3d mean = (path.heading[i] + path.heading[i - 1]).normalized();
    EXPECT_LT((chord.normalized() * (advance_mm > 0 ? 1 : -1) - mean).norm(), 2e-3);
  }
}

// The tip leaves its heading by the angle, and no angle is left between them without: also where the shaft turns.
TEST(CuttingAngle, LiesBetweenPathAndHeading) {
  constexpr double kAngle_rad = 0.04;
  const Motion motion = rich_script().fine();
  const OpenLoop nominal = with(bicycle(), {}, motion);
  const OpenLoop path = with(bicycle(), {active("cutting_angle", {kAngle_rad})}, motion);
  EXPECT_EQ(path.heading, nominal.heading);
  for (std::size_t i = 1; i < path.heading.size(); ++i) {
    const BaseMotion &a = motion.nodes[motion.at[i - 1]], &b = motion.nodes[motion.at[i]];
    const double advance_mm = b.insertion_mm - a.insertion_mm;
    if (std::abs(advance_mm) < 0.05 || std::abs(b.rotation_rad - a.rotation_rad) > 1e-9) continue;
    // What is added lies across the heading, toward the bevel, tan(angle) of what the tip advanced.
    const Vector3d added =
        (path.position_mm[i] - path.position_mm[i - 1]) - (nominal.position_mm[i] - nominal.position_mm[i - 1]);
    EXPECT_NEAR(added.norm(), std::tan(kAngle_rad) * std::abs(advance_mm), 1e-6);
    EXPECT_NEAR(added.dot(path.heading[i]), 0, 1e-3 * std::abs(advance_mm));
  }
}

// In a plane, by hand: the circle, and tan(angle) of the arc along the normals, which add up to a closed form.
TEST(CuttingAngle, AddsTheIntegralOfTheNormalsOfACircle) {
  const Script script{{5, 12, 0}};
  const Motion motion = script.recorded();
  const double k = bicycle().curvature_per_mm, t = std::tan(0.05);
  const OpenLoop path = with(bicycle(), {active("cutting_angle", {0.05})}, motion);
  for (std::size_t i = 0; i < path.heading.size(); ++i) {
    const double s = motion.nodes[motion.at[i]].insertion_mm;
    const Vector3d circle(0, -(1 - std::cos(k * s)) / k, std::sin(k * s) / k);
    const Vector3d aside(0, -std::sin(k * s) / k * t, -(1 - std::cos(k * s)) / k * t);
    // Over a leg of at most 1 mm the normal is that of its start: late by half a leg.
    EXPECT_LT((path.position_mm[i] - circle - aside).norm(), 0.5 * t * k * s + 1e-6) << s;
  }
}

TEST(CuttingAngle, GoesTheOtherWayWithTheBevel) {
  NeedleParameters reversed = bicycle();
  reversed.curvature_per_mm = -bicycle().curvature_per_mm;
  const Motion motion = Script{{4, 10, 0}}.recorded();
  const double up = with(bicycle(), {active("cutting_angle", {0.05})}, motion).position_mm.back().y();
  const double down = with(reversed, {active("cutting_angle", {0.05})}, motion).position_mm.back().y();
  EXPECT_NEAR(up, -down, 1e-9);
  EXPECT_LT(up, with(bicycle(), {}, motion).position_mm.back().y() - 1);
}

TEST(SensorTilt, TurnsTheHeadingInTheNeedleAndLeavesThePath) {
  const Motion motion = rich_script().recorded();
  const Vector3d tilt(0.03, -0.05, 0);
  const OpenLoop nominal = with(agar(), {}, motion),
                 askew = with(agar(), {active("sensor_tilt", {0.03, -0.05})}, motion);
  EXPECT_EQ(askew.position_mm, nominal.position_mm);
  // The same angle everywhere, and its direction turns with the shaft.
  double largest = 0;
  for (std::size_t i = 0; i < nominal.heading.size(); ++i) {
    EXPECT_NEAR(std::acos(std::min(1.0, askew.heading[i].dot(nominal.heading[i]))), tilt.norm(), 1e-6);
    largest =
        std::max(largest, ((askew.heading[i] - nominal.heading[i]) - (askew.heading[0] - nominal.heading[0])).norm());
  }
  EXPECT_LT((askew.heading[0] - AngleAxisd(tilt.norm(), tilt.normalized()) * Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_GT(largest, 1.5 * tilt.norm());  // half a turn puts it on the other side
}

TEST(EntryPoint, ShiftsEveryReadingAndNoHeading) {
  const Motion motion = rich_script().recorded();
  const OpenLoop nominal = with(agar(), {}, motion),
                 shifted = with(agar(), {active("entry_point", {0.7, -0.4})}, motion);
  EXPECT_EQ(shifted.heading, nominal.heading);
  for (std::size_t i = 0; i < nominal.position_mm.size(); ++i)
    EXPECT_LT((shifted.position_mm[i] - nominal.position_mm[i] - Vector3d(0.7, -0.4, 0)).norm(), 1e-12);
}

// A turned frame turns positions and headings alike.
TEST(CameraRotation, TurnsPositionsAndHeadings) {
  const Motion motion = rich_script().recorded();
  const OpenLoop nominal = with(agar(), {}, motion),
                 seen = with(agar(), {active("camera_rotation", {0.03, -0.02})}, motion);
  const Eigen::Matrix3d frame =
      (AngleAxisd(0.03, Vector3d::UnitX()) * AngleAxisd(-0.02, Vector3d::UnitY())).toRotationMatrix().transpose();
  for (std::size_t i = 0; i < nominal.position_mm.size(); ++i) {
    EXPECT_LT((seen.position_mm[i] - frame * nominal.position_mm[i]).norm(), 1e-9);
    EXPECT_LT((seen.heading[i] - frame * nominal.heading[i]).norm(), 1e-12);
  }
}

// A late sensor reports the heading as it was.
TEST(CameraLatency, DelaysTheHeadingToo) {
  const Motion motion = Script{{4, 10, 0}}.recorded();
  const OpenLoop nominal = with(bicycle(), {}, motion),
                 late = with(bicycle(), {active("camera_latency", {0.1})}, motion);
  const double lag_rad = 0.1 * 10 * bicycle().curvature_per_mm;
  for (std::size_t i = 10; i < nominal.heading.size(); ++i)
    EXPECT_NEAR(std::acos(std::min(1.0, late.heading[i].dot(nominal.heading[i]))), lag_rad, 1e-4);
}

}  // namespace
}  // namespace bevel::model::testing
