// SPDX-License-Identifier: MIT
#include <bevel/model/effects/variation.hpp>

#include <array>
#include <cstdio>
#include <random>

namespace bevel::model {

OwnValues draw(const Variation& variation, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  OwnValues own;
  own.curvature_relative = variation.curvature_relative * normal(random);
  own.tilt_x_rad = variation.entry_angle_rad * normal(random);
  own.tilt_y_rad = variation.entry_angle_rad * normal(random);
  own.roll_rad = variation.roll_rad * normal(random);
  own.entry_x_mm = variation.entry_point_mm * normal(random);
  own.entry_y_mm = variation.entry_point_mm * normal(random);
  return own;
}

std::string describe(const OwnValues& own) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "curvature %+.2f %%, heading %+.5f and %+.5f rad about x and y, bevel %+.4f rad, entry %+.3f and %+.3f "
                "mm along x and y",
                100 * own.curvature_relative, own.tilt_x_rad, own.tilt_y_rad, own.roll_rad, own.entry_x_mm,
                own.entry_y_mm);
  return text.data();
}

NeedleParameters of_insertion(NeedleParameters needle, const OwnValues& own) {
  needle.curvature_per_mm *= 1 + own.curvature_relative;
  return needle;
}

Pose of_insertion(const Pose& entry, const OwnValues& own) {
  Pose out = entry;
  out.R = exp_so3({own.tilt_x_rad, own.tilt_y_rad, 0}) * entry.R * exp_so3({0, 0, own.roll_rad});
  out.p_mm += Eigen::Vector3d(own.entry_x_mm, own.entry_y_mm, 0);
  return out;
}

}  // namespace bevel::model
