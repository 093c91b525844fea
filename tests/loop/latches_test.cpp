// SPDX-License-Identifier: MIT
// Each latched state over the wire: what causes it, and the one command or condition that clears it
// (docs/running.md#latched-states-and-what-clears-them).
#include <gmock/gmock.h>

#include <bevel/estimator/health.hpp>
#include <bevel/nodes/runtime.hpp>
#include "tests/loop/loop_fixture.hpp"

namespace bevel {
namespace {

using controller::Reason;
using controller::State;
using nodes::Word;
using ::testing::HasSubstr;

const Eigen::Vector3d kTarget(6, -9, 100);

class Latch : public Loop {
 protected:
  // Another run of this process is heard once.
  void hear_second(const std::string& process) {
    nodes::LcmPort other(lcm);
    other.tell_time(now());
    nodes::StatusReporter(other, process, 0).report(io::ProcessState::running, "");
    nodes::pump(lcm);
  }
  void expect_stopped() {
    EXPECT_TRUE(run(0.5, [this] { return state() == State::stopped; })) << said("bevel-controller").reason;
    EXPECT_LT(ms_to_rest(), 200);
  }
  // Requests 1 as an operator repeats them until the controller is armed, then request 2.
  std::string arm_and_start() {
    for (int tries = 0; tries < 4; ++tries) {
      say(Word::arm, kTarget);
      if (run(1.5,
              [this] { return state() == State::armed && stepper->report().state == stepper::DriverState::enabled; }))
        break;
    }
    run(0.1);
    say(Word::start);
    run(1);
    return state() == State::steering ? "" : said("bevel-controller").reason + " / " + said("bevel-estimator").reason;
  }
};

class NameTaken : public Latch, public ::testing::WithParamInterface<const char*> {};

TEST_P(NameTaken, ClearsByArmOnceTheOtherRunIsSilent) {
  steer(kTarget);
  run(1);
  hear_second(GetParam());
  expect_stopped();
  EXPECT_THAT(said(GetParam()).reason, HasSubstr(std::string("another ") + GetParam() + " is heard"));
  // While the other run may still be there it is not armed.
  say(Word::arm, kTarget);
  run(0.1);
  EXPECT_FALSE(state() == State::armed && stepper->report().state == stepper::DriverState::enabled);
  run(1.5);
  EXPECT_EQ(arm_and_start(), "");
}
INSTANTIATE_TEST_SUITE_P(OfEachProcess, NameTaken,
                         ::testing::Values("bevel-controller", "bevel-stepper", "bevel-estimator"));

TEST_F(Latch, OfASecondSenderClearsByArm) {
  steer(kTarget);
  run(1);
  for (int i = 0; i < 3; ++i) {  // a camera's number from elsewhere
    tip_measurement_t m = picture(tip(), 0);
    m.seq += 1'000'000;
    camera_port.publish(io::channel::kTipMeasurement, m);
  }
  expect_stopped();
  EXPECT_NE(needle_state->health & estimator::kInputRefused, 0);
  run(1);
  EXPECT_NE(needle_state->health & estimator::kInputRefused, 0) << "it clears by command only";
  EXPECT_EQ(arm_and_start(), "");
}

TEST_F(Latch, OfACameraThatIsGoneClearsByArm) {
  steer(kTarget);
  run(1);
  see = [this](const Eigen::Vector3d& at, std::int64_t, int which) {
    return which == 1 ? std::nullopt : std::optional(picture(at, which));
  };
  expect_stopped();
  run(2);
  EXPECT_NE(needle_state->health & estimator::kCameraSilent, 0);
  EXPECT_EQ(arm_and_start(), "");
}

// The camera freezes, and is gone before it has changed again.
TEST_F(Latch, OfACameraThatFrozeAndIsGoneClearsByArm) {
  steer(kTarget);
  run(1);
  std::optional<tip_measurement_t> frozen;
  const std::int64_t froze_ms = ms;
  see = [&](const Eigen::Vector3d& at, std::int64_t stamp, int which) -> std::optional<tip_measurement_t> {
    tip_measurement_t m = picture(at, which);
    if (which == 0) return m;
    if (ms - froze_ms > 400) return std::nullopt;
    if (!frozen) frozen = m;
    std::copy_n(frozen->position_mm, 3, m.position_mm);
    m.utime = stamp;
    return m;
  };
  expect_stopped();
  run(1);
  EXPECT_NE(needle_state->health & estimator::kCameraFrozen, 0);
  EXPECT_EQ(arm_and_start(), "");
}

TEST_F(Latch, OfTooManyWayPointsClearsByStopAndArm) {
  run(3);
  for (int i = 0; i < 9; ++i) say(Word::way_point, {0, 0, 10.0 + i});
  EXPECT_EQ(reason(), Reason::way_points_too_many);
  run(0.6);
  say(Word::stop);
  run(0.6);
  EXPECT_EQ(arm_and_start(), "");
}

}  // namespace
}  // namespace bevel
