// SPDX-License-Identifier: MIT
#include <bevel/model/lie.hpp>

#include <gtest/gtest.h>

#include <random>
#include <unsupported/Eigen/MatrixFunctions>

namespace bevel::model {
namespace {

constexpr unsigned kSeed = 20151001;

Vector6d random_twist(std::mt19937& rng, double scale) {
  std::normal_distribution<double> normal(0, scale);
  Vector6d twist;
  for (double& x : twist) x = normal(rng);
  return twist;
}

// Sizes on both sides of the switch between series and closed form.
class Lie : public ::testing::TestWithParam<double> {
 protected:
  void SetUp() override { RecordProperty("seed", kSeed); }
  std::mt19937 rng{kSeed};
};

TEST_P(Lie, ExponentialAgreesWithTheMatrixExponential) {
  for (int i = 0; i < 200; ++i) {
    const Vector6d twist = random_twist(rng, GetParam());
    Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
    m.topLeftCorner<3, 3>() = hat(twist.tail<3>());
    m.topRightCorner<3, 1>() = twist.head<3>();
    const Eigen::Matrix4d reference = m.exp();
    const Pose pose = exp_se3(twist);
    EXPECT_LT((pose.R - reference.topLeftCorner<3, 3>()).norm(), 1e-13);
    EXPECT_LT((pose.p_mm - reference.topRightCorner<3, 1>()).norm(), 1e-12);
  }
}

TEST_P(Lie, RightJacobianIsTheDerivativeOfTheExponential) {
  const double h = 1e-5;
  for (int i = 0; i < 200; ++i) {
    const Vector6d twist = random_twist(rng, GetParam());
    const Pose inverse = exp_se3(twist).inverse();
    Matrix6d numeric;
    for (int j = 0; j < 6; ++j) {
      const Vector6d d = h * Vector6d::Unit(j);
      numeric.col(j) = (log_se3(inverse * exp_se3(twist + d)) - log_se3(inverse * exp_se3(twist - d))) / (2 * h);
    }
    EXPECT_LT((right_jacobian_se3(twist) - numeric).norm(), 1e-8 * (1 + twist.norm()));
    EXPECT_LT((right_jacobian_so3(twist.tail<3>()) - right_jacobian_se3(twist).bottomRightCorner<3, 3>()).norm(),
              1e-14);
  }
}

TEST_P(Lie, AdjointMovesATwistAcrossAPose) {
  for (int i = 0; i < 200; ++i) {
    const Pose pose = exp_se3(random_twist(rng, 0.7));
    const Vector6d twist = random_twist(rng, GetParam());
    const Pose left = pose * exp_se3(twist);
    const Pose right = exp_se3(adjoint(pose) * twist) * pose;
    EXPECT_LT((left.R - right.R).norm() + (left.p_mm - right.p_mm).norm(), 1e-11 * (1 + twist.norm()));
  }
}

TEST_P(Lie, LogarithmInvertsTheExponential) {
  for (int i = 0; i < 200; ++i) {
    Vector6d twist = random_twist(rng, GetParam());
    if (twist.tail<3>().norm() > 3) twist *= 3 / twist.tail<3>().norm();  // unique below half a turn
    EXPECT_LT((log_se3(exp_se3(twist)) - twist).norm(), 1e-9 * (1 + twist.norm()));
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, Lie, ::testing::Values(1e-3, 0.1, 0.3, 1.0));

TEST(LieLongRun, OrthonormalisedKeepsAMillionProductsOnTheGroup) {
  const Eigen::Matrix3d turn = exp_so3({0.01, -0.02, 0.03});
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 1000000; ++i) R = orthonormalised(R * turn);
  EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-14);
}

}  // namespace
}  // namespace bevel::model
