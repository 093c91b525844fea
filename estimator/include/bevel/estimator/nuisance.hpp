// SPDX-License-Identifier: MIT
#pragma once
// What a rig does that its file does not say, as slowly known states behind the filter's own (filter_nuisance.cpp):
//   0      wind-up: lag of the tip's roll at 100 mm inserted (rad), as torsional_windup of the library
//   1, 2   by how much the stamps of cameras 0 and 1 are late (s), beside what the model file says
// One that the prior gives no width is held at zero. Not in use where none has any: the plain filter bit for bit.
#include <Eigen/Core>

namespace bevel::estimator {

inline constexpr int kNuisance = 3;
inline constexpr int kWindup = 0;
inline constexpr int kLateCameras = 2;  // of number 0 and 1
inline constexpr int latency_of(int camera) { return 1 + camera; }

using ByNuisance = Eigen::Matrix<double, 3, kNuisance>;  // derivative of what a camera sees

struct Nuisance {
  Eigen::Matrix<double, kNuisance, 1> mean = Eigen::Matrix<double, kNuisance, 1>::Zero();
  Eigen::Matrix<double, kNuisance, kNuisance> covariance = Eigen::Matrix<double, kNuisance, kNuisance>::Zero();
  Eigen::Matrix<double, 10, kNuisance> with_state = Eigen::Matrix<double, 10, kNuisance>::Zero();  // covariance
  Eigen::Matrix<double, 6, kNuisance> with_shared = Eigen::Matrix<double, 6, kNuisance>::Zero();   // of SharedErrors

  // By how much the tip lags behind the base, within plus and minus what the wind-up allows, and its derivative.
  double lag_rad = 0, lag_by_windup = 0;
  double inserted_mm = 0;
  Eigen::Vector3d tip_velocity_mm_s = Eigen::Vector3d::Zero();  // in {A}, of the newest step
};

}  // namespace bevel::estimator
