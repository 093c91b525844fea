// SPDX-License-Identifier: MIT
// The loop of tests/loop/simulated_loop.hpp: an insertion that arrives, and what stops one. Rest is that of both axes.
#include "tests/loop/loop_fixture.hpp"

namespace bevel {
namespace {

using nodes::Word;

TEST_F(Loop, SteersToATargetAndHoldsThere) {
  const Eigen::Vector3d target(6, -9, 100);
  steer(target);
  ASSERT_TRUE(run(60, [this] { return state() != controller::State::steering; }));
  EXPECT_EQ(state(), controller::State::hold) << controller::to_string(reason());
  run(0.5);
  const auto& estimate = estimator->estimator().estimate(utime());
  const double miss = (tip() - target).norm();
  const double estimate_error = (estimate.state.pose.p_mm - tip()).norm();
  std::cout << "seed " << kSeed << ": tip to target " << miss << " mm, estimate to tip " << estimate_error
            << " mm, lambda " << estimate.state.lambda1_per_rad << ", " << estimate.state.lambda2 << "\n";
  EXPECT_LT(miss, 0.8);
  EXPECT_LT(estimate_error, 0.6);
  EXPECT_TRUE(at_rest());
}

TEST_F(Loop, ACameraThatFallsSilentStopsTheNeedleAndNothingRestartsByItself) {
  steer({6, -9, 100});
  run(4);
  ASSERT_GT(speed(0), 1.0);
  const See good = see;
  see = [](const auto&...) { return std::nullopt; };
  // The newest picture was taken up to 33 ms ago and is still on its way.
  EXPECT_LT(ms_to_rest(), 200 + latency_us / 1000);
  EXPECT_EQ(reason(), controller::Reason::state_unhealthy);
  EXPECT_EQ(said("bevel-controller").reason, "needle state unhealthy: measurements stale");
  const Eigen::Vector3d stopped = tip();
  see = good;
  run(1);
  EXPECT_EQ(state(), controller::State::stopped);
  EXPECT_LT((tip() - stopped).norm(), 0.05);
}

TEST_F(Loop, OneCameraOfTwoThatFallsSilentStopsTheNeedle) {
  steer({6, -9, 100});
  run(4);
  see = [this](const Eigen::Vector3d& t, std::int64_t, int which) {
    return which == 0 ? std::optional(picture(t, which)) : std::nullopt;
  };
  EXPECT_LT(ms_to_rest(), 200 + latency_us / 1000);
}

TEST_F(Loop, AnEstimatorThatDiesStopsTheNeedleWithin200ms) {
  steer({6, -9, 100});
  run(4);
  estimator.reset();
  EXPECT_LT(ms_to_rest(), 200);
  EXPECT_EQ(reason(), controller::Reason::state_stale);
}

TEST_F(Loop, AControllerThatDiesStopsTheNeedleWithin200ms) {
  steer({6, -9, 100});
  run(4);
  controller.reset();
  EXPECT_LT(ms_to_rest(), 200);
  EXPECT_EQ(stepper->report().stop.reason, stepper::StopReason::setpoint_stale);
}

TEST_F(Loop, AnArmWhileTheControllerIsSilentDoesNotCarryOutItsLastCommand) {
  steer({6, -9, 100});
  run(4);
  controller.reset();
  EXPECT_LT(ms_to_rest(), 200);
  run(0.5);
  const std::array<double, 2> stopped{rig->drive(0).position_unit(), rig->drive(1).position_unit()};
  say(Word::arm, {6, -9, 100});
  ASSERT_TRUE(run(5, [this] { return stepper->report().state == stepper::DriverState::enabled; }));
  run(1);
  EXPECT_LT(std::abs(rig->drive(0).position_unit() - stopped[0]), 0.01);
  EXPECT_LT(std::abs(rig->drive(1).position_unit() - stopped[1]), 0.01);
  EXPECT_EQ(stepper->report().stop.reason, stepper::StopReason::setpoint_stale);
}

TEST_F(Loop, ADriverThatDiesLeavesItToTheDrives) {
  steer({6, -9, 100});
  run(4);
  stepper.reset();
  EXPECT_LT(ms_to_rest(), 200);
}

TEST_F(Loop, AProcessThatIsToldToEndStopsTheAxesFirst) {
  steer({6, -9, 100});
  run(4);
  stepper->end();
  EXPECT_LT(ms_to_rest(), 100);
  EXPECT_EQ(stepper->report().stop.reason, stepper::StopReason::ending);
  EXPECT_EQ(said("bevel-stepper").reason, "told to end");
}

TEST_F(Loop, AControllerThatIsToldToEndStopsTheAxesFirst) {
  steer({6, -9, 100});
  run(4);
  controller->end();
  EXPECT_LT(ms_to_rest(), 100);
  EXPECT_EQ(stepper->report().stop.reason, stepper::StopReason::controller_stop);
  EXPECT_EQ(said("bevel-controller").reason, "told to end");
}

TEST_F(Loop, AHoldComesToRestByTheRampAndGoesOn) {
  steer({6, -9, 100});
  run(4);
  const double before = speed(0);
  say(Word::hold);
  run(0.05);
  EXPECT_GT(speed(0), 0.3 * before) << "ramped, not dropped";
  ASSERT_TRUE(run(0.6, [this] { return at_rest(); }));
  run(1);
  EXPECT_EQ(state(), controller::State::hold);
  EXPECT_EQ(stepper->report().state, stepper::DriverState::enabled);
  say(Word::start);
  run(1);
  EXPECT_EQ(state(), controller::State::steering) << controller::to_string(reason());
  EXPECT_GT(speed(0), 1.0);
}

TEST_F(Loop, ADriveFaultStopsBothAxesAndTheControllerKnows) {
  steer({6, -9, 100});
  run(4);
  rig->drive(1).raise_fault(0x2310);
  EXPECT_LT(ms_to_rest(), 200);
  run(0.2);
  EXPECT_EQ(state(), controller::State::stopped);
  EXPECT_EQ(reason(), controller::Reason::axes_not_enabled);
  EXPECT_EQ(stepper->report().state, stepper::DriverState::fault);
}

TEST_F(Loop, OperatorStopIsLatchedUntilArmedAgain) {
  steer({6, -9, 100});
  run(4);
  say(Word::stop);
  EXPECT_LT(ms_to_rest(), 100);
  say(Word::start);
  run(0.5);
  EXPECT_TRUE(at_rest());
  steer({6, -9, 100});
  run(1);
  EXPECT_GT(speed(0), 1.0);
}

TEST_F(Loop, ATargetOutOfReachIsRefusedBeforeTheNeedleMoves) {
  ASSERT_TRUE(run(5, [this] { return stepper->report().state == stepper::DriverState::ready; }));
  run(0.3);
  say(Word::arm, {0, 50, 60});
  EXPECT_EQ(reason(), controller::Reason::target_unreachable);
}

}  // namespace
}  // namespace bevel
