// SPDX-License-Identifier: MIT
// Effects on the curvature, against closed forms and brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/effects/brute_force.hpp"

namespace bevel::model::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

void expect_as_brute_force(const ActiveEffect& effect, const BruteForce& brute, double fine_mm, double recorded_mm) {
  const Script script = rich_script();
  EXPECT_LT(largest_distance_mm(path_of(brute.needle, {effect}, script.fine()), brute.path(script, script.fine())),
            fine_mm);
  EXPECT_LT(
      largest_distance_mm(path_of(brute.needle, {effect}, script.recorded()), brute.path(script, script.recorded())),
      recorded_mm);
}

TEST(BruteForce, IsTheModelWhereNoEffectIs) {
  for (const auto slip : {SlipDirection::isotropic, SlipDirection::bevel_plane})
    for (const auto wheel : {FrontWheel::published, FrontWheel::nonslip}) {
      BruteForce brute{.needle = agar()};
      brute.needle.slip = slip;
      brute.needle.front_wheel = wheel;
      const Motion motion = rich_script().fine();
      EXPECT_LT(largest_distance_mm(path_of(brute.needle, {}, motion), brute.path(rich_script(), motion)), 1e-4);
    }
}

// Bicycle, bent in the plane: heading and place after an arc.
struct Planar {
  double theta = 0, y = 0, z = 0;
  void arc(double k, double s) {
    y -= (std::cos(theta) - std::cos(theta + k * s)) / k;
    z += (std::sin(theta + k * s) - std::sin(theta)) / k;
    theta += k * s;
  }
};

TEST(RateDependence, BendsByThePowerLaw) {
  const double k = bicycle().curvature_per_mm;
  for (const double speed_mm_s : {2.0, 10.0, 40.0}) {
    const Motion motion = Script{{60 / speed_mm_s, speed_mm_s, 0}}.recorded();
    const auto path = path_of(bicycle(), {active("rate_dependence", {0.3})}, motion);
    Planar circle;
    circle.arc(k * std::pow(speed_mm_s / 10, -0.3), motion.nodes[motion.at.back()].insertion_mm);
    EXPECT_NEAR(path.back().y(), circle.y, 1e-9);
    EXPECT_NEAR(path.back().z(), circle.z, 1e-9);
  }
}

TEST(RateDependence, FollowsTheSpeedOfTheMoment) {
  BruteForce brute{.needle = agar()};
  brute.curvature = [](const Instant& now, Vector2d& kappa) {
    const double speed_mm_s =
        std::abs(rich_script().at(now.time_s).insertion_mm - rich_script().at(now.time_s - now.step_s).insertion_mm) /
        now.step_s;
    if (speed_mm_s > 0) kappa *= std::pow(speed_mm_s / 10, -0.25);
  };
  expect_as_brute_force(active("rate_dependence", {0.25}), brute, 2e-3, 0.02);
}

TEST(Layer, IsTwoArcs) {
  const double k = bicycle().curvature_per_mm;
  constexpr double kDepth_mm = 33.3;
  const Motion motion = Script{{4, 20, 0}}.recorded();
  const auto path = path_of(bicycle(), {active("layer", {kDepth_mm, 1.6})}, motion);
  const double first_mm = std::asin(k * kDepth_mm) / k;  // arc to that depth
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double s = motion.nodes[motion.at[i]].insertion_mm;
    Planar arcs;
    arcs.arc(k, std::min(s, first_mm));
    if (s > first_mm) arcs.arc(1.6 * k, s - first_mm);
    EXPECT_NEAR(path[i].y(), arcs.y, 2e-4);
    EXPECT_NEAR(path[i].z(), arcs.z, 2e-4);
  }
}

TEST(Layer, EndsWhereTheTipIsDrawnBackOutOfIt) {
  BruteForce brute{.needle = agar()};
  brute.curvature = [](const Instant& now, Vector2d& kappa) {
    if (now.p_mm.z() > 46) kappa *= 0.5;
  };
  expect_as_brute_force(active("layer", {46, 0.5}), brute, 1e-3, 0.01);
}

TEST(DepthDependence, IsACubicForASlightBend) {
  NeedleParameters needle = bicycle();
  needle.curvature_per_mm = 1e-5;  // so that z = s to 1e-7: theta(s) = k (s + c s^2/200)
  const Motion motion = Script{{5, 20, 0}}.recorded();
  const auto path = path_of(needle, {active("depth_dependence", {0.6})}, motion);
  const double s = motion.nodes[motion.at.back()].insertion_mm;
  EXPECT_NEAR(path.back().y(), -1e-5 * (s * s / 2 + 0.6 * s * s * s / 600), 1e-6);
}

TEST(DepthDependence, FollowsTheDepthOfTheTip) {
  BruteForce brute{.needle = agar()};
  brute.curvature = [](const Instant& now, Vector2d& kappa) { kappa *= 1 - 0.7 * now.p_mm.z() / 100; };
  expect_as_brute_force(active("depth_dependence", {-0.7}), brute, 1e-3, 0.01);
}

