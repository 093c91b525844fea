// SPDX-License-Identifier: MIT
// Paths round obstacles, judged by computations of their own: distances by sampling, paths integrated in small steps,
// and a search by brute force where the planner says that there is none.
#include <bevel/controller/path_plan.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>
#include <random>

#include <bevel/controller/arc_law.hpp>
#include <bevel/controller/route.hpp>
#include "tests/support/count_allocations.hpp"

namespace bevel::controller {
namespace {

constexpr double kPi = std::numbers::pi;

model::NeedleParameters agar() {
  model::NeedleParameters needle;
  needle.lambda1_per_rad = 0.49;
  needle.lambda2 = 0.22;
  return needle;
}

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Eigen::Vector3d within(double side_mm) {
    return {uniform(-side_mm, side_mm), uniform(-side_mm, side_mm), uniform(-side_mm, side_mm)};
  }
  // Within 0.6 of the reach of the needle.
  Eigen::Vector3d target() {
    const double depth_mm = uniform(80, 120), angle = uniform(0, 2 * kPi);
    const double aside_mm = 0.3 * agar().curvature_per_mm * depth_mm * depth_mm * std::sqrt(uniform(0, 1));
    return {aside_mm * std::cos(angle), aside_mm * std::sin(angle), depth_mm};
  }
  // A sphere or a capsule near the line to the target.
  Obstacle obstacle(const Eigen::Vector3d& target_mm) {
    const auto across = [this](double length_mm) {
      const double angle = uniform(0, 2 * kPi);
      return Eigen::Vector3d(length_mm * std::cos(angle), length_mm * std::sin(angle), 0);
    };
    const Eigen::Vector3d centre_mm = uniform(0.25, 0.75) * target_mm + across(8 * std::sqrt(uniform(0, 1)));
    const Eigen::Vector3d half_mm = uniform(0, 1) < 0.5 ? Eigen::Vector3d::Zero().eval() : across(15);
    return {centre_mm - half_mm, centre_mm + half_mm, uniform(2, 5), 1};
  }

 private:
  std::mt19937 random_;
};

double distance_by_sampling_mm(const Obstacle& obstacle, const Eigen::Vector3d& a_mm, const Eigen::Vector3d& b_mm) {
  double least_mm = 1e9;
  constexpr int kSamples = 400;
  for (int i = 0; i <= kSamples; ++i)
    for (int j = 0; j <= kSamples; ++j)
      least_mm = std::min(least_mm, (obstacle.from_mm + (obstacle.to_mm - obstacle.from_mm) * i / kSamples - a_mm -
                                     (b_mm - a_mm) * j / kSamples)
                                        .norm());
  return least_mm - obstacle.radius_mm;
}

TEST(Obstacle, DistancesAreThoseOfSampledPoints) {
  constexpr unsigned kSeed = 31;
  std::cout << "seed " << kSeed << "\n";
  Draw draw(kSeed);
  for (int i = 0; i < 60; ++i) {
    Obstacle obstacle{draw.within(20), draw.within(20), draw.uniform(0.5, 5), 0};
    Eigen::Vector3d a = draw.within(20), b = draw.within(20);
    if (i % 5 == 1) obstacle.to_mm = obstacle.from_mm;                  // a sphere
    if (i % 5 == 2) b = a;                                              // a point
    if (i % 5 == 3) b = a + 0.7 * (obstacle.to_mm - obstacle.from_mm);  // parallel
    if (i % 10 == 9) b = a, obstacle.to_mm = obstacle.from_mm;
    // Samples are up to 0.1 mm apart of each line: off by no more than half of both, and never too small.
    const double sampled_mm = distance_by_sampling_mm(obstacle, a, b), exact_mm = distance_mm(obstacle, a, b);
    EXPECT_LE(exact_mm, sampled_mm + 1e-9) << i;
    EXPECT_GE(exact_mm, sampled_mm - 0.2) << i;
  }
}

PathStart at_entry(double margin_mm) {
  PathStart start;
  start.needle = agar();
  start.margin_mm = margin_mm;
  return start;
}

PathPoints only(const Eigen::Vector3d& target_mm) {
  PathPoints points;
  points.add({target_mm, 0, true});
  return points;
}

bool plan(PathPlanner& planner, const PathStart& start, const Eigen::Vector3d& target_mm) {
  planner.begin(start, only(target_mm));
  planner.search(1'000'000);
  return planner.found();
}

// Arcs of constant curvature, up to the needle's: two of free direction, and one to the target's depth that is to meet
// it. By brute force over directions, shares and lengths; integrated by 1 mm, distances of points.
class BruteForce {
 public:
  BruteForce(const Obstacle& obstacle, const Eigen::Vector3d& target_mm, double margin_mm)
      : obstacle_(obstacle), target_mm_(target_mm), margin_mm_(margin_mm) {}
  bool finds() const {
    if (meets({})) return true;
    return fan({}, 16, [&](const model::Pose& first) { return meets(first); }) ||
           fan({}, 12, [&](const model::Pose& first) {
             return fan(first, 8, [&](const model::Pose& second) { return meets(second); });
           });
  }

