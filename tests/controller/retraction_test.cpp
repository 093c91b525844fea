// SPDX-License-Identifier: MIT
// Back along the path by the operator's word: rates, checks, and where it is steered from afterwards.
#include <algorithm>
#include <functional>

#include "tests/controller/supervisor_fixture.hpp"

namespace bevel::controller {
namespace {

class Retraction : public SupervisorTest {
 protected:
  // One period of axes that do what they are told and a tip that goes straight.
  model::MotionCommand step() {
    now += 20'000;
    insertion_mm += 0.02 * last.insertion_rate_mm_s;
    rotation_rad += 0.02 * last.rotation_rate_rad_s;
    give();
    if (spoil) spoil();
    return last = supervisor.step(now, 0.02);
  }
  void give() {
    NeedleView v = view(now);
    v.pose.p_mm.z() = insertion_mm;
    v.unsure = unsure;
    v.reset_count = resets;
    v.from_entry = from_entry;
    supervisor.set_needle(v);
    model::ActuatorState a = axes(now, last);
    a.insertion_mm = insertion_mm;
    a.rotation_rad = rotation_rad;
    supervisor.set_actuator(a);
  }
  void steer_to_mm(double depth_mm) {
    give();
    supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
    supervisor.request(Request::start, std::nullopt, now);
    ASSERT_EQ(supervisor.status().state, State::steering) << to_string(supervisor.status().reason);
    while (insertion_mm < depth_mm && supervisor.status().state == State::steering) step();
    ASSERT_EQ(supervisor.status().state, State::steering) << to_string(supervisor.status().reason);
  }
  void retract(double to_mm) { supervisor.request(Request::retract, Target{{0, 0, to_mm}, 0}, now); }
  State state() { return supervisor.status().state; }

