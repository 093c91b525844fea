// SPDX-License-Identifier: MIT
#pragma once
// The plant of the trials: the extended bicycle in a form of its own, and what a camera makes of its tip.
//
// The heading h and a lateral pair (E1, E2) that does not turn with the shaft are carried along; the bevel is the
// angle `roll` in that pair. Per unit of advance, with f = tan(alpha) t, t the direction in which h leans from z:
//   dp = h + f,  dh = omega x h,  omega = K1 E1 + K2 E2 + (h x f) / ell,  (K1, K2) = k (cos roll, sin roll),
// integrated by the midpoint rule at 1 kHz. Units mm, s, rad; frame {A}: origin at the entry, z into the tissue.
#include <Eigen/Core>
#include <vector>

#include "proof/drive_train.hpp"
#include "proof/hidden_physics.hpp"
#include "proof/script.hpp"

namespace bevel::proof {

struct BaseNeedle {
  double curvature_per_mm = 0.0047;
  double wheelbase_mm = 20;
  double lambda1_per_rad = 0.3;
  double lambda2 = 0.1;
};

using TipPath = std::vector<Eigen::Vector3d>;  // every kStep_s

// Throws DomainError naming the recording if the tip leaves the domain of the slip law.
TipPath travel(const BaseNeedle& needle, const AxisMotion& motion, const HiddenPhysics& physics,
               const DriveRipple& ripple, int recording);

// What the cameras would report of the tip without noise at these capture times: a column each, in {A}.
Eigen::Matrix3Xd view(const TipPath& path, const std::vector<double>& times_s, const HiddenPhysics& physics);

}  // namespace bevel::proof
