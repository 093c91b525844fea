// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/calibrated_view.hpp>

#include <algorithm>
#include <limits>
#include <string>

#include <bevel/error.hpp>
#include "camera/calibration/number_text.hpp"

namespace bevel::camera {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kSineAlongNeedle = 0.342;  // 20 degrees

Vector3 array(const cv::Vec3d& v) { return {v[0], v[1], v[2]}; }

Matrix3 array(const cv::Matx33d& m) {
  Matrix3 out{};
  std::copy_n(m.val, 9, out.begin());
  return out;
}

cv::Point2d middle(const cv::Size& size) { return {0.5 * (size.width - 1), 0.5 * (size.height - 1)}; }

}  // namespace

CalibratedView::CalibratedView(const CameraModel& model) : model_(model) {
  check(model_);
  const std::string camera = "camera " + std::to_string(model.number);
  const auto ahead = model_.ray(middle(model_.lens.picture_px));
  if (!ahead) throw ArgumentError(camera + ": distortion_coefficients leave no direction to the picture's middle");
  const cv::Vec3d across(ahead->direction[0], ahead->direction[1], 0.0);
  if (!(cv::norm(across) >= kSineAlongNeedle))
    throw ArgumentError(camera + ": its line of sight is " +
                        number_text(std::asin(std::min(1.0, cv::norm(across))) * 180.0 / CV_PI) +
                        " degrees from the z axis of {A}, allowed: 20 or more, or it looks along the needle");
  plane_normal_ = cv::normalize(across);
  const auto at = spot(middle(model_.lens.picture_px));
  if (!at)
    throw ArgumentError(camera + ": the needle's plane lies behind it or before its wall; is the frame {A} right?");
  px_per_mm_ = 1.0 / std::sqrt(std::abs(cv::determinant(at->mm_per_px)));
}

std::optional<cv::Vec3d> CalibratedView::on_plane(const Ray& ray) const {
  const double closing = plane_normal_.dot(ray.direction);
  if (!(closing > 0.05)) return {};
  const double reach_mm = -plane_normal_.dot(ray.origin_mm) / closing;
  if (!(reach_mm > 0.0)) return {};
  return cv::Vec3d(ray.origin_mm + reach_mm * ray.direction);
}

std::optional<CalibratedView::Spot> CalibratedView::spot(const cv::Point2d& pixel) const {
  const auto ray = model_.ray(pixel);
  if (!ray) return {};
  const auto point = on_plane(*ray);
  if (!point) return {};
  Spot spot;
  spot.point_mm = *point;
  spot.ray = ray->direction;
  const cv::Vec3d right_A = model_.R_CA.t() * cv::Vec3d(1.0, 0.0, 0.0);
  spot.right = cv::normalize(right_A - right_A.dot(spot.ray) * spot.ray);
  spot.down = spot.ray.cross(spot.right);
  // How far beside the point the rays of neighbouring pixels pass it. Of a smooth function, so a quarter of a pixel to
  // either side is exact to about 1e-8.
  constexpr double kStep_px = 0.25;
  const cv::Point2d steps[2] = {{kStep_px, 0.0}, {0.0, kStep_px}};
  for (int c = 0; c < 2; ++c) {
    const auto after = model_.ray(pixel + steps[c]), before = model_.ray(pixel - steps[c]);
    if (!after || !before) return {};
    const auto offset = [&](const Ray& r) {
      const double reach_mm = (spot.point_mm - r.origin_mm).dot(spot.ray) / r.direction.dot(spot.ray);
      return cv::Vec3d(r.origin_mm + reach_mm * r.direction - spot.point_mm);
    };
    const cv::Vec3d moved = (offset(*after) - offset(*before)) * (0.5 / kStep_px);
    spot.mm_per_px(0, c) = moved.dot(spot.right);
    spot.mm_per_px(1, c) = moved.dot(spot.down);
  }
  return spot;
}

Vector3 CalibratedView::position_mm(const cv::Point2d& pixel) const {
  const auto ray = model_.ray(pixel);
  const auto point = ray ? on_plane(*ray) : std::nullopt;
  return point ? array(*point) : Vector3{kNaN, kNaN, kNaN};
}

cv::Point2d CalibratedView::pixel(const Vector3& position_mm) const {
  const auto seen = model_.pixel({position_mm[0], position_mm[1], position_mm[2]});
  return seen ? *seen : cv::Point2d(kNaN, kNaN);
}

Matrix3 CalibratedView::information_per_mm2(const cv::Point2d& pixel, const cv::Matx22d& covariance_px2) const {
  const auto at = spot(pixel);
  if (!at) return {};
  const cv::Matx22d information = (at->mm_per_px * covariance_px2 * at->mm_per_px.t()).inv();
  const double cross = 0.5 * (information(0, 1) + information(1, 0));
  const cv::Vec3d &u = at->right, &v = at->down;
  const cv::Matx33d uv = u * v.t();
  return array(information(0, 0) * (u * u.t()) + information(1, 1) * (v * v.t()) + cross * (uv + uv.t()));
}

// The curve lies in the surface of all rays through its picture, so that its tangent has no part across the plane
// of the ray and the seen direction. An angle of the picture is one across the ray times |det J| / |J d|^2.
SeenDirection CalibratedView::direction(const cv::Point2d& pixel, const cv::Vec2d& direction_px,
                                        double variance_rad2) const {
  SeenDirection seen;
  const auto at = spot(pixel);
  if (!at) return seen;
  const cv::Vec2d image = at->mm_per_px * cv::normalize(direction_px);
  const cv::Vec2d unit = cv::normalize(image);
  const cv::Vec3d along = unit[0] * at->right + unit[1] * at->down;
  const cv::Vec3d across = -unit[1] * at->right + unit[0] * at->down;
  const double turn = cv::determinant(at->mm_per_px) / image.dot(image);
  seen.direction = array(along);
  seen.information_per_rad2 = array(across * across.t() * (1.0 / (turn * turn * variance_rad2)));
  return seen;
}

}  // namespace bevel::camera
