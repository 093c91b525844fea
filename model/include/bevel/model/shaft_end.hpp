// SPDX-License-Identifier: MIT
#pragma once
// How the end of a stiff shaft yields, for a bicycle that is to stand for it.
//
// A beam on an elastic foundation, clamped in a guide, whose end the bevel's force F pushes (Hetenyi, "Beams on Elastic
// Foundation", 1946, section 7): it yields by g, and turns by h, of what an end deep in the tissue does, with x the
// length from the guide to the tip over the bending length 1 / lambda = (4 EI / modulus)^(1/4),
//     g = (sinh x cosh x - sin x cos x) / (cosh^2 x + cos^2 x),  h = (sinh^2 x + sin^2 x) / (cosh^2 x + cos^2 x).
#include <algorithm>
#include <cmath>

namespace bevel::model {

struct ShaftEnd {
  double g = 0, h = 0;
  double g_by_x = 0, h_by_x = 0;
};

inline ShaftEnd shaft_end(double bending_lengths) {
  constexpr double kDeep = 15;  // from where on nothing changes
  const double x = std::clamp(bending_lengths, 0.0, kDeep);
  const double sinh2 = std::sinh(2 * x), cosh2 = std::cosh(2 * x), sin2 = std::sin(2 * x), cos2 = std::cos(2 * x);
  // By the doubled angle, each over the same factor of two.
  const double below = cosh2 + cos2 + 2, below_by_x = 2 * (sinh2 - sin2);
  ShaftEnd end;
  end.g = (sinh2 - sin2) / below;
  end.h = (cosh2 - cos2) / below;
  if (x < bending_lengths || x > bending_lengths) return end;
  end.g_by_x = (2 * (cosh2 - cos2) - end.g * below_by_x) / below;
  end.h_by_x = (2 * (sinh2 + sin2) - end.h * below_by_x) / below;
  return end;
}

}  // namespace bevel::model