TEST(Drilling, WidensTheHelix) {
  NeedleParameters effective = agar();
  effective.curvature_per_mm /= 1 + 2 * 5.0 / 8;
  const Motion motion = Script{{6, 8, -5}}.recorded();
  EXPECT_LT(largest_distance_mm(path_of(agar(), {active("drilling", {2})}, motion), path_of(effective, {}, motion)),
            1e-9);
  const Motion still = Script{{6, 8, 0}}.recorded();
  EXPECT_EQ(path_of(agar(), {active("drilling", {2})}, still), path_of(agar(), {}, still));
}

TEST(Drilling, FollowsTheRatesOfTheMoment) {
  BruteForce brute{.needle = agar()};
  brute.curvature = [](const Instant& now, Vector2d& kappa) {
    if (now.ds_mm != 0) kappa /= 1 + 1.5 * std::abs(now.dr_rad / now.ds_mm);
  };
  expect_as_brute_force(active("drilling", {1.5}), brute, 1e-3, 0.02);
}

TEST(FlipTransient, HeadingAfterAFlipIsAnExponential) {
  constexpr double kLength_mm = 8;
  const AugmentedNeedle needle(bicycle(), {active("flip_transient", {kLength_mm})});
  const Script script{{2, 20, 0}, {1, 0, 3.14159265358979}, {1, 30, 0}};
  const Motion motion = script.recorded();
  AugmentedState state = needle.entry(motion.nodes.front());
  const double k = bicycle().curvature_per_mm;
  double deflection_rad = 0;
  for (std::size_t i = 1; i < motion.nodes.size(); ++i) {
    ASSERT_TRUE(needle.advance(state, motion.nodes[i]));
    const double s = motion.nodes[i].insertion_mm - 40;
    const double theta = s <= 0 ? k * (40 + s) : k * 40 - k * (s - 2 * kLength_mm * (1 - std::exp(-s / kLength_mm)));
    EXPECT_NEAR(std::atan2(-state.pose.R(1, 2), state.pose.R(2, 2)), theta, 1e-9);
    deflection_rad = std::max(deflection_rad, theta);
  }
  EXPECT_GT(deflection_rad, k * 40 + 0.005);  // it overshoots: that is the effect
}

TEST(FlipTransient, IsTheFirstOrderLagOfTheCurvatureVector) {
  BruteForce brute{.needle = agar()};
  brute.curvature = [K = Vector2d(1, 0)](const Instant& now, Vector2d& kappa) mutable {
    const double roll = now.r_rad + 0.5 * now.dr_rad;
    if (now.ds_mm > 0) K += (Vector2d(std::cos(roll), std::sin(roll)) - K) * now.ds_mm / 6.0;  // Euler
    const double k = kappa.x();
    kappa =
        k * Vector2d(K.x() * std::cos(roll) + K.y() * std::sin(roll), K.y() * std::cos(roll) - K.x() * std::sin(roll));
  };
  expect_as_brute_force(active("flip_transient", {6}), brute, 2e-3, 0.02);
}

TEST(LateralBias, BendsAStraightNeedleIntoACircle) {
  NeedleParameters straight = bicycle();
  straight.curvature_per_mm = 0;
  constexpr double kBias = 0.0015;
  const Motion motion = Script{{5, 20, 0.9}}.recorded();  // turning does not turn it
  const double s = motion.nodes[motion.at.back()].insertion_mm;
  const Vector3d x = path_of(straight, {active("lateral_bias", {kBias, 0})}, motion).back();
  EXPECT_LT((x - Vector3d((1 - std::cos(kBias * s)) / kBias, 0, std::sin(kBias * s) / kBias)).norm(), 1e-3);
  const Vector3d y = path_of(straight, {active("lateral_bias", {0, -kBias})}, motion).back();
  EXPECT_LT((y - Vector3d(0, -(1 - std::cos(kBias * s)) / kBias, std::sin(kBias * s) / kBias)).norm(), 1e-3);
}

TEST(LateralBias, IsFixedInTheWorld) {
  BruteForce brute{.needle = agar()};
  brute.curvature = [](const Instant& now, Vector2d& kappa) {
    kappa += (now.R.transpose() * Vector3d(0.0008, 0.0012, 0)).head<2>();
  };
  expect_as_brute_force(active("lateral_bias", {0.0012, -0.0008}), brute, 1e-3, 0.01);
}

TEST(SlipDirection, IsTheOtherReadingAndTheSameInThePlane) {
  const auto effect = active("slip_direction", {});
  NeedleParameters other = agar();
  other.slip = SlipDirection::bevel_plane;
  const Motion plane = Script{{5, 20, 0}}.recorded();
  EXPECT_LT(largest_distance_mm(path_of(agar(), {effect}, plane), path_of(agar(), {}, plane)), 1e-9);
  const Motion turned = Script{{2.5, 20, 0}, {1, 0, 1.57}, {2.5, 20, 0}}.recorded();
  EXPECT_GT(largest_distance_mm(path_of(agar(), {effect}, turned), path_of(agar(), {}, turned)), 1);
  EXPECT_EQ(path_of(agar(), {effect}, turned), path_of(other, {}, turned));
  EXPECT_EQ(path_of(other, {effect}, turned), path_of(agar(), {}, turned));
  BruteForce brute{.needle = other};
  EXPECT_LT(largest_distance_mm(path_of(agar(), {effect}, rich_script().fine()),
                                brute.path(rich_script(), rich_script().fine())),
            1e-4);
}

}  // namespace
}  // namespace bevel::model::testing
