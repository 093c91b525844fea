// SPDX-License-Identifier: MIT
#pragma once
// The needle by brute force, for tests: (10) with the slip of (25), integrated in steps of 50 us by a midpoint rule on
// rotation matrices, gamma by bisection. Shares no code with the product but Eigen, and knows nothing of legs: an
// effect is what the test writes into its hooks, in plain numbers.
#include <functional>

#include "tests/effects/script.hpp"

namespace bevel::model::testing {

struct Instant {
  double time_s;  // at the end of the step
  double step_s;
  BaseMotion base;       // at the end of the step
  Eigen::Vector3d p_mm;  // of the tip, at its start
  Eigen::Matrix3d R;
  double s_mm, r_rad;    // of the tip's axes, at its start
  double ds_mm, dr_rad;  // of the tip, within the step; zero while `axes` is asked
};

struct BruteForce {
  NeedleParameters needle;
  // Where the tip's axes are at the end of the step; default: where the base is.
  std::function<void(const Instant&, double& s_mm, double& r_rad)> axes = [](const Instant&, double&, double&) {};
  // Curvature in {B}; comes in as (k, 0).
  std::function<void(const Instant&, Eigen::Vector2d& kappa)> curvature = [](const Instant&, Eigen::Vector2d&) {};
  // After each step: R and p_mm are those of its end.
  std::function<void(const Instant&)> after = [](const Instant&) {};
  Eigen::Matrix3d entry = Eigen::Matrix3d::Identity();

  // The tip at the readings of a motion of this script.
  std::vector<Eigen::Vector3d> path(const Script& script, const Motion& readings) const;
};

}  // namespace bevel::model::testing
