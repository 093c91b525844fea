// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// A simulated insertion: the plant, its axes and its measurements, recorded as a rig would.
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <bevel/io/recording.hpp>
#include <bevel/rig/plant/plant.hpp>
#include "motion.hpp"
#include "recording.hpp"

namespace bevel::python {

class SimulatedRig {
 public:
  struct Noise {
    Eigen::Vector3d sigma_mm{0.2, 0.2, 0.2};  ///< infinite: the axis is not measured
    double heading_rad = 0.01;
  };
  SimulatedRig(std::unique_ptr<rig::Plant> plant, const Noise& noise, std::uint64_t seed);

  /// Moves the axes by increments at constant rates within \p duration_s, and records an axis sample at the end.
  /// @throws DomainError before anything moves, where the needle would leave the domain of the slip law
  void move(double insertion_mm, double rotation_rad, double duration_s);
  /// Measures the position, records it with the truth, and returns it; NaN along an axis that is not measured.
  Eigen::Vector3d measure_position();
  /// Measures the heading, records it, and returns it.
  Eigen::Vector3d measure_heading();
  /// Follows a motion from where the axes are, and measures the position \p camera_hz times a second.
  void follow(const AxisMotion& motion, double camera_hz, bool headings);

  /// Everything since the start.
  Recording recording(const std::string& name) const;

  const rig::Plant& plant() const { return *plant_; }
  double time_s() const { return time_s_; }
  double insertion_mm() const { return insertion_mm_; }
  double rotation_rad() const { return rotation_rad_; }

 private:
  struct Passed {
    double time_s;
    Eigen::Vector3d tip_mm;
  };
  void record_axes(double insertion_rate_mm_s, double rotation_rate_rad_s);
  Eigen::Vector3d tip_at(double time_s) const;

  std::unique_ptr<rig::Plant> plant_;
  Noise noise_;
  std::mt19937_64 random_;
  double time_s_ = 0, insertion_mm_ = 0, rotation_rad_ = 0;
  std::vector<Passed> passed_;
  io::Recording recorded_;
};

}  // namespace bevel::python
