#pragma once
// No rig repeats itself exactly: by how much insertions differ beside what they share. Each has, of its own and drawn
// from normal densities about the model's values, a curvature, a heading and a roll at the entry, and a registration.
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

}  // namespace bevel::model