 private:
  template <class Then>
  bool fan(const model::Pose& from, int directions, Then then) const {
    for (int d = 0; d < directions; ++d)
      for (const double share : {1.0, 0.5, 0.0}) {
        if (share == 0 && d > 0) continue;
        model::Pose tip = turned(from, 2 * kPi * d / directions);
        while (tip.p_mm.z() < target_mm_.z() - 10) {
          if (!go(tip, share, 12)) break;
          if (then(tip)) return true;
        }
      }
    return false;
  }
  static model::Pose turned(model::Pose tip, double by_rad) {
    tip.R = tip.R * model::exp_so3({0, 0, by_rad});
    return tip;
  }
  bool go(model::Pose& tip, double share, int steps) const {
    for (int i = 0; i < steps; ++i) {
      if (!model::step(tip, {1, 0, {share * agar().curvature_per_mm, 0}}, model::slip_parameters(agar()))) return false;
      if (distance_mm(obstacle_, tip.p_mm) < obstacle_.clearance_mm + margin_mm_) return false;
    }
    return true;
  }
  bool meets(const model::Pose& from) const {
    const ArcGeometry g = arc_geometry(from, agar(), {}, target_mm_);
    if (g.ahead_mm < 5 || g.aim_mm.norm() > g.reach_mm) return false;
    model::Pose tip = turned(from, g.facing_rad);
    return go(tip, g.aim_mm.norm() / g.reach_mm, static_cast<int>(g.ahead_mm));
  }
  Obstacle obstacle_;
  Eigen::Vector3d target_mm_;
  double margin_mm_;
};

TEST(PathPlanner, WhereItFindsNonePathsAreScarce) {
  constexpr unsigned kSeed = 32;
  constexpr int kDrawn = 100;
  constexpr double kMargin_mm = 1;
  Draw draw(kSeed);
  int found = 0, none = 0, missed = 0;
  for (int i = 0; i < kDrawn; ++i) {
    const Eigen::Vector3d target_mm = draw.target();
    const Obstacle obstacle = draw.obstacle(target_mm);
    PathPlanner planner({obstacle});
    if (plan(planner, at_entry(kMargin_mm), target_mm)) {
      ++found;
      continue;
    }
    ++none;
    if (BruteForce(obstacle, target_mm, kMargin_mm).finds()) ++missed;
  }
  std::cout << "seed " << kSeed << ", " << kDrawn << " obstacles: " << found << " paths; none in " << none
            << ", where brute force over three arcs finds one " << missed << " times\n";
  EXPECT_GT(found, kDrawn / 2);
  EXPECT_GT(none, 5) << "nothing was tried";
  EXPECT_LE(missed, kDrawn / 25);
}

// Of points, by projection: not by the planner's distance of lines.
double from_surface_mm(const Obstacle& obstacle, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d axis = obstacle.to_mm - obstacle.from_mm;
  const double length_mm = axis.norm();
  const Eigen::Vector3d unit = length_mm > 0 ? (axis / length_mm).eval() : Eigen::Vector3d::UnitX().eval();
  const double along_mm = std::min(std::max(unit.dot(point_mm - obstacle.from_mm), 0.0), length_mm);
  return (point_mm - obstacle.from_mm - along_mm * unit).norm() - obstacle.radius_mm;
}

// With the state as it is and the needle as it is believed, under the real limits of the axes: all that is left is what
// the law makes of the path.
TEST(Route, FollowedByTheLawKeepsTheClearance) {
  constexpr unsigned kSeed = 33;
  constexpr int kWanted = 60;
  const ControllerConfig config;
  const double dt_s = config.period_s, k = agar().curvature_per_mm;
  Draw draw(kSeed);
  int followed = 0, round = 0, blocked = 0;
  double nearest_mm = 1e9, worst_miss_mm = 0;
  while (followed < kWanted) {
    const Eigen::Vector3d target_mm = draw.target();
    const Obstacle obstacle = draw.obstacle(target_mm);
    Route route({obstacle});
    PathPoints points;
    points.add({target_mm, config.safety.target_miss_max_mm, true});
    route.restart(points);
    PathStart start = at_entry(kLeaves * k * kLookahead_mm * kLookahead_mm);
    if (route.plan(start) != Route::Way::clear) continue;
    ++followed;
    PathPlanner without({obstacle});
    if (!without.outlook(start, points).clear()) ++round;
    ArcLaw law;
    Rates rates;
    double rotation_rad = 0, miss_mm = 1e9;
    bool given_up = false;
    for (int i = 0; i < 4000; ++i) {
      const Route::Way way = route.look(start, points.points[0], 1);
      given_up = way == Route::Way::blocked;
      if (given_up) break;
      const ArcGeometry g = arc_geometry(start.tip, agar(), {}, route.aim_mm());
      if (g.ahead_mm <= 0) break;
      const Rates wanted = way == Route::Way::clear ? law.step(g, rotation_rad, 10, 0.05, config) : Rates{};
      rates = ramp(rates, wanted, dt_s, config.limits);
      model::advance(start.tip, {rates.insertion_mm_s * dt_s, rates.rotation_rad_s * dt_s, {k, 0}},
                     model::slip_parameters(agar()));
      rotation_rad += rates.rotation_rad_s * dt_s;
      nearest_mm = std::min(nearest_mm, from_surface_mm(obstacle, start.tip.p_mm));
      miss_mm = std::min(miss_mm, (target_mm - start.tip.p_mm).norm());
    }
    if (!given_up) worst_miss_mm = std::max(worst_miss_mm, miss_mm);
    if (given_up) ++blocked;
  }
  std::cout << "seed " << kSeed << ", " << followed << " paths, " << round << " of them round the obstacle: nearest "
            << nearest_mm << " mm of 1 mm asked for, worst miss " << worst_miss_mm << " mm, blocked on the way "
            << blocked << "\n";
  EXPECT_GE(nearest_mm, 1.0);
  EXPECT_LT(worst_miss_mm, 0.2);
  EXPECT_GT(round, 20) << "too few were in the way";
  EXPECT_LE(blocked, kWanted / 8);
}

TEST(Route, NothingAllocates) {
  const PathPoint target{{2, 3, 100}, 5, true};
  Route route({{{1, 1, 50}, {1, 1, 50}, 2, 1}});
  PathPoints points;
  points.add(target);
  route.restart(points);
  PathStart start = at_entry(0.4);
  const long before = bevel::testing::allocations;
  const Route::Way planned = route.plan(start);
  start.tip.p_mm = {0, 0, 30};  // where the path is not clear any more
  int searching = 0;
  for (int i = 0; i < 50; ++i) searching += route.look(start, target, 1) == Route::Way::searching ? 1 : 0;
  EXPECT_EQ(bevel::testing::allocations, before);
  EXPECT_EQ(planned, Route::Way::clear);
  EXPECT_GT(searching, 0) << "nothing was searched";
}

// Estimates that come in a burst, no time apart, are looked at, and nothing is searched for meanwhile.
TEST(Route, SearchesByTimeNotByEstimates) {
  const PathPoint target{{2, 3, 100}, 5, true};
  Route route({{{1, 1, 50}, {1, 1, 50}, 2, 1}});
  PathPoints points;
  points.add(target);
  route.restart(points);
  PathStart start = at_entry(0.4);
  ASSERT_EQ(route.plan(start), Route::Way::clear);
  start.tip.p_mm = {0, 0, 30};
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(route.look(start, target, 0), Route::Way::searching);
  int periods = 0;
  while (route.look(start, target, 1) == Route::Way::searching && periods < 200) ++periods;
  EXPECT_GT(periods, 1);
  EXPECT_LT(periods, 60);  // 786 candidates, 16 a period
}

}  // namespace
}  // namespace bevel::controller
