// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Direction in which the tip moves during insertion: gamma of (15) and (16). It differs from the heading theta, which
/// is e3 of {B}. In {B} it is the direction of V1's velocity (f_x, f_y, 1), bevel/model/kinematics.hpp.
///
/// A long thin needle lies in the tissue where the tip has passed. The tangent of the shaft's end is then this
/// direction, and a camera that sees the shaft measures it instead of e3. With (25) the two differ by alpha: by up to
/// lambda2^2 / (4 lambda1) below gamma = lambda2 / lambda1 (0.025 rad for agar, Table I), with the opposite sign above.
#include <bevel/model/kinematics.hpp>

namespace bevel::model {

/// Direction of motion and its derivatives.
struct MotionDirection {
  Eigen::Vector3d along;                ///< direction of motion, unit vector in {B}
  Eigen::Matrix3d by_turn;              ///< derivative of R along, in {B}, by a body rotation of the pose, 3 x 3, 1/rad
  Eigen::Matrix<double, 3, 2> by_slip;  ///< derivatives of `along` by lambda1 (rad) and lambda2 (dimensionless), 3 x 2
};

/// Computes the direction of motion of the tip. The function does not allocate.
/// @param R orientation of {B} in {A}, 3 x 3
/// @param slip parameters of the slip law
/// @param[out] motion direction and derivatives; not written on failure
/// @return false outside the domain of (25)
bool motion_direction(const Eigen::Matrix3d& R, const SlipParameters& slip, MotionDirection& motion);

}  // namespace bevel::model
