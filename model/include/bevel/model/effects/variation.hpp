// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Variation between insertions. Each insertion has its own curvature, heading and roll at the entry, and registration.
/// These insertion-specific parameters are normally distributed about the values of the model.
#include <cstdint>
#include <string>

#include <bevel/model/effects/augmented_needle.hpp>

namespace bevel::model {

/// Between-insertion standard deviations. 0: the insertions do not differ in this parameter.
struct Variation {
  double curvature_relative = 0;  ///< of the curvature k, as a fraction of k
  double entry_angle_rad = 0;     ///< of the heading at the entry, about x and about y of {A}, rad each
  double entry_point_mm = 0;      ///< of the entry point along x and along y of {A}, mm each
  double roll_rad = 0;            ///< of the roll of the bevel about the heading at the entry, rad

  /// @return true if all standard deviations are equal
  bool operator==(const Variation&) const = default;
};

/// Largest plausible standard deviations. A larger value indicates wrong units or insertions of different needles.
inline constexpr Variation kLargestVariation{
    .curvature_relative = 1, .entry_angle_rad = 0.5, .entry_point_mm = 20, .roll_rad = 3.2};

/// Insertion-specific parameters of one insertion, as deviations from the model.
struct OwnValues {
  double curvature_relative = 0;  ///< relative change of the curvature k
  double tilt_x_rad = 0,          ///< x of the rotation vector of the heading in {A}, rad
      tilt_y_rad = 0;             ///< y of the rotation vector of the heading in {A}, rad
  double roll_rad = 0;            ///< roll about the heading, rad
  double entry_x_mm = 0,          ///< x of the entry point in {A}, mm
      entry_y_mm = 0;             ///< y of the entry point in {A}, mm
};

/// Draws insertion-specific parameters from normal distributions.
/// @param variation standard deviations
/// @param seed seed of the generator; equal seeds give equal values
/// @return the parameters
OwnValues draw(const Variation& variation, std::uint64_t seed);
/// Formats insertion-specific parameters for a terminal.
/// @param own parameters
/// @return one line with units, without a line break
std::string describe(const OwnValues& own);

/// Applies the curvature of one insertion to the needle.
/// @param needle nominal needle parameters
/// @param own parameters of the insertion
/// @return the needle parameters of the insertion
NeedleParameters of_insertion(NeedleParameters needle, const OwnValues& own);
/// Applies the tilt, roll and registration of one insertion to the entry pose.
/// @param entry nominal pose of {B} in {A} at the entry
/// @param own parameters of the insertion
/// @return the pose of {B} in {A} at the entry of the insertion
Pose of_insertion(const Pose& entry, const OwnValues& own);

}  // namespace bevel::model
