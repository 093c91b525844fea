// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Compliance of the end of a stiff shaft, for a bicycle model of such a shaft.
///
/// The shaft is a beam on an elastic foundation, clamped in a guide. The force F of the bevel acts at its end. The
/// displacement of the end is the fraction g, and its rotation the fraction h, of those of an end deep in the tissue.
/// The argument x is the length from the guide to the tip over the bending length 1 / lambda = (4 EI / modulus)^(1/4):
///     g = (sinh x cosh x - sin x cos x) / (cosh^2 x + cos^2 x),  h = (sinh^2 x + sin^2 x) / (cosh^2 x + cos^2 x).
/// Source: Hetenyi, "Beams on Elastic Foundation", 1946, section 7.
#include <algorithm>
#include <cmath>

namespace bevel::model {

/// Displacement and rotation of the end, relative to those of an end deep in the tissue, with derivatives by x.
struct ShaftEnd {
  double g = 0,       ///< displacement, as a fraction
      h = 0;          ///< rotation, as a fraction
  double g_by_x = 0,  ///< dg/dx
      h_by_x = 0;     ///< dh/dx
};

/// Computes the compliance of the end. Outside [0, 15] the argument is clamped and the derivatives are zero.
/// @param bending_lengths x, the length from the guide to the tip in bending lengths
/// @return fractions and derivatives
inline ShaftEnd shaft_end(double bending_lengths) {
  constexpr double kDeep = 15;  // g and h are constant beyond
  const double x = std::clamp(bending_lengths, 0.0, kDeep);
  const double sinh2 = std::sinh(2 * x), cosh2 = std::cosh(2 * x), sin2 = std::sin(2 * x), cos2 = std::cos(2 * x);
  // Double-angle form; numerators and denominator carry a common factor of two.
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
