// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Insertion in the form that the identification uses: the motion of the two axes, and the measured tip positions.
///
/// The motion consists of legs. Within a leg insertion and rotation are proportional to each other. The kinematic
/// models need no other input; they do not depend on time. A leg has the largest length that the integrator allows (5
/// mm, 0.25 rad), independent of the spacing of the measurements. Predictions at the measurements are interpolated,
/// which makes a fit fast.
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bevel/model/samples.hpp>

namespace bevel::diagnosis {

/// Part of a motion with insertion and rotation proportional to each other.
struct Leg {
  double insertion_mm;  ///< change of the insertion, mm; negative: retraction
  double rotation_rad;  ///< change of the rotation, rad
};

/// One measured tip position.
struct Observation {
  std::int64_t utime = 0;   ///< time of capture, us since the epoch
  double insertion_mm = 0;  ///< insertion of the shaft past the entry point at that time, mm
  std::size_t leg = 0;      ///< index of the leg at that time
  double fraction = 0;      ///< position within the leg, in [0, 1]
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< measured position in {A}, mm
  /// Whitening, 1/mm; the first rank rows are used. whitening * (position - model) has unit variance on the axes that
  /// the camera sees.
  Eigen::Matrix3d whitening = Eigen::Matrix3d::Zero();
  int rank = 0;  ///< number of axes that the camera sees, 1 to 3
};

/// One recorded insertion.
struct Insertion {
  std::string name;                       ///< name, for example of the log file
  std::vector<Leg> legs;                  ///< from the entry point at zero roll with the heading along z of {A}
  std::vector<Observation> observations;  ///< measurements in order of time
  std::size_t skipped = 0;  ///< measurements not used: status not 0, before the entry, or outside the actuators' time
};

/// Converts messages to an insertion. Actuator positions are interpolated linearly between the samples. Insertion below
/// 0 is in air and does not move the model.
/// @param name name of the insertion
/// @param actuators actuator states in order of time, at least two
/// @param measurements tip positions in {A}, in order of time
/// @return legs and observations
/// @throws bevel::ArgumentError if there are fewer than two actuator samples or no usable measurement, or the
/// actuators'
///   time decreases
Insertion make_insertion(std::string name, const std::vector<model::ActuatorState>& actuators,
                         const std::vector<model::TipMeasurement>& measurements);

/// Computes the range of the shaft's roll over the parts of an insertion that advance or retract the needle.
///
/// Rotation without insertion counts if insertion follows it. The roll before the first insertion does not count.
/// @param insertion the insertion
/// @return largest minus smallest roll, rad, at least 0
double roll_range_rad(const Insertion& insertion);

/// Computes the whitening of a measurement: rows sqrt(eigenvalue) * eigenvector^T for the eigenvalues above 1e-9 of the
/// largest.
/// @param information_per_mm2 inverse covariance, 1/mm^2, of any rank
/// @param whitening receives the rows, 1/mm; the remaining rows are zero
/// @return rank, 0 to 3
int whiten(const Eigen::Matrix3d& information_per_mm2, Eigen::Matrix3d& whitening);

}  // namespace bevel::diagnosis
