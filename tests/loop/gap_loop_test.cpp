// SPDX-License-Identifier: MIT
// A driver of the axes that stalls, or is started again, while the needle is in the tissue: what the estimate is worth
// afterwards, and when the needle may be steered again.
#include <boost/math/distributions/chi_squared.hpp>

#include <bevel/estimator/health.hpp>
#include <bevel/model/lie.hpp>
#include "tests/loop/loop_fixture.hpp"

namespace bevel {
namespace {

using nodes::Component;
using nodes::FaultKind;
using nodes::Word;
const Eigen::Vector3d kTarget(6, -9, 100);

struct Case {
  double depth_mm, gap_s;
};

class GapLoop : public Loop, public ::testing::WithParamInterface<Case> {
 protected:
  // Squared Mahalanobis distance of the true pose: chi-square of six.
  double pose_nees() {
    const estimator::Estimate e = estimator->estimator().estimate(utime());
    const model::Vector6d error = model::log_se3(e.tip.inverse() * rig->plant().tip());
    return error.dot(e.state.covariance.topLeftCorner<6, 6>().ldlt().solve(error));
  }
  void insert_to(double depth_mm) {
    steer(kTarget);
    ASSERT_TRUE(run(60, [&] { return tip().z() > depth_mm; }));
  }
  void expect_arrival() {
    ASSERT_EQ(steer_to(kTarget), "") << said("bevel-controller").reason;
    EXPECT_TRUE(run(60, [this] { return state() != controller::State::steering; }));
    EXPECT_EQ(state(), controller::State::hold) << said("bevel-controller").reason;
    run(0.5);
    EXPECT_LT((tip() - kTarget).norm(), 0.8);
  }
  // A consistent filter exceeds it once in ten thousand times.
  const double allowed_ = boost::math::quantile(boost::math::chi_squared(6), 0.9999);
};

TEST_P(GapLoop, AStalledDriverLeavesAHeadingAsUncertainAsStated) {
  insert_to(GetParam().depth_mm);
  injector(Component::stepper)->begin(FaultKind::off, ns(), 1);
  run(GetParam().gap_s);
  EXPECT_EQ(reason(), controller::Reason::actuator_stale) << said("bevel-controller").reason;
  stepper->port().inject(nullptr);
  ASSERT_TRUE(run(1, [this] { return needle_state->reset_count > 0; }));
  EXPECT_EQ(estimator->estimator().estimate(utime()).state.reset_cause, estimator::ResetCause::gap);
  EXPECT_NE(needle_state->health & estimator::kResetByGap, 0);
  EXPECT_LT(pose_nees(), allowed_);
  run(1.5);
  EXPECT_LT(pose_nees(), allowed_);
  EXPECT_EQ(needle_state->reset_count, 1);
  expect_arrival();
  EXPECT_LT(pose_nees(), allowed_);
}

// The new driver numbers its messages from zero and has another zero of the axes, so that their way in is not known.
TEST_P(GapLoop, ADriverStartedAgainIsNotTrustedUntilConfirmed) {
  insert_to(GetParam().depth_mm);
  stepper.reset();
  run(GetParam().gap_s);
  start_stepper();
  run(2);
  EXPECT_NE(needle_state->health & estimator::kNotFromEntry, 0);
  EXPECT_LT(pose_nees(), allowed_);
  EXPECT_NE(steer_to(kTarget), "") << "it must not steer";
  run(1.5);
  say(Word::confirm);
  run(0.5);
  EXPECT_EQ(needle_state->health & estimator::kNotFromEntry, 0);
  EXPECT_LT(pose_nees(), allowed_);
  expect_arrival();
}

INSTANTIATE_TEST_SUITE_P(DepthsAndLengths, GapLoop,
                         ::testing::Values(Case{17, 1.5}, Case{25, 2.0}, Case{40, 2.5}, Case{60, 1.5}, Case{40, 0.3}));

// Confirmed or not, a heading that is hardly known is none to steer by.
TEST_F(GapLoop, AfterALongGapTheArmIsRefusedUntilTheHeadingIsKnownAlsoOnceConfirmed) {
  insert_to(40);
  injector(Component::stepper)->begin(FaultKind::off, ns(), 1);
  run(12);
  stepper->port().inject(nullptr);
  run(1);
  say(Word::confirm);
  run(0.5);
  EXPECT_NE(needle_state->health & estimator::kHeadingUncertain, 0);
  const std::string refused = steer_to(kTarget);
  EXPECT_NE(refused, "");
  run(1.5);
  EXPECT_NE(steer_to(kTarget), "");
  EXPECT_NE(said("bevel-controller").reason.find("heading too uncertain"), std::string::npos)
      << said("bevel-controller").reason;
}

// A camera that was wrong, was rejected, and is gone.
TEST_F(Loop, ACameraThatVanishesWhileItIsRejectedIsRejectedNoMoreAndTheOtherSteersAfterAnArm) {
  steer(kTarget);
  run(4);
  see = [this, gone = ms + 300](const Eigen::Vector3d& t, std::int64_t, int which) -> std::optional<tip_measurement_t> {
    if (which == 0) return picture(t, which);
    if (ms > gone) return std::nullopt;
    tip_measurement_t m = picture(t, which);
    m.position_mm[0] += 6;
    return m;
  };
  ASSERT_TRUE(run(1, [this] { return needle_state && (needle_state->health & estimator::kRejecting) != 0; }));
  run(2);
  EXPECT_EQ(needle_state->health & estimator::kRejecting, 0);
  EXPECT_NE(needle_state->health & estimator::kCameraSilent, 0) << "which an arm clears";
  (void)arm(kTarget);
  run(1.5);
  EXPECT_EQ(steer_to(kTarget), "");
}

// A command of the operator clears what is latched, while the source still sends too.
TEST_F(Loop, AnArmForgetsRejectsOfACameraThatIsRightAgain) {
  steer(kTarget);
  run(4);
  see = [this, until = ms + 300](const Eigen::Vector3d& t, std::int64_t, int which) {
    tip_measurement_t m = picture(t, which);
    if (which == 1 && ms < until) m.position_mm[0] += 6;
    return std::optional(m);
  };
  ASSERT_TRUE(run(1, [this] { return (needle_state->health & estimator::kRejecting) != 0; }));
  say(Word::arm, kTarget);
  run(0.05);
  EXPECT_EQ(needle_state->health & estimator::kRejecting, 0);
}

}  // namespace
}  // namespace bevel
