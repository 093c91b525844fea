// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The motion of the two axes, and times as Python has them.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <bevel/model/samples.hpp>

namespace bevel::python {

/// Samples of the axes over time; linear in between.
struct AxisMotion {
  Eigen::VectorXd time_s, insertion_mm, rotation_rad;

  /// Checks the samples.
  /// @throws ArgumentError for fewer than two samples, different lengths, numbers that are not finite, or times
  /// that do not increase by 1 us at least
  void validate() const;
};

/// Offset of the microseconds in the libraries, where 0 means "no time", from the seconds in Python.
inline constexpr std::int64_t kZero_us = 1'000'000;

/// @throws ArgumentError for a time that is negative, not finite or above 1e10 s
std::int64_t utime_of(double time_s);
inline double time_of(std::int64_t utime) { return static_cast<double>(utime - kZero_us) * 1e-6; }

std::vector<model::ActuatorState> actuator_states(const AxisMotion& motion);

}  // namespace bevel::python
