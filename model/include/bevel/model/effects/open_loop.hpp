// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Open-loop prediction of the tip measurements of a recording from the actuator motion, with sensitivities.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::model {

/// Actuator motion divided into legs. Nodes lie at the measurements, at jumps of a rate (1 mm/s or 0.5 rad/s), and at
/// the first actuator sample more than 1 mm or 0.2 rad after the previous node. Times count from the first actuator
/// sample.
struct Motion {
  std::vector<BaseMotion> nodes;  ///< nodes in order of time; the first is the entry
  std::vector<std::size_t> at;    ///< index into `nodes` of each measurement
  std::int64_t start_utime = 0;   ///< time of the first actuator sample, us since the epoch
};

/// Divides the actuator motion of a recording into legs. Positions between actuator samples are interpolated linearly.
/// The actuators are stationary before the first and after the last sample.
/// @param actuators actuator samples in order of time, at least two
/// @param reading_utimes times of the measurements in order of time, us since the epoch
/// @return the motion, with one element of Motion::at per measurement
/// @throws bevel::ArgumentError if there are fewer than two actuator samples, or times decrease
Motion make_motion(std::span<const ActuatorState> actuators, std::span<const std::int64_t> reading_utimes);

/// Predicted measurements of one recording, with sensitivities and the working memory of predict().
struct OpenLoop {
  std::vector<Eigen::Vector3d> position_mm;  ///< predicted tip position per measurement, mm in {A}
  Eigen::MatrixXd jacobian;                  ///< sensitivities of the positions, (3 measurements) x columns
  /// Variance of each position due to the uncertainty of the effects, mm^2 along the axes of {A}. Empty if the needle
  /// has sensitivity columns.
  std::vector<std::array<double, 3>> blur_mm2;
  /// Predicted heading per measurement, unit vector in {A}; empty if headings are not requested.
  std::vector<Eigen::Vector3d> heading;
  Eigen::MatrixXd heading_jacobian;  ///< sensitivities of the headings, (3 measurements) x columns

  /// Working memory of predict(), kept between calls: a vector and its derivatives per entry. The entries are the
  /// nodes, or the delayed measurements if the tip jumps between nodes.
  struct Track {
    std::vector<Eigen::Vector3d> value;  ///< vectors: mm, or unit vectors
    Eigen::MatrixXd jacobian;            ///< sensitivities, (3 entries) x columns
  };
  Track node_position_mm,                            ///< working memory: tip positions at the nodes, mm
      node_heading,                                  ///< working memory: headings at the nodes
      late_position_mm,                              ///< working memory: tip positions of delayed measurements, mm
      late_heading;                                  ///< working memory: headings of delayed measurements
  std::vector<std::array<double, 3>> node_blur_mm2;  ///< working memory: blur_mm2 at the nodes, mm^2
};

/// Predicts all measurements of a recording. With a latency, the path between two nodes is taken as straight, unless a
/// sudden effect can put a jump there. Sensitivities with respect to the latency are averages over the leg. The exact
/// ones are zero where the tip sticks and infinite where it jumps.
/// @param needle needle with effects; its columns determine the sensitivities
/// @param motion actuator motion from make_motion(), at least one node
/// @param[in,out] out predicted measurements; incomplete on failure. Reusing the object avoids allocations.
/// @param headings true to predict headings in addition to positions
/// @return false if the tip leaves the domain of the slip law (25)
bool predict(const AugmentedNeedle& needle, const Motion& motion, OpenLoop& out, bool headings = false);

}  // namespace bevel::model
