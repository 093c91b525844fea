// SPDX-License-Identifier: MIT
// Requests of the operator program over LCM, and its heartbeat.
#include <gmock/gmock.h>

#include <bevel/nodes/runtime.hpp>
#include "tests/loop/loop_fixture.hpp"

namespace bevel {
namespace {

using controller::Reason;
using controller::Request;
using controller::State;
using nodes::Word;
using ::testing::HasSubstr;

const Eigen::Vector3d kTarget(6, -9, 100);
constexpr std::int64_t kToRest_ms = 200, kPeriod_ms = 20;  // of the controller

class Operator : public Loop {
 protected:
  std::int64_t timeout_ms() const { return std::llround(1e3 * config.controller.operator_timeout_s); }
  std::string controller_reason() { return said("bevel-controller").reason; }
  std::int64_t rejected() const {
    return controller->port().counters().rejected + stepper->port().counters().rejected +
           estimator->port().counters().rejected;
  }
  // The operator hangs now; how long until both axes are stationary.
  std::int64_t hang() {
    operator_hangs = true;
    const std::int64_t hung_ms = ms;
    EXPECT_TRUE(run(2, [this] { return !controller->supervisor().moves() && at_rest(); }));
    std::cout << "both axes stationary " << ms - hung_ms << " ms after the last heartbeat\n";
    return ms - hung_ms;
  }
};

TEST_F(Operator, EveryRequestPassesEveryReceiversDecode) {
  run(3);
  for (std::int32_t request = 0; request <= io::last_code<Request>(); ++request) {
    run(0.6);
    const std::int64_t before = rejected();
    EXPECT_TRUE(port.publish(io::channel::kSteeringTarget, word(static_cast<Word>(request), kTarget))) << request;
    nodes::pump(lcm);
    EXPECT_EQ(rejected(), before) << "request " << request;
  }
}

// The recovery that docs/running.md gives for a stop in the tissue.
TEST_F(Operator, Request9ArmsForARetractionAfterAStop) {
  steer(kTarget);
  ASSERT_TRUE(run(30, [this] { return tip().z() > 20; }));
  say(Word::stop);
  run(0.6);
  ASSERT_EQ(state(), State::stopped);
  say(Word::arm_to_retract);
  EXPECT_EQ(state(), State::armed) << controller_reason();
  ASSERT_TRUE(run(5, [this] { return stepper->report().state == stepper::DriverState::enabled; }));
  run(0.1);
  say(Word::retract, {0, 0, 5});
  EXPECT_EQ(state(), State::retracting) << controller_reason();
  ASSERT_TRUE(run(30, [this] { return state() == State::hold; })) << controller_reason();
  run(0.5);
  EXPECT_NEAR(rig->drive(0).position_unit(), 5, 0.2);
}

TEST_F(Operator, ThatHangsWhileItSteersIsALatchedStop) {
  steer(kTarget);
  run(2);
  ASSERT_EQ(state(), State::steering);
  const std::int64_t stopped_ms = hang();
  EXPECT_GE(stopped_ms, timeout_ms() - 50) << "the newest heartbeat is up to 50 ms old";
  EXPECT_LE(stopped_ms, timeout_ms() + kPeriod_ms + kToRest_ms);
  EXPECT_EQ(reason(), Reason::operator_silent);
  run(0.1);
  EXPECT_THAT(controller_reason(), HasSubstr("operator program does not respond"));
  EXPECT_THAT(controller_reason(), HasSubstr("allowed: up to 0.5 s"));
  EXPECT_EQ(stepper->report().state, stepper::DriverState::stopped);
  const Eigen::Vector3d stopped = tip();
  operator_hangs = false;  // it goes on, and repeats no request
  run(1);
  EXPECT_LT((tip() - stopped).norm(), 0.05);
  EXPECT_EQ(state(), State::stopped);
  steer(kTarget);
  run(1);
  EXPECT_EQ(state(), State::steering) << controller_reason();
}

TEST_F(Operator, ThatHangsDuringARetractionIsALatchedStop) {
  steer(kTarget);
  ASSERT_TRUE(run(30, [this] { return tip().z() > 30; }));
  say(Word::retract);
  run(1);
  ASSERT_EQ(state(), State::retracting) << controller_reason();
  EXPECT_LE(hang(), timeout_ms() + kPeriod_ms + kToRest_ms);
  EXPECT_EQ(reason(), Reason::operator_silent);
}

TEST_F(Operator, WithoutAHeartbeatNothingIsArmedOrStarted) {
  operator_hangs = true;
  run(3);
  for (const Word request : {Word::arm, Word::arm_to_retract}) {
    say(request, kTarget);
    run(0.1);
    EXPECT_EQ(state(), State::off);
    EXPECT_THAT(controller_reason(), HasSubstr("request " + std::to_string(static_cast<int>(request)) + " is refused"));
    EXPECT_THAT(controller_reason(), HasSubstr("send operator_heartbeat_t at 10 Hz"));
  }
  operator_hangs = false;
  ASSERT_EQ(SimulatedLoop::arm(kTarget), "");
  operator_hangs = true;
  run(0.6);
  for (const Word request : {Word::start, Word::retract}) {
    say(request, kTarget);
    run(0.1);
    EXPECT_EQ(state(), State::armed);
    EXPECT_THAT(controller_reason(), HasSubstr("is refused: newest heartbeat on OPERATOR_HEARTBEAT is"));
  }
  operator_hangs = false;
  run(0.1);
  say(Word::start);
  EXPECT_EQ(state(), State::steering);
}

TEST_F(Operator, AStopIsObeyedWithoutAHeartbeat) {
  steer(kTarget);
  run(1);
  operator_hangs = true;
  run(0.1);
  say(Word::stop);
  EXPECT_EQ(reason(), Reason::operator_stop);
}

TEST_F(Operator, ASecondOneIsRefusedAndCountedAndTakesOverAtRestOnly) {
  nodes::LcmPort second_port(lcm);
  nodes::OperatorHeartbeat second(second_port);
  steer(kTarget);
  run(1);
  each_ms = [&] {
    second_port.tell_time(now());
    second.beat();
  };
  const std::int64_t before = controller->port().counters().rejected;
  run(1);
  EXPECT_EQ(state(), State::steering) << controller_reason();
  EXPECT_GE(controller->port().counters().rejected - before, 19) << "20 Hz for a second";
  EXPECT_THAT(controller_reason(), HasSubstr("a second operator program is refused"));
  EXPECT_LE(hang(), timeout_ms() + kPeriod_ms + kToRest_ms) << "although the second one goes on";
  EXPECT_EQ(reason(), Reason::operator_silent);
  run(0.5);
  steer(kTarget);
  run(1);
  EXPECT_EQ(state(), State::steering) << "the second one, alone: " << controller_reason();
}

// Recorded heartbeats, under old stamps or with a number again, keep nothing alive.
TEST_F(Operator, RecordedHeartbeatsSentAgainDoNotKeepItAlive) {
  std::vector<operator_heartbeat_t> recorded;
  nodes::LcmPort ear(lcm);
  ear.subscribe<operator_heartbeat_t>(io::channel::kOperatorHeartbeat,
                                      [&](const operator_heartbeat_t& m) { recorded.push_back(m); });
  steer(kTarget);
  run(1);
  const std::vector<operator_heartbeat_t> again = recorded;
  ASSERT_GE(again.size(), 20U);
  std::size_t next = 0;
  each_ms = [&] {
    if (ms % 25 != 0 || !operator_hangs) return;
    operator_heartbeat_t m = again.at(next++ % again.size());
    if (next % 2 == 0) m.utime = utime();
    port.publish(io::channel::kOperatorHeartbeat, m);
  };
  EXPECT_LE(hang(), timeout_ms() + kPeriod_ms + kToRest_ms);
  EXPECT_EQ(reason(), Reason::operator_silent);
}

TEST_F(Operator, ClocksThatDisagreeAreNamed) {
  operator_hangs = true;
  std::int64_t seq = 0;
  each_ms = [&] {
    if (ms % 50 != 0) return;
    operator_heartbeat_t m{};
    m.utime = utime() - 3'600'000'000;
    m.seq = seq++;
    m.session = 1;
    port.publish(io::channel::kOperatorHeartbeat, m);
  };
  run(3);
  say(Word::arm, kTarget);
  run(0.1);
  EXPECT_THAT(controller_reason(), HasSubstr("3.6e+03 s old"));
  EXPECT_THAT(controller_reason(), HasSubstr("synchronise the clocks"));
}

}  // namespace
}  // namespace bevel