  double insertion_mm = 0, rotation_rad = 0;
  bool unsure = false, from_entry = true;
  std::int32_t resets = 0;
  std::function<void()> spoil;
};

TEST_F(Retraction, FromSteeringThroughRestByTheRampsWithTheBevelAtRestThenHolds) {
  config.limits.retraction_rate_mm_s = 3;
  supervisor = Supervisor(config, agar());
  steer_to_mm(50);
  // At a moment when it turns.
  for (int i = 0; i < 1000 && last.rotation_rate_rad_s == 0; ++i) step();
  ASSERT_NE(last.rotation_rate_rad_s, 0);
  retract(20);
  EXPECT_EQ(state(), State::retracting);
  double fastest_mm_s = 0;
  for (int i = 0; i < 2000 && state() == State::retracting; ++i) {
    const model::MotionCommand before = last;
    step();
    EXPECT_LE(std::abs(last.insertion_rate_mm_s - before.insertion_rate_mm_s),
              config.limits.insertion_acceleration_mm_s2 * 0.02 + 1e-9);
    EXPECT_LE(std::abs(last.rotation_rate_rad_s - before.rotation_rate_rad_s),
              config.limits.rotation_acceleration_rad_s2 * 0.02 + 1e-9);
    EXPECT_EQ(last.mode, 1);
    if (last.insertion_rate_mm_s < 0) {
      EXPECT_EQ(last.rotation_rate_rad_s, 0);
    }
    fastest_mm_s = std::max(fastest_mm_s, -last.insertion_rate_mm_s);
  }
  EXPECT_EQ(state(), State::hold);
  EXPECT_EQ(fastest_mm_s, 3);
  for (int i = 0; i < 50; ++i) step();
  EXPECT_EQ(state(), State::hold) << to_string(supervisor.status().reason);
  EXPECT_EQ(last.insertion_rate_mm_s, 0);
  EXPECT_NEAR(insertion_mm, 20, 0.1);
  // From hold, to the entry.
  retract(0);
  for (int i = 0; i < 2000 && state() == State::retracting; ++i) step();
  for (int i = 0; i < 10; ++i) step();
  EXPECT_EQ(state(), State::hold);
  EXPECT_NEAR(insertion_mm, 0, 0.1);
}

TEST_F(Retraction, EveryConditionStopsItWithinOnePeriodAndLatches) {
  struct Case {
    Reason reason;
    std::function<void()> provoke;
  };
  const auto with_view = [&](auto&& change) {
    NeedleView v = view(now);
    v.pose.p_mm.z() = insertion_mm;
    change(v);
    supervisor.set_needle(v);
  };
  const Case cases[] = {
      {Reason::operator_stop, [&] { supervisor.request(Request::stop, std::nullopt, now); }},
      {Reason::state_stale, [&] { with_view([&](NeedleView& v) { v.utime -= 200'000; }); }},
      {Reason::state_unhealthy, [&] { with_view([](NeedleView& v) { v.health = 2; }); }},
      {Reason::state_uncertain, [&] { with_view([](NeedleView& v) { v.position_variance_mm2 = 100; }); }},
      {Reason::state_reset, [&] { with_view([](NeedleView& v) { v.reset_count = 1; }); }},
      {Reason::state_not_finite, [&] { with_view([](NeedleView& v) { v.pose.p_mm.x() = std::nan(""); }); }},
      {Reason::workspace, [&] { with_view([](NeedleView& v) { v.pose.p_mm.z() = -3; }); }},
      {Reason::off_the_axes, [&] { with_view([&](NeedleView& v) { v.pose.p_mm.z() = insertion_mm + 5; }); }},
      {Reason::actuator_stale, [&] { supervisor.set_actuator(axes(now - 200'000)); }},
      {Reason::axes_not_enabled,
       [&] {
         model::ActuatorState a = axes(now);
         a.insertion_mm = insertion_mm;
         a.axis_status[0] = 3;
         supervisor.set_actuator(a);
       }},
      {Reason::insertion_tracking,
       [&] {
         spoil = [this] {
           model::ActuatorState a = axes(now);
           a.insertion_mm = insertion_mm;
           a.insertion_rate_mm_s = 5;
           supervisor.set_actuator(a);
         };
         for (int i = 0; i < 4; ++i) step();
       }},
      {Reason::overrun, [&] { supervisor.report(Reason::overrun); }},
  };
  for (const Case& c : cases) {
    supervisor = Supervisor(config, agar());
    insertion_mm = rotation_rad = 0, last = {}, spoil = {};
    steer_to_mm(40);
    retract(10);
    for (int i = 0; i < 30; ++i) step();
    ASSERT_EQ(state(), State::retracting) << to_string(supervisor.status().reason);
    ASSERT_LT(last.insertion_rate_mm_s, -4);
    c.provoke();
    last = supervisor.step(now, 0.02);
    EXPECT_EQ(supervisor.status().reason, c.reason) << to_string(supervisor.status().reason);
    EXPECT_EQ(last.mode, 0);
    EXPECT_EQ(last.insertion_rate_mm_s, 0);
    // Neither good input nor the word brings motion back; an arm does, and the word from there.
    spoil = {};
    step();
    retract(5);
    EXPECT_EQ(step().mode, 0);
    EXPECT_EQ(supervisor.status().reason, c.reason);
    supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
    ASSERT_EQ(state(), State::armed) << to_string(supervisor.status().reason);
    retract(5);
    EXPECT_EQ(step().mode, 1);
    EXPECT_LT(last.insertion_rate_mm_s, 0);
  }
}

TEST_F(Retraction, RestsWhileTheEstimateDoubtsAndGoesOn) {
  steer_to_mm(40);
  retract(10);
  for (int i = 0; i < 30; ++i) step();
  unsure = true;
  for (int i = 0; i < 20; ++i) step();
  EXPECT_EQ(last.insertion_rate_mm_s, 0);
  EXPECT_EQ(state(), State::retracting);
  unsure = false;
  for (int i = 0; i < 10; ++i) step();
  EXPECT_LT(last.insertion_rate_mm_s, -4);
  supervisor.request(Request::hold, std::nullopt, now);
  for (int i = 0; i < 10; ++i) step();
  EXPECT_EQ(state(), State::hold);
  EXPECT_EQ(last.insertion_rate_mm_s, 0);
}

TEST_F(Retraction, ADepthThatIsNotBehindTheTipIsALatchedStop) {
  for (const double to_mm : {-1.0, 60.0, std::nan("")}) {
    supervisor = Supervisor(config, agar());
    insertion_mm = rotation_rad = 0, last = {};
    steer_to_mm(30);
    retract(to_mm);
    EXPECT_EQ(state(), State::stopped);
    EXPECT_EQ(supervisor.status().reason, Reason::retraction_refused);
    EXPECT_EQ(step().mode, 0);
  }
}

TEST_F(Retraction, NothingMovesByTheWordAlone) {
  insertion_mm = 30;
  give();
  retract(10);
  EXPECT_EQ(step().mode, 0);
  EXPECT_EQ(state(), State::off);
  // Armed, but with axes that are not enabled yet.
  give();
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  ASSERT_EQ(state(), State::armed);
  model::ActuatorState a = axes(now);
  a.insertion_mm = 30;
  a.axis_status = {1, 1};
  supervisor.set_actuator(a);
  retract(10);
  EXPECT_EQ(state(), State::armed);
}

// The estimate is anew, the channel is not: where it ends is not known until the axis is there, or all the way out.
TEST_F(Retraction, AfterAResetItIsNotSteeredInsideItsChannel) {
  const auto start_from = [&](double by_hand_mm) {
    supervisor.request(Request::stop, std::nullopt, now);
    insertion_mm = by_hand_mm, last = {};
    give();
    supervisor.request(Request::arm, Target{{0, -1, 100}, 0}, now);
    ASSERT_EQ(state(), State::armed) << to_string(supervisor.status().reason);
    step();
    supervisor.request(Request::start, std::nullopt, now);
  };
  config.through_channel = true;
  for (const double known_mm : {60.5, 0.5}) {
    supervisor = Supervisor(config, agar());
    insertion_mm = rotation_rad = 0, last = {}, resets = 0;
    steer_to_mm(60);
    retract(20);
    for (int i = 0; i < 2000 && state() == State::retracting; ++i) step();
    for (int i = 0; i < 20; ++i) step();
    ASSERT_EQ(state(), State::hold);
    resets = 1;
    for (int i = 0; i < 20; ++i) step();
    supervisor.request(Request::start, std::nullopt, now);
    EXPECT_EQ(supervisor.status().reason, Reason::channel_unknown) << to_string(supervisor.status().reason);
    EXPECT_EQ(step().mode, 0);
    start_from(45);
    EXPECT_EQ(supervisor.status().reason, Reason::channel_unknown) << to_string(supervisor.status().reason);
    // It may be drawn back further.
    supervisor.request(Request::arm, Target{{0, -1, 100}, 0}, now);
    retract(10);
    EXPECT_LT(step().insertion_rate_mm_s, 0);
    start_from(known_mm);
    EXPECT_EQ(state(), State::steering) << to_string(supervisor.status().reason);
  }
}

// A controller that is started again with the needle inserted has not seen its way in, and an estimator neither: what
// was confirmed since is where it stands, not the channel.
TEST_F(Retraction, ANeedleWhoseWayInNobodyWatchedIsNotDrawnBack) {
  config.through_channel = true;
  const auto refused_when_armed_to_retract = [&](double at_mm) {
    supervisor.request(Request::stop, std::nullopt, now);
    insertion_mm = at_mm, last = {};
    give();
    supervisor.request(Request::arm_to_retract, std::nullopt, now);
    EXPECT_EQ(state(), State::armed) << to_string(supervisor.status().reason);
    step();
    retract(0);
    if (state() == State::retracting) return false;
    EXPECT_EQ(state(), State::stopped);
    EXPECT_EQ(supervisor.status().reason, Reason::way_in_unknown);
    EXPECT_EQ(supervisor.status().value, at_mm);
    EXPECT_EQ(step().mode, 0);
    return true;
  };
  supervisor = Supervisor(config, agar());
  EXPECT_TRUE(refused_when_armed_to_retract(45)) << "a controller begun in the tissue";
  EXPECT_TRUE(refused_when_armed_to_retract(30)) << "drawn back by hand, but not out";
  // Out, and in again.
  insertion_mm = 0.5;
  give();
  insertion_mm = 45;
  give();
  EXPECT_FALSE(refused_when_armed_to_retract(45));
  // An estimator begun in the tissue, and confirmed.
  supervisor.request(Request::stop, std::nullopt, now);
  from_entry = false;
  give();
  from_entry = true;
  EXPECT_TRUE(refused_when_armed_to_retract(45)) << "an estimator begun in the tissue";
  // Where nothing is made of a channel, nothing needs to be known of it.
  config.through_channel = false;
  supervisor = Supervisor(config, agar());
  EXPECT_FALSE(refused_when_armed_to_retract(45));
}

TEST_F(Retraction, ArmedForThatAloneItGoesBackAndNowhereElse) {
  steer_to_mm(40);
  // Within an obstacle's clearance no target can be armed for.
  config.obstacles = {{{0, 3, 40}, {0, 3, 40}, 2.5, 1.0}};
  supervisor = Supervisor(config, agar());
  last = {};
  give();
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  ASSERT_EQ(supervisor.status().reason, Reason::obstacle_near);
  supervisor.request(Request::arm_to_retract, std::nullopt, now);
  ASSERT_EQ(state(), State::armed) << to_string(supervisor.status().reason);
  step();
  supervisor.request(Request::start, std::nullopt, now);
  EXPECT_EQ(state(), State::armed) << "there is no target";
  supervisor.request(Request::follow, Target{{2, -8, 100}, 0, now}, now);
  EXPECT_EQ(state(), State::armed) << to_string(supervisor.status().reason);
  retract(20);
  for (int i = 0; i < 2000 && state() == State::retracting; ++i) step();
  for (int i = 0; i < 20; ++i) step();
  EXPECT_EQ(state(), State::hold) << to_string(supervisor.status().reason);
  EXPECT_NEAR(insertion_mm, 20, 0.1);
  supervisor.request(Request::start, std::nullopt, now);
  EXPECT_EQ(state(), State::hold);
  // Everything else that stops it does.
  supervisor.request(Request::stop, std::nullopt, now);
  supervisor.request(Request::arm_to_retract, std::nullopt, now);
  NeedleView lost = view(now);
  lost.health = 2;
  supervisor.set_needle(lost);
  EXPECT_EQ(supervisor.step(now, 0.02).mode, 0);
  EXPECT_EQ(supervisor.status().reason, Reason::state_unhealthy);
  // And armed for a target again, the obstacle counts.
  insertion_mm = 40;
  give();
  supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
  EXPECT_EQ(supervisor.status().reason, Reason::obstacle_near);
}

TEST_F(Retraction, ATargetThatWentOutOfReachMeanwhileIsRefusedWhenItStarts) {
  for (const bool within : {true, false}) {
    const Eigen::Vector3d seen_mm = within ? Eigen::Vector3d(3, -8, 100) : Eigen::Vector3d(0, 60, 60);
    supervisor = Supervisor(config, agar());
    insertion_mm = rotation_rad = 0, last = {};
    steer_to_mm(40);
    retract(20);
    for (int i = 0; i < 2000 && state() == State::retracting; ++i) {
      step();
      if (i % 10 == 0) supervisor.request(Request::follow, Target{seen_mm, 0, now}, now);
    }
    for (int i = 0; i < 20; ++i) step();
    ASSERT_EQ(state(), State::hold) << to_string(supervisor.status().reason);
    supervisor.request(Request::start, std::nullopt, now);
    EXPECT_EQ(state(), within ? State::steering : State::stopped);
    EXPECT_EQ(supervisor.status().reason, within ? Reason::none : Reason::target_unreachable);
    if (!within) {
      EXPECT_GT(supervisor.status().value, config.safety.target_miss_max_mm);
    }
  }
}

// Drawn back by 40 mm a needle has, by its bend, three times the reach; its channel leaves it what it had.
TEST_F(Retraction, AfterwardsItIsSteeredFromWhereItsChannelEnds) {
  for (const bool through_channel : {true, false}) {
    config.through_channel = through_channel;
    supervisor = Supervisor(config, agar());
    insertion_mm = rotation_rad = 0, last = {};
    steer_to_mm(60);
    retract(20);
    for (int i = 0; i < 2000 && state() == State::retracting; ++i) step();
    for (int i = 0; i < 20; ++i) step();
    ASSERT_EQ(state(), State::hold);
    supervisor.request(Request::arm, Target{{0, -12, 100}, 0}, now);
    EXPECT_EQ(state(), through_channel ? State::stopped : State::armed);
    EXPECT_EQ(supervisor.status().reason, through_channel ? Reason::target_unreachable : Reason::none);
    supervisor.request(Request::arm, Target{{0, -1, 100}, 0}, now);
    EXPECT_EQ(state(), State::armed);
  }
}

}  // namespace
}  // namespace bevel::controller
