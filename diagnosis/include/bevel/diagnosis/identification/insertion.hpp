// SPDX-License-Identifier: MIT
#pragma once
// One insertion as identification sees it: what the two axes did, and where the tip was seen.
//
// The motion is cut into legs. Within a leg insertion and rotation are proportional to each other, which is all that
// the kinematic models need to know: time does not enter them. A leg is as long as the integrator allows (5 mm,
// 0.25 rad), not as short as the measurements' spacing: the measurements are read off in between by interpolation,
// which is where a fit's speed comes from.
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bevel/model/samples.hpp>

namespace bevel::diagnosis {

struct Leg {
  double insertion_mm;
  double rotation_rad;
};

struct Observation {
  std::int64_t utime = 0;                                 // us since the epoch, time of capture
  double insertion_mm = 0;                                // of the shaft past the entry point, at that time
  std::size_t leg = 0;                                    // the leg during which it was taken,
  double fraction = 0;                                    // and how far through it, in [0, 1]
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  // {A}
  // rank x 3, upper rows used: whitening * (position - model) has unit variance on the axes that the camera sees.
  Eigen::Matrix3d whitening = Eigen::Matrix3d::Zero();
  int rank = 0;
};

struct Insertion {
  std::string name;
  std::vector<Leg> legs;  // the needle starts at the entry point, unrolled, heading along z_A
  std::vector<Observation> observations;
  std::size_t skipped = 0;  // measurements not used: status not 0, before the entry, or outside the actuators' time
};

// Both inputs in order of time; the actuators' positions are interpolated linearly between their samples. Insertion
// below 0 is in air and moves nothing. Throws ArgumentError where fewer than two actuator samples or no usable
// measurement remain, or times run backwards.
Insertion make_insertion(std::string name, const std::vector<model::ActuatorState>& actuators,
                         const std::vector<model::TipMeasurement>& measurements);

/// Computes the range of the shaft's roll over the parts of an insertion that advance or retract the needle.
///
/// Rotation at rest counts if insertion follows it in the new direction; the roll before the first insertion does not.
/// @return largest minus smallest roll, rad, at least 0
double roll_range_rad(const Insertion& insertion);

// Whitening of a measurement: rows sqrt(eigenvalue) * eigenvector^T for the eigenvalues above 1e-9 of the largest.
// Returns the rank.
int whiten(const Eigen::Matrix3d& information_per_mm2, Eigen::Matrix3d& whitening);

}  // namespace bevel::diagnosis
