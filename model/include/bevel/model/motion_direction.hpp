// SPDX-License-Identifier: MIT
#pragma once
// Which way the tip moves when the needle is inserted, gamma of (15) and (16), beside the bicycle's heading theta,
// which is e3 of {B}: in the body along V1's velocity (f_x, f_y, 1), bevel/model/kinematics.hpp.
//
// Where the shaft lies in the tissue where the tip has passed, as long thin needles' do, this is the tangent of its
// end, and what a camera sees of the shaft is this and not e3. With (25) the two differ by alpha: by up to lambda2^2 /
// (4 lambda1) below gamma = lambda2 / lambda1, 0.025 rad for agar (Table I), and the other way beyond.
#include <bevel/model/kinematics.hpp>

namespace bevel::model {

struct MotionDirection {
  Eigen::Vector3d along;                // unit vector in {B}
  Eigen::Matrix3d by_turn;              // of R along, in {B}, by a body rotation of the pose (1/rad)
  Eigen::Matrix<double, 3, 2> by_slip;  // of along, by lambda1 (rad) and lambda2
};

// R: of the pose. False outside the domain of (25); `motion` is then not written. Does not allocate.
bool motion_direction(const Eigen::Matrix3d& R, const SlipParameters& slip, MotionDirection& motion);

}  // namespace bevel::model
