// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Equations of a camera in front of a flat wall, for doubles and for the jets of automatic differentiation.
///
/// Lens (Brown 1966, in OpenCV's numbering), at x = X/Z, y = Y/Z, r2 = x^2 + y^2:
///   s = 1 + k1 r2 + k2 r2^2 + k3 r2^3
///   x' = s x + 2 p1 x y + p2 (r2 + 2 x^2),  y' = s y + p1 (r2 + 2 y^2) + 2 p2 x y,  u = fx x' + cx,  v = fy y' + cy
///
/// Wall: the camera is in air at the origin of {C}. A plane with the unit normal n is at the distance d along n, behind
/// it glass of the thickness t and the index m_g, then gel of the index m. Light that leaves the camera at the slope
/// tau = tan(angle to n) has in a layer of index m the slope tau / sqrt(m^2 + (m^2 - 1) tau^2) (Snell). It meets a
/// point at the depth h behind the glass and at rho = |lateral|^2 from the foot of the normal if
///   1 = q [ d + t / S(m_g) + h / S(m) ],   S(m) = sqrt(m^2 + (m^2 - 1) q^2 rho),   q = tau / |lateral|
/// Agrawal et al., "A theory of multi-layer flat refractive geometry", CVPR 2012, state it as a polynomial. The right
/// side increases with q and is concave, so that Newton's steps from q = 0 come from below and cannot overshoot. q is
/// smooth for a point on the normal, tau and |lateral| are not.
#include <array>
#include <cmath>

namespace bevel::camera {

/// Index of each lens parameter. Focal lengths and principal point in px; distortion coefficients without a unit.
enum LensParameter {
  kFx,  ///< focal length along u, px
  kFy,  ///< focal length along v, px
  kCx,  ///< principal point, u, px
  kCy,  ///< principal point, v, px
  kK1,  ///< radial coefficient of r^2
  kK2,  ///< radial coefficient of r^4
  kP1,  ///< first tangential coefficient
  kP2,  ///< second tangential coefficient
  kK3   ///< radial coefficient of r^6
};
inline constexpr int kLensParameters = 9;  ///< number of lens parameters

/// Index of each wall parameter: two components of the unit normal, the distance in mm, the refractive index. The third
/// component of the normal is sqrt(1 - nx^2 - ny^2) > 0: the wall is in front of the camera.
enum WallParameter {
  kNormalX,   ///< x component of the unit normal
  kNormalY,   ///< y component of the unit normal
  kDistance,  ///< distance, mm
  kIndex      ///< refractive index of the gel
};
inline constexpr int kWallParameters = 4;  ///< number of wall parameters

/// Properties of the pane that are given and not fitted.
struct Pane {
  double thickness_mm = 0.0;  ///< thickness, mm
  double index = 1.52;        ///< refractive index
};

/// Returns the value of a number.
/// @param x number
/// @return x
inline double value_of(double x) { return x; }
/// Returns the value of a jet without its derivatives.
/// @param x jet
/// @return value
template <class Jet>
double value_of(const Jet& x) {
  return x.a;
}

/// Applies the lens distortion, in units of the focal length.
/// @param lens   parameters indexed by LensParameter
/// @param x      undistorted X/Z
/// @param y      undistorted Y/Z
/// @param seen_x receives the distorted x'
/// @param seen_y receives the distorted y'
template <class T>
void distort(const T* lens, const T& x, const T& y, T& seen_x, T& seen_y) {
  const T r2 = x * x + y * y;
  const T s = 1.0 + r2 * (lens[kK1] + r2 * (lens[kK2] + r2 * lens[kK3]));
  const T cross = 2.0 * x * y;
  seen_x = s * x + lens[kP1] * cross + lens[kP2] * (r2 + 2.0 * x * x);
  seen_y = s * y + lens[kP1] * (r2 + 2.0 * y * y) + lens[kP2] * cross;
}

/// Computes the pixel of light from a direction.
/// @param lens      parameters indexed by LensParameter
/// @param direction direction to the source in {C}, of any length, 3 components
/// @param pixel     receives u and v, px
/// @return false if the direction is behind the camera
template <class T>
bool direction_to_pixel(const T* lens, const T* direction, T* pixel) {
  if (!(value_of(direction[2]) > 0.0)) return false;
  T x{}, y{};
  distort<T>(lens, direction[0] / direction[2], direction[1] / direction[2], x, y);
  pixel[0] = lens[kFx] * x + lens[kCx];
  pixel[1] = lens[kFy] * y + lens[kCy];
  return true;
}

/// Computes the direction in air in which a point behind the wall is seen.
/// @param wall      parameters indexed by WallParameter
/// @param pane      pane
/// @param point_mm  point in {C}, mm, 3 components
/// @param direction receives the direction in {C}, not normalised, 3 components
/// @return false if the point is in front of the wall, or the wall's parameters are invalid
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
