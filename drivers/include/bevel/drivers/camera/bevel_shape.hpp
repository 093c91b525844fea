// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Silhouette of the end of a bevelled needle: a cylinder of radius 1 cut by a plane over the length B, seen from the
/// side. Along the axis, at the distance x behind the foremost point, metal covers the part [lo, hi] of the width:
///   c = 1 - 2 x / B,  q = sqrt(1 - c^2)
///   hi = sin(rho) c + cos(rho) q, or 1 if c < sin(rho);  lo = sin(rho) c - cos(rho) q, or -1 if c < -sin(rho)
/// (a plane cut through the circle of the outline). rho is the bevel's roll as images show it: 0 with the cut turned
/// towards or away from the camera, when the end is round; +-pi/2 with the cut seen edge-on, when it is a wedge whose
/// point lies on one side of the needle. If the cut is turned towards the camera, its face is seen between the outline
/// and the wall in front of it, and may be brighter than the wall; `pale` is the missing fraction of darkness.
#include <vector>

namespace bevel::camera {

/// Darkness and its first two moments across the needle, relative to the darkness of the whole shaft; x in the unit of
/// B, moments in radii.
struct Moments {
  double share = 0.0;   ///< 0 beyond the tip, 1 on the shaft
  double moment = 0.0;  ///< positive toward positive rho
  double second = 0.0;  ///< about the axis, 1/3 on the shaft
};
/// Adds moments.
/// @param a moments
/// @param b moments
/// @return sum
inline Moments operator+(const Moments& a, const Moments& b) {
  return {a.share + b.share, a.moment + b.moment, a.second + b.second};
}
/// Scales moments.
/// @param factor factor
/// @param m      moments
/// @return product
inline Moments operator*(double factor, const Moments& m) {
  return {factor * m.share, factor * m.moment, factor * m.second};
}
/// Subtracts moments.
/// @param a moments
/// @param b moments
/// @return a - b
inline Moments operator-(const Moments& a, const Moments& b) { return a + -1.0 * b; }

/// Moments of the end of a needle at one position.
struct BevelMoments {
  Moments outline;  ///< metal
  Moments face;     ///< the part of `outline` in which the face of the cut is visible

  /// Computes the moments of the darkness.
  /// @param pale fraction of the wall's darkness that the face lacks
  /// @return moments
  Moments dark(double pale) const { return outline - pale * face; }
};
/// Computes the moments at one position.
/// @param x       distance behind the foremost point, in the unit of `length`
/// @param length  length B of the bevel
/// @param sin_rho sine of the bevel's roll
/// @return moments; zero for x <= 0
BevelMoments bevel_moments(double x, double length, double sin_rho);

/// Tabulates bevel_moments(), blurred along the axis by a Gaussian.
class BlurredBevel {
 public:
  /// Computes the table.
  /// @param length  length B of the bevel
  /// @param sin_rho sine of the bevel's roll
  /// @param blur    standard deviation of the blur, in the unit of `length`
  void build(double length, double sin_rho, double blur);

  /// Value of the table with its derivative.
  struct Value {
    BevelMoments moments;  ///< blurred moments
    BevelMoments slope;    ///< derivative with respect to x
  };
  /// Evaluates the table.
  /// @param x distance behind the foremost point, in the unit of `length`
  /// @return moments and derivative
  Value at(double x) const;

 private:
  double first_x_ = 0.0;
  double step_ = 1.0;
  std::vector<BevelMoments> table_;
  std::vector<BevelMoments> sharp_;
  std::vector<double> kernel_;
};

}  // namespace bevel::camera
