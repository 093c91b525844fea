// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Nuisance states: properties of the rig that are not in the model file, estimated after the states of the needle
/// (filter_nuisance.cpp).
///
/// State 0 is the wind-up, the lag of the tip's roll at 100 mm of insertion, rad, as torsional_windup of the effect
/// library. States 1 and 2 are the latencies of cameras 0 and 1, s, in addition to that of the model file. A state with
/// a prior standard deviation of 0 is fixed at 0. If all are, the filter is identical to the plain one bit for bit.
#include <Eigen/Core>

namespace bevel::estimator {

inline constexpr int kNuisance = 3;     ///< number of nuisance states
inline constexpr int kWindup = 0;       ///< index of the wind-up
inline constexpr int kLateCameras = 2;  ///< number of cameras with a latency state: 0 and 1
/// Computes the index of a camera's latency state.
/// @param camera number of the camera, 0 or 1
/// @return index among the nuisance states
inline constexpr int latency_of(int camera) { return 1 + camera; }

/// Derivative of an observed position in {A}, mm, by the nuisance states.
using ByNuisance = Eigen::Matrix<double, 3, kNuisance>;

/// Mean and covariance of the nuisance states, and the state of the wind-up.
struct Nuisance {
  /// Mean: rad, s, s.
  Eigen::Matrix<double, kNuisance, 1> mean = Eigen::Matrix<double, kNuisance, 1>::Zero();
  /// Covariance of the nuisance states.
  Eigen::Matrix<double, kNuisance, kNuisance> covariance = Eigen::Matrix<double, kNuisance, kNuisance>::Zero();
  /// Covariance of the ten errors of the state (rows) with the nuisance states (columns).
  Eigen::Matrix<double, 10, kNuisance> with_state = Eigen::Matrix<double, 10, kNuisance>::Zero();
  /// Covariance of SharedErrors (rows) with the nuisance states (columns).
  Eigen::Matrix<double, 6, kNuisance> with_shared = Eigen::Matrix<double, 6, kNuisance>::Zero();

  double lag_rad = 0,      ///< rotation of the actuator minus that of the tip, rad, within the play of the wind-up
      lag_by_windup = 0;   ///< derivative of the lag by the wind-up
  double inserted_mm = 0;  ///< insertion, mm
  /// Velocity of the tip in the newest step, {A}, mm/s.
  Eigen::Vector3d tip_velocity_mm_s = Eigen::Vector3d::Zero();
};

}  // namespace bevel::estimator
