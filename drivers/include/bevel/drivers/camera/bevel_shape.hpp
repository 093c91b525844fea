// SPDX-License-Identifier: MIT
#pragma once
// What is seen of the end of a bevelled needle: a cylinder of radius 1 cut by a plane over the length B, looked at from
// the side. Along the axis, at the distance x behind the foremost point, metal covers the part [lo, hi] of the width:
//   c = 1 - 2 x / B,  q = sqrt(1 - c^2)
//   hi = sin(rho) c + cos(rho) q, or 1 where c < sin(rho);  lo = sin(rho) c - cos(rho) q, or -1 where c < -sin(rho)
// (a plane cut through the circle of the outline). rho is the bevel's roll as pictures show it: 0 with the cut turned
// to or away from the camera, when the end is round, +-pi/2 with the cut seen edge-on, when it is a wedge whose point
// lies on one side of the needle. Where the cut is turned to the camera its face is seen between the outline and the
// wall before it, and may be paler than the wall; `pale` is the share of darkness it lacks.
#include <vector>

namespace bevel::camera {

/// Darkness and its first two moments across, over the darkness of the whole shaft; x in the unit of B, moments in
/// radii.
struct Moments {
  double share = 0.0;   ///< 0 beyond the tip, 1 on the shaft
  double moment = 0.0;  ///< positive toward positive rho
  double second = 0.0;  ///< about the axis, 1/3 on the shaft
};
inline Moments operator+(const Moments& a, const Moments& b) {
  return {a.share + b.share, a.moment + b.moment, a.second + b.second};
}
inline Moments operator*(double factor, const Moments& m) {
  return {factor * m.share, factor * m.moment, factor * m.second};
}
inline Moments operator-(const Moments& a, const Moments& b) { return a + -1.0 * b; }

struct BevelMoments {
  Moments outline;
  Moments face;  ///< the part of `outline` in which the cut's face is what is seen

  /// Of what is dark, where the face lacks the share `pale` of the wall's darkness.
  Moments dark(double pale) const { return outline - pale * face; }
};
BevelMoments bevel_moments(double x, double length, double sin_rho);

/// The same, blurred along the axis by a Gaussian of standard deviation `blur`, tabulated.
class BlurredBevel {
 public:
  void build(double length, double sin_rho, double blur);

  struct Value {
    BevelMoments moments;
    BevelMoments slope;  ///< d / d x
  };
  Value at(double x) const;

 private:
  double first_x_ = 0.0;
  double step_ = 1.0;
  std::vector<BevelMoments> table_;
  std::vector<BevelMoments> sharp_;
  std::vector<double> kernel_;
};

}  // namespace bevel::camera
