// SPDX-License-Identifier: MIT
#pragma once
// No rig repeats itself exactly: by how much insertions differ beside what they share. Each has, of its own and drawn
// from normal densities about the model's values, a curvature, a heading and a roll at the entry, and a registration.
#include <cstdint>
#include <string>

#include <bevel/model/effects/augmented_needle.hpp>

namespace bevel::model {

// Standard deviations between insertions; 0: they do not differ in it.
struct Variation {
  double curvature_relative = 0;  // of the needle's k
  double entry_angle_rad = 0;     // heading at the entry, about x and about y of {A}, each
  double entry_point_mm = 0;      // along x and along y of {A}, each
  double roll_rad = 0;            // bevel about the heading, at the entry

  bool operator==(const Variation&) const = default;
};

// Beyond these a figure is a mistake of units, or no model of one needle.
inline constexpr Variation kLargestVariation{
    .curvature_relative = 1, .entry_angle_rad = 0.5, .entry_point_mm = 20, .roll_rad = 3.2};

// One insertion's own values.
struct OwnValues {
  double curvature_relative = 0;
  double tilt_x_rad = 0, tilt_y_rad = 0;  // rotation vector of the heading
  double roll_rad = 0;
  double entry_x_mm = 0, entry_y_mm = 0;
};

// The same seed, the same values.
OwnValues draw(const Variation& variation, std::uint64_t seed);
// For a terminal, in one line.
std::string describe(const OwnValues& own);

// The needle that this insertion has, and its pose at the entry for the one that all share.
NeedleParameters of_insertion(NeedleParameters needle, const OwnValues& own);
Pose of_insertion(const Pose& entry, const OwnValues& own);

}  // namespace bevel::model
