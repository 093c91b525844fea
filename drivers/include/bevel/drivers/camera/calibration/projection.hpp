// SPDX-License-Identifier: MIT
#pragma once
// The equations of a camera before a flat wall, once, for doubles and for the jets of automatic differentiation.
//
// Lens (Brown 1966, as OpenCV numbers it), at x = X/Z, y = Y/Z, r2 = x^2 + y^2:
//   s = 1 + k1 r2 + k2 r2^2 + k3 r2^3
//   x' = s x + 2 p1 x y + p2 (r2 + 2 x^2),  y' = s y + p1 (r2 + 2 y^2) + 2 p2 x y,  u = fx x' + cx,  v = fy y' + cy
//
// Wall: the camera stands in air at the origin of {C}; a plane with the unit normal n lies at the distance d along n,
// behind it glass of the thickness t and the index m_g, then gel of the index m. Light that leaves the camera at
// the slope tau = tan(angle to n) has in a layer of index m the slope tau / sqrt(m^2 + (m^2 - 1) tau^2) (Snell), so
// that it meets a point at the depth h behind the glass and at rho = |lateral|^2 beside the foot of the normal where
//   1 = q [ d + t / S(m_g) + h / S(m) ],   S(m) = sqrt(m^2 + (m^2 - 1) q^2 rho),   q = tau / |lateral|
// Agrawal et al., "A theory of multi-layer flat refractive geometry", CVPR 2012, have the same as a polynomial. The
// right side grows with q and is concave, so that Newton's steps from q = 0 come from below and cannot overshoot; q is
// smooth where the point lies on the normal, tau and |lateral| are not.
#include <array>
#include <cmath>

namespace bevel::camera {

/// Where each number stands in an array; px, and none.
enum LensParameter { kFx, kFy, kCx, kCy, kK1, kK2, kP1, kP2, kK3 };
inline constexpr int kLensParameters = 9;

/// Of the normal two components, the third being sqrt(1 - nx^2 - ny^2) > 0: the wall stands before the camera.
enum WallParameter { kNormalX, kNormalY, kDistance, kIndex };  // none, none, mm, none
inline constexpr int kWallParameters = 4;

/// What is stated of the pane and not fitted.
struct Pane {
  double thickness_mm = 0.0;
  double index = 1.52;
};

inline double value_of(double x) { return x; }
template <class Jet>
double value_of(const Jet& x) {
  return x.a;
}

/// Distorted from undistorted, in units of the focal length.
template <class T>
void distort(const T* lens, const T& x, const T& y, T& seen_x, T& seen_y) {
  const T r2 = x * x + y * y;
  const T s = 1.0 + r2 * (lens[kK1] + r2 * (lens[kK2] + r2 * lens[kK3]));
  const T cross = 2.0 * x * y;
  seen_x = s * x + lens[kP1] * cross + lens[kP2] * (r2 + 2.0 * x * x);
  seen_y = s * y + lens[kP1] * (r2 + 2.0 * y * y) + lens[kP2] * cross;
}

/// Pixel of light that arrives from `direction` (in {C}, of any length). False behind the camera.
template <class T>
bool direction_to_pixel(const T* lens, const T* direction, T* pixel) {
  if (!(value_of(direction[2]) > 0.0)) return false;
  T x{}, y{};
  distort<T>(lens, direction[0] / direction[2], direction[1] / direction[2], x, y);
  pixel[0] = lens[kFx] * x + lens[kCx];
  pixel[1] = lens[kFy] * y + lens[kCy];
  return true;
}

/// Direction in air (in {C}, not normalised) in which a point of {C} behind the wall is seen. False before the wall.
template <class T>
bool direction_through_wall(const T* wall, const Pane& pane, const T* point_mm, T* direction) {
  using std::sqrt;
  const T nz2 = 1.0 - wall[kNormalX] * wall[kNormalX] - wall[kNormalY] * wall[kNormalY];
  if (!(value_of(nz2) > 0.0) || !(value_of(wall[kDistance]) > 0.0) || !(value_of(wall[kIndex]) >= 1.0)) return false;
  const T normal[3] = {wall[kNormalX], wall[kNormalY], sqrt(nz2)};
  const T along = normal[0] * point_mm[0] + normal[1] * point_mm[1] + normal[2] * point_mm[2];
  const T depth = along - wall[kDistance] - pane.thickness_mm;
  if (!(value_of(depth) >= 0.0)) return false;
  T lateral[3];
  for (int i = 0; i < 3; ++i) lateral[i] = point_mm[i] - along * normal[i];
  const T rho = lateral[0] * lateral[0] + lateral[1] * lateral[1] + lateral[2] * lateral[2];

  const auto bend = [](const auto& index, const auto& tau2) {
    return sqrt(index * index + (index * index - 1.0) * tau2);
  };
  const double d = value_of(wall[kDistance]), h = value_of(depth), m = value_of(wall[kIndex]), r2 = value_of(rho);
  double q = 0.0, slope = 1.0;
  for (int i = 0; i < 30; ++i) {
    const double in_glass = bend(pane.index, q * q * r2), in_gel = bend(m, q * q * r2);
    const double missing = 1.0 - q * (d + pane.thickness_mm / in_glass + h / in_gel);
    slope = d + pane.thickness_mm * pane.index * pane.index / (in_glass * in_glass * in_glass) +
            h * m * m / (in_gel * in_gel * in_gel);
    q += missing / slope;
    if (std::abs(missing) < 1e-15) break;
  }
  // One more step in T gives the derivatives, by the theorem of implicit functions.
  const T tau2 = q * q * rho;
  const T missing =
      1.0 - q * (wall[kDistance] + pane.thickness_mm / bend(T(pane.index), tau2) + depth / bend(wall[kIndex], tau2));
  const T exact = q + missing / slope;
  for (int i = 0; i < 3; ++i) direction[i] = normal[i] + exact * lateral[i];
  return true;
}

}  // namespace bevel::camera
