// SPDX-License-Identifier: MIT
// What moves, and what stops it.
#include <functional>
#include <limits>

#include "tests/controller/supervisor_fixture.hpp"

namespace bevel::controller {
namespace {

TEST_F(SupervisorTest, NothingMovesBeforeArmAndStart) {
  EXPECT_EQ(good_step().mode, 0);
  supervisor.request(Request::start, std::nullopt, now);
  EXPECT_EQ(good_step().mode, 0);
  start();
  EXPECT_EQ(good_step().mode, 1);
  EXPECT_GT(last.insertion_rate_mm_s, 0);
}

TEST_F(SupervisorTest, EveryConditionStopsWithinOnePeriodAndLatches) {
  const auto nan = std::nan("");
  struct Case {
    Reason reason;
    std::function<void()> provoke;
  };
  const Case cases[] = {
      {Reason::operator_stop, [&] { supervisor.request(Request::stop, std::nullopt, now); }},
      {Reason::state_stale,
       [&] {
         now += 200'000;
         supervisor.set_actuator(axes(now));
       }},
      {Reason::state_stale,
       [&] {
         auto v = view(now + 3'600'000'000);
         supervisor.set_needle(v);
       }},
      {Reason::state_unhealthy,
       [&] {
         auto v = view(now);
         v.health = 2;
         supervisor.set_needle(v);
       }},
      {Reason::state_uncertain,
       [&] {
         auto v = view(now);
         v.position_variance_mm2 = 100;
         supervisor.set_needle(v);
       }},
      {Reason::state_uncertain,
       [&] {
         auto v = view(now);
         v.position_variance_mm2 = nan;
         supervisor.set_needle(v);
       }},
      {Reason::state_reset,
       [&] {
         auto v = view(now);
         v.reset_count = 1;
         supervisor.set_needle(v);
       }},
      // A position that is uncertain after a reset is a consequence of the reset, not the reason.
      {Reason::state_reset,
       [&] {
         auto v = view(now);
         v.reset_count = 1;
         v.health = 8;
         v.position_variance_mm2 = 100;
         supervisor.set_needle(v);
       }},
      {Reason::state_not_finite,
       [&] {
         auto v = view(now);
         v.pose.p_mm.x() = nan;
         supervisor.set_needle(v);
       }},
      {Reason::actuator_stale,
       [&] {
         now += 200'000;
         supervisor.set_needle(view(now));
       }},
      {Reason::axes_not_enabled,
       [&] {
         auto a = axes(now);
         a.axis_status[1] = 4;
         supervisor.set_actuator(a);
       }},
      {Reason::workspace,
       [&] {
         auto v = view(now);
         v.pose.p_mm.z() = 141;
         supervisor.set_needle(v);
       }},
      {Reason::workspace,
       [&] {
         auto v = view(now);
         v.pose.p_mm.x() = 70;
         supervisor.set_needle(v);
       }},
      {Reason::overrun, [&] { supervisor.report(Reason::overrun); }},
  };
  for (const Case& c : cases) {
    start();
    EXPECT_EQ(good_step().mode, 1);
    EXPECT_EQ(good_step().mode, 1);
    c.provoke();
    expect_stopped(c.reason);
    supervisor.request(Request::stop, std::nullopt, now);  // so that the next case can arm
  }
}

TEST_F(SupervisorTest, AxesThatDoNotFollowAreATrackingError) {
  start();
  for (int i = 0; i < 40 && supervisor.status().state == State::steering; ++i) {
    now += 20'000;
    supervisor.set_needle(view(now));
    auto a = axes(now);
    a.insertion_rate_mm_s = -3;
    supervisor.set_actuator(a);
    supervisor.step(now, 0.02);
  }
  EXPECT_EQ(supervisor.status().reason, Reason::insertion_tracking);
}

// Too slow for any limit on rates.
TEST_F(SupervisorTest, AxesThatCreepWhileToldToRestAreNoticed) {
  for (const bool rotation : {false, true}) {
    supervisor.set_needle(view(now));
    supervisor.set_actuator(axes(now));
    supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
    double moved = 0;
    for (int i = 0; i < 400 && supervisor.status().state == State::armed; ++i) {
      now += 20'000;
      supervisor.set_needle(view(now));
      auto a = axes(now);
      moved += 0.004;  // 0.2 mm/s or rad/s
      (rotation ? a.rotation_rad : a.insertion_mm) = moved;
      supervisor.set_actuator(a);
      EXPECT_EQ(supervisor.step(now, 0.02).mode, 0);
    }
    EXPECT_EQ(supervisor.status().reason, Reason::resting_axes_moved) << to_string(supervisor.status().reason);
    EXPECT_LT(moved, 0.7);
  }
}

TEST_F(SupervisorTest, AnEstimateThatWandersOffRestingAxesIsNoticed) {
  supervisor.set_needle(view(now));
  supervisor.set_actuator(axes(now));
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  for (int i = 0; i < 100 && supervisor.status().state == State::armed; ++i) {
    now += 20'000;
    auto v = view(now);
    v.pose.p_mm.x() = 0.1 * i;
    supervisor.set_needle(v);
    auto a = axes(now);
    a.insertion_mm = 50;  // so that it is not too far from the entry
    supervisor.set_actuator(a);
    supervisor.step(now, 0.02);
  }
  EXPECT_EQ(supervisor.status().reason, Reason::resting_tip_moved) << to_string(supervisor.status().reason);
}

TEST_F(SupervisorTest, ATipFartherThanTheNeedleIsLongIsNotBelieved) {
  start();
  good_step();
  auto v = view(now);
  v.pose.p_mm = {10, 0, 0};
  supervisor.set_needle(v);
  expect_stopped(Reason::off_the_axes);
}

TEST_F(SupervisorTest, ArmedWithAxesInFaultOrNeverEnabledStops) {
  // Enabled once, then in fault: at once.
  supervisor.set_needle(view(now));
  supervisor.set_actuator(axes(now));
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  good_step();
  auto a = axes(now);
  a.axis_status = {2, 4};
  supervisor.set_actuator(a);
  supervisor.step(now, 0.02);
  EXPECT_EQ(supervisor.status().reason, Reason::axes_not_enabled);
  // Never: after a while.
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  const double waited_s = wait_while_armed(a, 0.02);
  EXPECT_EQ(supervisor.status().reason, Reason::axes_not_enabled);
  EXPECT_NEAR(waited_s, config.safety.enabling_s, 0.1);
}

// A controller that is given a period of five: its limits are of seconds, and its rates do not change five times as
// fast.
TEST_F(SupervisorTest, PeriodsThatWereMissedCount) {
  auto a = axes(now);
  a.axis_status = {1, 1};
  supervisor.set_needle(view(now));
  supervisor.set_actuator(a);
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  const double waited_s = wait_while_armed(a, 0.1);
  EXPECT_EQ(supervisor.status().reason, Reason::axes_not_enabled);
  EXPECT_NEAR(waited_s, config.safety.enabling_s, 0.2);
}

TEST_F(SupervisorTest, StampsAtTheEndsOfTimeAreNotFresh) {
  for (const std::int64_t stamp : {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(),
                                   std::int64_t{0}, now + 18'446'744'073'709'552}) {
    start();
    good_step();
    supervisor.set_needle(view(stamp));
    expect_stopped(Reason::state_stale);
    supervisor.request(Request::stop, std::nullopt, now);  // so that the next can arm
  }
}

}  // namespace
}  // namespace bevel::controller
