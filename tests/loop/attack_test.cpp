// SPDX-License-Identifier: MIT
// Messages from others than those who should send them, and clocks that are set: nothing moves the needle, blinds the
// estimator or clears a stop.
#include <limits>

#include <bevel/estimator/health.hpp>
#include "tests/loop/loop_fixture.hpp"

namespace bevel {
namespace {

using nodes::Word;
constexpr std::int64_t kHour_us = 3'600'000'000;
constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();

motion_command_t forward(std::int64_t utime, std::int64_t seq) {
  motion_command_t m{};
  m.utime = utime;
  m.seq = seq;
  m.mode = 1;
  m.insertion_rate_mm_s = 10;
  return m;
}

actuator_state_t axes_of(const stepper::AxesReport& report, std::int64_t utime, std::int64_t seq) {
  actuator_state_t m{};
  m.utime = utime;
  m.seq = seq;
  for (int i = 0; i < 2; ++i)
    m.axis_status[i] = static_cast<std::int32_t>(report.status.at(static_cast<std::size_t>(i)));
  m.insertion_mm = report.insertion_mm;
  m.rotation_rad = report.rotation_rad;
  return m;
}

class Attack : public Loop {
 protected:
  void arm() { ASSERT_EQ(SimulatedLoop::arm({6, -9, 100}), ""); }
};

TEST_F(Attack, ASecondSenderOfCommandsIsDeclaredBeforeTheNeedleMovesAMillimetre) {
  arm();
  const double before_mm = rig->drive(0).position_unit();
  std::int64_t seq = 0;
  run(0.6, [&] {
    if (ms % 20 == 10) port.publish(io::channel::kMotionCommand, forward(utime(), seq++));
    return false;
  });
  EXPECT_LT(std::abs(rig->drive(0).position_unit() - before_mm), 0.3);
  EXPECT_EQ(stepper->report().stop.reason, stepper::StopReason::input_refused);
  EXPECT_EQ(said("bevel-stepper").reason,
            "commands cannot be trusted: a second sender on MOTION_COMMAND, or old messages sent again");
  EXPECT_EQ(said("bevel-controller").state, "stopped");
}

// (now - stamp) * 1000 wraps round to something fresh for these.
TEST_F(Attack, StampsAtTheEndsOfTimeMoveNothingAndLockNobodyOut) {
  for (const std::int64_t stamp : {utime() + 18'446'744'073'709'552, kLargest, kLargest - 1, std::int64_t{1}}) {
    arm();
    const double before_mm = rig->drive(0).position_unit();
    for (const std::int64_t seq : {std::int64_t{0}, kLargest}) {
      port.publish(io::channel::kMotionCommand, forward(stamp, seq));
      run(0.3);
    }
    EXPECT_LT(std::abs(rig->drive(0).position_unit() - before_mm), 0.05) << stamp;
    EXPECT_EQ(stepper->report().state, stepper::DriverState::stopped);
    // The real controller is heard again as soon as the operator has armed anew.
    steer({6, -9, 100});
    run(1);
    EXPECT_GT(speed(0), 1.0) << stamp;
    say(Word::stop);
    run(0.5);
  }
}

TEST_F(Attack, AnOldWordOfTheOperatorClearsNoStop) {
  steer({6, -9, 100});
  run(2);
  const steering_target_t armed_before = word(Word::arm, {6, -9, 100}),
                          started_before = word(Word::start, {6, -9, 100});
  say(Word::stop);
  run(0.5);
  const Eigen::Vector3d stopped = tip();
  const auto send = [&](steering_target_t m) {
    port.publish(io::channel::kSteeringTarget, m);
    run(0.3);
  };
  steering_target_t hour_old = word(Word::arm, {6, -9, 100});
  hour_old.utime -= kHour_us;
  hour_old.seq = 0;
  send(hour_old);
  steering_target_t ahead = word(Word::arm, {6, -9, 100});
  ahead.utime += kHour_us;
  send(ahead);
  // Said before the stop, sent again with a new stamp: it names the session of before.
  for (steering_target_t replayed : {armed_before, started_before}) {
    replayed.utime = utime();
    replayed.seq = target_seq++;
    send(replayed);
  }
  EXPECT_EQ(state(), controller::State::stopped);
  EXPECT_EQ(reason(), controller::Reason::operator_stop);
  EXPECT_EQ(stepper->report().state, stepper::DriverState::stopped);
  EXPECT_LT((tip() - stopped).norm(), 0.05);
}

TEST_F(Attack, AFalseAxesMessageStopsAndDoesNotBlindTheEstimator) {
  const auto change_time = [this](actuator_state_t& m) { m.utime = utime() + kHour_us; };
  const auto change_turn = [](actuator_state_t& m) { m.rotation_rad = 1e7; };
  const auto change_depth = [](actuator_state_t& m) { m.insertion_mm = 1e5; };
  for (const std::function<void(actuator_state_t&)>& change :
       std::initializer_list<std::function<void(actuator_state_t&)>>{change_time, change_turn, change_depth}) {
    steer({6, -9, 100});
    run(1);
    // The number that comes next, so that only what it says is wrong.
    std::int64_t seq = 0;
    nodes::LcmPort ear(lcm);
    ear.subscribe<actuator_state_t>(io::channel::kActuatorState, [&seq](const actuator_state_t& m) { seq = m.seq; });
    run(0.02);
    actuator_state_t m = axes_of(stepper->report(), utime(), seq + 1);
    change(m);
    port.publish(io::channel::kActuatorState, m);
    EXPECT_LT(ms_to_rest(), 200);
    EXPECT_EQ(state(), controller::State::stopped);
    EXPECT_NE(needle_state->health & estimator::kInputRefused, 0);
    const std::int64_t newest = needle_state->utime;
    run(0.2);
    EXPECT_GT(needle_state->utime, newest + 150'000) << "it goes on estimating";
    EXPECT_LT((estimator->estimator().estimate(utime()).state.pose.p_mm - tip()).norm(), 1.0);
    say(Word::arm, {6, -9, 100});  // believed again, and healthy by the next word
    run(1);
  }
}

TEST_F(Attack, AWallClockThatIsSetIsADeclaredReset) {
  for (const std::int64_t step_us : {-kHour_us, kHour_us, std::int64_t{-200'000}}) {
    steer({6, -9, 100});
    run(1);
    const std::int32_t resets = needle_state->reset_count;
    clock_offset_us += step_us;
    EXPECT_LT(ms_to_rest(), 200);
    run(0.3);
    EXPECT_EQ(state(), controller::State::stopped);
    EXPECT_NE(said("bevel-controller").reason.find("the wall clock was set"), std::string::npos)
        << said("bevel-controller").reason;
    EXPECT_NE(said("bevel-estimator").reason.find("the wall clock was set"), std::string::npos);
    EXPECT_GT(needle_state->reset_count, resets);
    EXPECT_LT(std::abs(needle_state->utime - utime()), 50'000) << "states go on under the new time";
    EXPECT_EQ(needle_state->health, 0);
    EXPECT_LT((estimator->estimator().estimate(utime()).state.pose.p_mm - tip()).norm(), 1.0);
  }
  steer({6, -9, 100});
  run(1);
  EXPECT_GT(speed(0), 1.0);
}

TEST_F(Attack, ANeedleStateFromElsewhereIsNotSteeredOn) {
  steer({6, -9, 100});
  run(2);
  needle_state_t aside = *needle_state;
  aside.position_mm[0] += 10;
  aside.utime = utime();
  ++aside.seq;
  port.publish(io::channel::kNeedleState, aside);
  EXPECT_LT(ms_to_rest(), 100);
  EXPECT_EQ(reason(), controller::Reason::input_refused);
}

TEST_F(Attack, ASecondCameraProcessIsNotCountedTwice) {
  steer({6, -9, 100});
  run(2);
  std::int64_t seq = 0;
  const std::int64_t from = ms;
  run(1, [&] {
    if (ms % 33 == 5) {
      tip_measurement_t m = picture(tip(), 0);
      m.seq = seq++;
      port.publish(io::channel::kTipMeasurement, m);
    }
    return at_rest();
  });
  EXPECT_LT(ms - from, 200);
  EXPECT_NE(needle_state->health & estimator::kInputRefused, 0);
}

}  // namespace
}  // namespace bevel
