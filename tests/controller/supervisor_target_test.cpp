// SPDX-License-Identifier: MIT
// Targets: out of reach, behind obstacles, by way-points, moving, met.
#include "tests/controller/supervisor_fixture.hpp"

namespace bevel::controller {
namespace {

TEST_F(SupervisorTest, UnreachableTargetIsRefusedWithTheMiss) {
  supervisor.set_needle(view(now));
  supervisor.set_actuator(axes(now));
  supervisor.request(Request::arm, Target{{0, 60, 60}, 0}, now);
  EXPECT_EQ(supervisor.status().state, State::stopped);
  EXPECT_EQ(supervisor.status().reason, Reason::target_unreachable);
  EXPECT_GT(supervisor.status().value, 20);
}

class SupervisorWithObstacle : public SupervisorTest {
 protected:
  void arm_with(const Obstacle& obstacle) {
    config.obstacles = {obstacle};
    supervisor = Supervisor(config, agar());
    supervisor.set_needle(view(now));
    supervisor.set_actuator(axes(now));
    supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  }
};

TEST_F(SupervisorWithObstacle, WhereNoPathIsClearItRefusesAndSaysHowNear) {
  arm_with({{2, -8, 95}, {2, -8, 95}, 8, 1});
  EXPECT_EQ(supervisor.status().state, State::stopped);
  EXPECT_EQ(supervisor.status().reason, Reason::path_blocked);
  EXPECT_LT(supervisor.status().value, 1);
  EXPECT_EQ(good_step().mode, 0);
}

TEST_F(SupervisorWithObstacle, AnotherLawThanByArcsRefuses) {
  config.law = Law::spin;
  arm_with({{30, 0, 50}, {30, 0, 50}, 2, 1});
  EXPECT_EQ(supervisor.status().reason, Reason::law_without_path);
}

TEST_F(SupervisorWithObstacle, WithinItsClearanceTheNeedleStops) {
  arm_with({{30, 0, 50}, {30, 0, 50}, 2, 1});
  ASSERT_EQ(supervisor.status().state, State::armed);
  supervisor.request(Request::start, std::nullopt, now);
  EXPECT_EQ(good_step().mode, 1);
  auto v = view(now += 20'000);
  v.pose.p_mm = {27.2, 0, 50};
  auto a = axes(now, last);
  a.insertion_mm = 60;
  supervisor.set_needle(v);
  supervisor.set_actuator(a);
  EXPECT_EQ(supervisor.step(now, 0.02).mode, 0);
  EXPECT_EQ(supervisor.status().reason, Reason::obstacle_near);
  EXPECT_NEAR(supervisor.status().value, -0.2, 1e-9);
}

TEST_F(SupervisorTest, WayPointsArePassedWithinTheirToleranceOrItStops) {
  for (const double off_mm : {0.5, 1.5}) {
    supervisor = Supervisor(config, agar());  // another needle: this one would have been drawn back by 52 mm
    supervisor.request(Request::way_point, Target{{1, -2, 50}, 1.0}, now);
    start();
    EXPECT_EQ(good_step().mode, 1);
    // Beyond the way-point, beside it by so much.
    auto v = view(now += 20'000);
    v.pose.p_mm = {1 + off_mm, -2, 50.01};
    auto a = axes(now, last);
    a.insertion_mm = 52;
    supervisor.set_needle(v);
    supervisor.set_actuator(a);
    const auto command = supervisor.step(now, 0.02);
    EXPECT_EQ(command.mode, off_mm < 1 ? 1 : 0);
    EXPECT_EQ(supervisor.status().reason, off_mm < 1 ? Reason::none : Reason::way_point_missed);
  }
}

TEST_F(SupervisorTest, WayPointsThatCannotFollowOneAnotherAreRefused) {
  supervisor.request(Request::way_point, Target{{6, 0, 50}, 1.0}, now);
  supervisor.request(Request::way_point, Target{{-6, 0, 70}, 1.0}, now);
  supervisor.set_needle(view(now));
  supervisor.set_actuator(axes(now));
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  EXPECT_EQ(supervisor.status().reason, Reason::way_point_unreachable);
  EXPECT_GT(supervisor.status().value, 5);
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  EXPECT_EQ(supervisor.status().reason, Reason::way_point_unreachable) << "armed again they are still to be passed";
  supervisor.request(Request::stop, std::nullopt, now);
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  EXPECT_EQ(supervisor.status().state, State::armed);
  supervisor.request(Request::hold, std::nullopt, now);
  for (int i = 0; i < 9; ++i) supervisor.request(Request::way_point, Target{{0, 0, 10.0 * i}, 1.0}, now);
  EXPECT_EQ(supervisor.status().reason, Reason::way_points_too_many);
  // None of them is left out without a word, not by one that is told while it is stopped either.
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  EXPECT_EQ(supervisor.status().reason, Reason::way_points_too_many);
  supervisor.request(Request::stop, std::nullopt, now);
  for (int i = 0; i < 9; ++i) supervisor.request(Request::way_point, Target{{0, 0, 10.0 * i}, 1.0}, now);
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  EXPECT_EQ(supervisor.status().reason, Reason::way_points_too_many);
  supervisor.request(Request::stop, std::nullopt, now);
  supervisor.request(Request::way_point, Target{{0, 0, 1e4}, 1.0}, now);
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  EXPECT_EQ(supervisor.status().reason, Reason::target_outside);
}

TEST_F(SupervisorTest, FollowsATargetThatMovesAndStopsWhereItGoesOutOfReach) {
  supervisor.set_needle(view(now));
  supervisor.set_actuator(axes(now));
  supervisor.request(Request::follow, Target{{2, -8, 100}, 0}, now);
  EXPECT_EQ(supervisor.status().state, State::off) << "it arms nothing";
  start();
  EXPECT_EQ(good_step().mode, 1);
  const Eigen::Vector2d before = supervisor.status().arc.aim_mm;
  supervisor.request(Request::follow, Target{{4, -8, 100}, 0}, now);
  EXPECT_EQ(good_step().mode, 1);
  EXPECT_NEAR((supervisor.status().arc.aim_mm - before - Eigen::Vector2d(2, 0)).norm(), 0, 0.3)
      << "two positions say little of how it moves";
  supervisor.request(Request::follow, Target{{std::nan(""), 0, 100}, 0}, now);
  EXPECT_EQ(good_step().mode, 1) << "no target at all is none";
  supervisor.request(Request::follow, Target{{0, 60, 60}, 0}, now);
  EXPECT_EQ(good_step().mode, 1) << "one such position is a slip, a second is another target";
  supervisor.request(Request::follow, Target{{0, 60, 60}, 0}, now);
  EXPECT_GT(supervisor.status().value, 20);
  expect_stopped(Reason::target_unreachable);
}

TEST_F(SupervisorTest, HoldsAtTheClosestApproach) {
  start();
  good_step();
  auto v = view(now);
  v.pose.p_mm = {2, -8, 100.1};
  supervisor.set_needle(v);
  auto a = axes(now, last);
  a.insertion_mm = 100.5;
  supervisor.set_actuator(a);
  last = supervisor.step(now, 0.02);
  EXPECT_EQ(supervisor.status().state, State::hold) << to_string(supervisor.status().reason);
  EXPECT_EQ(last.mode, 1) << "what moves comes to rest by the ramp";
  for (int i = 0; i < 20; ++i) {
    now += 20'000;
    v.utime = now;
    supervisor.set_needle(v);
    a = axes(now, last);
    a.insertion_mm = 100.5;
    supervisor.set_actuator(a);
    last = supervisor.step(now, 0.02);
  }
  EXPECT_EQ(supervisor.status().state, State::hold) << to_string(supervisor.status().reason);
  EXPECT_EQ(last.insertion_rate_mm_s, 0);
  EXPECT_EQ(last.rotation_rate_rad_s, 0);
}

}  // namespace
}  // namespace bevel::controller
