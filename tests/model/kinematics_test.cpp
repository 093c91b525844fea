// SPDX-License-Identifier: MIT
#include <bevel/model/motion_direction.hpp>

#include <gtest/gtest.h>

#include <random>

namespace bevel::model {
namespace {

constexpr unsigned kSeed = 10;

NeedleParameters agar() {
  NeedleParameters needle;
  needle.lambda1_per_rad = 0.49;
  needle.lambda2 = 0.22;
  return needle;
}

StepInput input_for(const NeedleParameters& needle, double insertion_mm, double rotation_rad) {
  return {insertion_mm, rotation_rad, {needle.curvature_per_mm, 0}};
}

TEST(MotionDirection, IsThatOfTheTwistAndItsDerivativesThoseOfPerturbation) {
  std::mt19937_64 rng(kSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const SlipDirection direction : {SlipDirection::isotropic, SlipDirection::bevel_plane})
    for (int trial = 0; trial < 60; ++trial) {
      NeedleParameters needle = agar();
      needle.slip = direction;
      const SlipParameters slip = slip_parameters(needle);
      const Eigen::Matrix3d R = exp_so3({0.5 * unit(rng), 0.5 * unit(rng), unit(rng)});
      MotionDirection motion;
      ASSERT_TRUE(motion_direction(R, slip, motion));
      Vector6d twist;
      ASSERT_TRUE(body_twist(R, input_for(needle, 1.0, 0), slip, twist));
      EXPECT_LT((motion.along - twist.head<3>().normalized()).norm(), 1e-14);
      constexpr double kStep = 1e-6;
      const auto at = [&](const Eigen::Vector3d& omega, double lambda1, double lambda2) {
        SlipParameters moved = slip;
        moved.lambda1_per_rad += lambda1, moved.lambda2 += lambda2;
        MotionDirection there;
        EXPECT_TRUE(motion_direction(R * exp_so3(omega), moved, there));
        return Eigen::Vector3d(exp_so3(omega) * there.along);  // seen in the body as it was
      };
      const Eigen::Vector3d none = Eigen::Vector3d::Zero();
      for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d omega = kStep * Eigen::Vector3d::Unit(i);
        EXPECT_LT(((at(omega, 0, 0) - at(-omega, 0, 0)) / (2 * kStep) - motion.by_turn.col(i)).norm(), 1e-8) << trial;
      }
      EXPECT_LT(((at(none, kStep, 0) - at(none, -kStep, 0)) / (2 * kStep) - motion.by_slip.col(0)).norm(), 1e-8);
      EXPECT_LT(((at(none, 0, kStep) - at(none, 0, -kStep)) / (2 * kStep) - motion.by_slip.col(1)).norm(), 1e-8);
    }
  MotionDirection motion;
  ASSERT_TRUE(motion_direction(Eigen::Matrix3d::Identity(), slip_parameters(agar()), motion));
  EXPECT_EQ(motion.along, Eigen::Vector3d::UnitZ()) << "along z_A, where the direction of the tilt is undefined";
  EXPECT_TRUE(motion.by_turn.allFinite());
  EXPECT_FALSE(motion_direction(exp_so3({2.5, 0, 0}), slip_parameters(agar()), motion)) << "outside the domain";
}

TEST(Kinematics, TwistIsThePrintedOneInEveryVariant) {
  // Heading tilted toward -y by 0.2 rad and then the shaft turned by a quarter: body -x is the tilt's direction.
  Pose pose;
  pose.R = exp_so3({0.2, 0, 0}) * exp_so3({0, 0, EIGEN_PI / 2});
  NeedleParameters needle = agar();
  const double gamma = (-0.78 + std::sqrt(0.78 * 0.78 + 4 * 0.49 * 0.2)) / (2 * 0.49);  // the quadratic, solved plainly
  const double f = std::tan(gamma - 0.2);
  const double k = needle.curvature_per_mm, ell = needle.wheelbase_mm;
  const StepInput input = input_for(needle, 1.0, 0.3);
  Vector6d twist;
  ASSERT_TRUE(body_twist(pose.R, input, slip_parameters(needle), twist));
  // World -y seen in the body turned by +90 degrees about z is body -x.
  EXPECT_LT((twist - (Vector6d() << -f, 0, 1, k, -f / ell, 0.3).finished()).norm(), 1e-14);
  needle.front_wheel = FrontWheel::nonslip;
  ASSERT_TRUE(body_twist(pose.R, input, slip_parameters(needle), twist));
  EXPECT_LT((twist - (Vector6d() << -f, 0, 1, k, f / ell, 0.3).finished()).norm(), 1e-14);
  needle.slip = SlipDirection::bevel_plane;
  ASSERT_TRUE(body_twist(pose.R, input, slip_parameters(needle), twist));
  EXPECT_LT((twist - (Vector6d() << 0, 0, 1, k, 0, 0.3).finished()).norm(), 1e-14);
}

TEST(Kinematics, ZeroLambdaIsTheBicycleToTheLastDigit) {
  // For a constant twist the step is the exponential whatever its length: one step of the whole insertion would do.
  NeedleParameters needle;
  const double k = needle.curvature_per_mm;
  Pose pose;
  for (int i = 0; i < 260; ++i) ASSERT_TRUE(step(pose, input_for(needle, 0.5, 0), slip_parameters(needle)));
  const double turned = 130 * k;  // a circle of radius 1/k toward -y
  EXPECT_NEAR(pose.p_mm.y(), -(1 - std::cos(turned)) / k, 1e-11);
  EXPECT_NEAR(pose.p_mm.z(), std::sin(turned) / k, 1e-11);
  EXPECT_EQ(pose.p_mm.x(), 0.0);

  // Both slips and both front wheels give bit for bit the same: nothing of f is left.
  for (const auto direction : {SlipDirection::isotropic, SlipDirection::bevel_plane})
    for (const auto wheel : {FrontWheel::published, FrontWheel::nonslip}) {
      SlipParameters slip{0, 0, 20, direction, wheel};
      Pose a, b;
      for (int i = 0; i < 100; ++i) {
        const StepInput input = input_for(needle, 0.4, 0.1 * std::sin(i));
        ASSERT_TRUE(step(a, input, slip));
        ASSERT_TRUE(step(b, input, SlipParameters{}));
      }
      EXPECT_EQ(a.p_mm, b.p_mm);
      EXPECT_EQ(a.R, b.R);
    }
}

TEST(Kinematics, HelixOfTheSpinningBicycleIsTheExponential) {
  NeedleParameters needle;
  Pose pose;
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(step(pose, input_for(needle, 1.0, 0.05), slip_parameters(needle)));
  const Pose exact = exp_se3((Vector6d() << 0, 0, 100, 100 * needle.curvature_per_mm, 0, 5).finished());
  EXPECT_LT((pose.p_mm - exact.p_mm).norm(), 1e-10);
}

class Jacobians : public ::testing::TestWithParam<std::tuple<SlipDirection, FrontWheel>> {};

TEST_P(Jacobians, AgreeWithPerturbationOnRandomStates) {
  RecordProperty("seed", kSeed);
  std::mt19937 rng(kSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  double worst = 0;
  for (int trial = 0; trial < 300; ++trial) {
    NeedleParameters needle = agar();
    std::tie(needle.slip, needle.front_wheel) = GetParam();
    needle.lambda1_per_rad = 0.3 + 0.25 * unit(rng);
    needle.lambda2 = 0.15 + 0.15 * unit(rng);
    if (trial == 0) needle.lambda1_per_rad = needle.lambda2 = 0;
    Pose start;
    // Trial 1 begins exactly along z_A, where the direction of the tilt is undefined.
    if (trial != 1) start.R = exp_so3({0.5 * unit(rng), 0.5 * unit(rng), 3 * unit(rng)});
    start.p_mm = 50 * Eigen::Vector3d(unit(rng), unit(rng), unit(rng));
    // Some of these are cut into several steps; every third is a short one.
    const double size_mm = trial % 3 == 2 ? 0.2 : 4, size_rad = trial % 3 == 2 ? 0.004 : 1.2;
    const StepInput input{size_mm * unit(rng), size_rad * unit(rng), {0.008 * unit(rng), 0.004 * unit(rng)}};
    const SlipParameters slip = slip_parameters(needle);
    Pose end = start;
    StepJacobian jacobian;
    ASSERT_TRUE(advance(end, input, slip, jacobian));
    Pose again = start, plain = start;
    NeedleJacobian needle_jacobian;
    ASSERT_TRUE(advance(again, input, slip, needle_jacobian));
    ASSERT_TRUE(advance(plain, input, slip));
    EXPECT_LT((again.p_mm - end.p_mm).norm() + (plain.p_mm - end.p_mm).norm(), 1e-13);
    EXPECT_LT((again.R - end.R).norm() + (plain.R - end.R).norm(), 1e-13);
    EXPECT_LT((needle_jacobian.pose - jacobian.pose).norm(), 1e-13);
    EXPECT_LT((needle_jacobian.needle.col(0) - jacobian.input.col(2)).norm(), 1e-13);
    EXPECT_LT((needle_jacobian.needle.rightCols<3>() - jacobian.slip).norm(), 1e-13);

    const auto difference = [&](auto&& perturb, double h) {
      Pose plus = start, minus = start;
      StepInput input_plus = input, input_minus = input;
      SlipParameters slip_plus = slip, slip_minus = slip;
      perturb(plus, input_plus, slip_plus, h);
      perturb(minus, input_minus, slip_minus, -h);
      EXPECT_TRUE(advance(plus, input_plus, slip_plus));
      EXPECT_TRUE(advance(minus, input_minus, slip_minus));
      return Vector6d((log_se3(end.inverse() * plus) - log_se3(end.inverse() * minus)) / (2 * h));
    };
    const auto check = [&](const Vector6d& analytic, const Vector6d& numeric, const char* what) {
      const double error = (analytic - numeric).norm() / (1 + numeric.norm());
      worst = std::max(worst, error);
      // Along z_A the slip law's second derivative jumps, so central differences are first order there.
      EXPECT_LT(error, trial == 1 ? 2e-6 : 2e-7) << what << " trial " << trial;
    };
    for (int j = 0; j < 6; ++j)
      check(jacobian.pose.col(j),
            difference([j](Pose& p, StepInput&, SlipParameters&, double h) { p = p * exp_se3(h * Vector6d::Unit(j)); },
                       1e-5),
            "pose");
    check(jacobian.input.col(0),
          difference([](Pose&, StepInput& i, SlipParameters&, double h) { i.insertion_mm += h; }, 1e-5), "insertion");
    check(jacobian.input.col(1),
          difference([](Pose&, StepInput& i, SlipParameters&, double h) { i.rotation_rad += h; }, 1e-5), "rotation");
    for (int j = 0; j < 2; ++j)
      check(jacobian.input.col(2 + j),
            difference([j](Pose&, StepInput& i, SlipParameters&, double h) { i.curvature_per_mm[j] += h; }, 1e-5),
            "curvature");
    if (trial == 0) continue;  // lambda at the bicycle has a one-sided neighbourhood
    check(jacobian.slip.col(0),
          difference([](Pose&, StepInput&, SlipParameters& s, double h) { s.lambda1_per_rad += h; }, 1e-5), "lambda1");
    check(jacobian.slip.col(1),
          difference([](Pose&, StepInput&, SlipParameters& s, double h) { s.lambda2 += h; }, 1e-5), "lambda2");
    check(jacobian.slip.col(2),
          difference([](Pose&, StepInput&, SlipParameters& s, double h) { s.wheelbase_mm += h; }, 1e-3), "wheelbase");
  }
  RecordProperty("worst_relative_error", std::to_string(worst));
}

INSTANTIATE_TEST_SUITE_P(Variants, Jacobians,
                         ::testing::Combine(::testing::Values(SlipDirection::isotropic, SlipDirection::bevel_plane),
                                            ::testing::Values(FrontWheel::published, FrontWheel::nonslip)));

TEST(Kinematics, HalvingTheStepMovesTheTipByLessThanATenthOfAMicrometre) {
  // 130 mm at the largest increments a sample brings: 60 mm/s and one turn per second at 50 Hz.
  const auto insert = [](int parts) {
    Pose pose;
    for (int i = 0; i < 108 * parts; ++i)
      EXPECT_TRUE(step(pose, input_for(agar(), 1.2 / parts, 0.126 / parts), slip_parameters(agar())));
    return pose.p_mm;
  };
  EXPECT_LT((insert(1) - insert(2)).norm(), 1e-4);
  // And at the largest step that advance() takes.
  Pose coarse, fine;
  for (int i = 0; i < 26; ++i) ASSERT_TRUE(advance(coarse, input_for(agar(), 5.0, 1.0), slip_parameters(agar())));
  for (int i = 0; i < 260; ++i) ASSERT_TRUE(advance(fine, input_for(agar(), 0.5, 0.1), slip_parameters(agar())));
  EXPECT_LT((coarse.p_mm - fine.p_mm).norm(), 1e-4);
  // And at the largest that it takes by the midpoint rule.
  for (const double turn_rad : {0.0, 0.002, 0.006}) {
    Pose midpoint, fourth_order;
    const double step_mm = (0.01 - turn_rad) / 0.0201;
    for (int i = 0; i < static_cast<int>(130 / step_mm); ++i) {
      ASSERT_TRUE(advance(midpoint, input_for(agar(), step_mm, turn_rad), slip_parameters(agar())));
      ASSERT_TRUE(step(fourth_order, input_for(agar(), step_mm, turn_rad), slip_parameters(agar())));
    }
    EXPECT_LT((midpoint.p_mm - fourth_order.p_mm).norm(), 1e-4) << turn_rad;
    EXPECT_NE(midpoint.p_mm, fourth_order.p_mm);
  }
}

TEST(Kinematics, AtRestNothingMoves) {
  Pose pose;
  pose.R = exp_so3({0.3, 0.1, 0.7});
  const Pose before = pose;
  StepJacobian jacobian;
  ASSERT_TRUE(advance(pose, input_for(agar(), 0, 0), slip_parameters(agar())));
  ASSERT_TRUE(advance(pose, input_for(agar(), 0, 0), slip_parameters(agar()), jacobian));
  EXPECT_EQ(pose.p_mm, before.p_mm);
  EXPECT_EQ(pose.R, before.R);
  EXPECT_EQ(jacobian.pose, Matrix6d::Identity());
}

TEST(Kinematics, IsotropicSlipDoesNotKnowTheRollAndBevelPlaneDoes) {
  // A straight needle (k = 0) that enters at an angle: turning the shaft must not change an isotropic path.
  NeedleParameters needle = agar();
  needle.curvature_per_mm = 0;
  for (const auto direction : {SlipDirection::isotropic, SlipDirection::bevel_plane}) {
    needle.slip = direction;
    Pose still, turning;
    still.R = turning.R = exp_so3({0.3, 0, 0});
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(step(still, input_for(needle, 1, 0), slip_parameters(needle)));
      ASSERT_TRUE(step(turning, input_for(needle, 1, 0.05), slip_parameters(needle)));
    }
    const double apart = (still.p_mm - turning.p_mm).norm();
    if (direction == SlipDirection::isotropic)
      EXPECT_LT(apart, 1e-6);
    else
      EXPECT_GT(apart, 1.0);
  }
}

TEST(Kinematics, LeavingTheDomainIsSaidAndLeavesThePoseAlone) {
  Pose pose;
  pose.R = exp_so3({2.6, 0, 0});  // gamma would be 1.64 rad
  const Pose before = pose;
  StepJacobian jacobian;
  EXPECT_FALSE(step(pose, input_for(agar(), 1, 0), slip_parameters(agar())));
  EXPECT_FALSE(advance(pose, input_for(agar(), 10, 0), slip_parameters(agar()), jacobian));
  EXPECT_EQ(pose.p_mm, before.p_mm);
  EXPECT_EQ(pose.R, before.R);
}

}  // namespace
}  // namespace bevel::model
