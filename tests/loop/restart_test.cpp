// SPDX-License-Identifier: MIT
// Processes that are started again while the needle is in the tissue.
#include <Eigen/Geometry>

#include <bevel/estimator/health.hpp>
#include "tests/loop/loop_fixture.hpp"

namespace bevel {
namespace {

using nodes::Word;
const Eigen::Vector3d kTarget(6, -9, 100);

class Restart : public Loop, public ::testing::WithParamInterface<double> {
 protected:
  void insert_to(double depth_mm) {
    steer(kTarget);
    ASSERT_TRUE(run(60, [&] { return tip().z() > depth_mm; }));
    say(Word::stop);
    run(0.5);
  }
  double finish() {
    steer(kTarget);
    EXPECT_TRUE(run(60, [this] { return state() != controller::State::steering; }));
    EXPECT_EQ(state(), controller::State::hold) << said("bevel-controller").reason;
    run(0.5);
    return (tip() - kTarget).norm();
  }
};

TEST_P(Restart, AnEstimatorBegunInTheTissueIsNotReadyUntilConfirmedAndThenArrives) {
  insert_to(GetParam());
  start_estimator();
  run(3);
  EXPECT_NE(needle_state->health & estimator::kNotFromEntry, 0);
  EXPECT_NE(said("bevel-estimator").reason.find("retract to the entry point, or confirm"), std::string::npos);
  EXPECT_NE(steer_to(kTarget), "") << "it must not steer";
  run(1.5);  // the axes are switched on anew
  say(Word::confirm);
  run(0.5);
  EXPECT_EQ(needle_state->health & estimator::kNotFromEntry, 0);
  // What it says of the attitude is what it knows.
  const auto state = estimator->estimator().estimate(utime()).state;
  const Eigen::AngleAxisd apart(state.pose.R.transpose() * rig->plant().tip().R);
  const Eigen::Vector3d turn = apart.angle() * apart.axis();
  for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(turn[i]), 4 * std::sqrt(state.covariance(3 + i, 3 + i))) << i;
  const std::int32_t resets = state.reset_count;
  const double miss_mm = finish();
  std::cout << "restarted at " << GetParam() << " mm: target missed by " << miss_mm << " mm\n";
  EXPECT_LT(miss_mm, 0.8);
  EXPECT_EQ(estimator->estimator().estimate(utime()).state.reset_count, resets);
}

TEST_P(Restart, AStepperBegunInTheTissueAsksWhereItsZeroIs) {
  insert_to(GetParam());
  start_stepper();
  start_estimator();
  EXPECT_NE(steer_to(kTarget), "");
  EXPECT_NE(said("bevel-stepper").state, "enabled");
  say(Word::confirm);
  run(0.5);
  const double miss_mm = finish();
  std::cout << "both restarted at " << GetParam() << " mm: target missed by " << miss_mm << " mm\n";
  EXPECT_LT(miss_mm, 0.8);
}

INSTANTIATE_TEST_SUITE_P(Depths, Restart, ::testing::Values(17.0, 25.0, 40.0, 60.0));

TEST_F(Loop, ANewZeroWithTheTipInTheTissueIsSeenByTheCamera) {
  steer(kTarget);
  run(5);
  say(Word::stop);
  run(0.5);
  start_stepper();
  ASSERT_TRUE(run(5, [this] { return stepper->report().state == stepper::DriverState::ready; }));
  say(Word::entry);  // which is not so
  run(0.5);
  EXPECT_NE(needle_state->health & estimator::kNotFromEntry, 0);
}

TEST_F(Loop, AnEstimatorTurnedBeforeTheEntryKnowsIt) {
  // The shaft stands at 1.3 rad when the estimator begins, with nothing inserted.
  steer(kTarget);
  say(Word::stop);
  run(0.5);
  const double turned_rad = rig->drive(1).position_unit();
  start_estimator();
  run(0.5);
  const auto pose = estimator->estimator().estimate(utime()).state.pose;
  const double roll_rad = std::atan2(pose.R(1, 0), pose.R(0, 0));
  EXPECT_NEAR(std::remainder(roll_rad - turned_rad, 6.283185307179586), 0, 0.05);
}

}  // namespace
}  // namespace bevel
