// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/calibration/camera_model.hpp>

#include <string>

#include <bevel/error.hpp>
#include "camera/calibration/number_text.hpp"

namespace bevel::camera {
namespace {

// d (distorted) / d (undistorted), by the chain rule through r2.
cv::Matx22d distortion_slope(const double* lens, double x, double y) {
  const double r2 = x * x + y * y;
  const double s = 1.0 + r2 * (lens[kK1] + r2 * (lens[kK2] + r2 * lens[kK3]));
  const double ds = lens[kK1] + r2 * (2.0 * lens[kK2] + 3.0 * r2 * lens[kK3]);  // ds / dr2
  const double p1 = lens[kP1], p2 = lens[kP2];
  const double cross = 2.0 * x * y * ds + 2.0 * p1 * x + 2.0 * p2 * y;
  return {s + 2.0 * x * x * ds + 2.0 * p1 * y + 6.0 * p2 * x, cross, cross,
          s + 2.0 * y * y * ds + 6.0 * p1 * y + 2.0 * p2 * x};
}

}  // namespace

std::optional<cv::Vec2d> undistort(const Lens& lens, const cv::Point2d& pixel) {
  const double* p = lens.parameters.data();
  const cv::Vec2d seen((pixel.x - p[kCx]) / p[kFx], (pixel.y - p[kCy]) / p[kFy]);
  cv::Vec2d at = seen;
  for (int i = 0; i < 30; ++i) {
    cv::Vec2d there;
    distort(p, at[0], at[1], there[0], there[1]);
    const cv::Matx22d slope = distortion_slope(p, at[0], at[1]);
    if (!(cv::determinant(slope) > 0.02)) return {};  // at the fold or beyond: another direction is seen here too
    const cv::Vec2d step = slope.inv() * (seen - there);
    at += step;
    if (cv::norm(step) < 1e-14 * (1.0 + cv::norm(at))) return at;
  }
  return {};
}

std::optional<Ray> refract(const FlatWall& wall, const cv::Vec3d& direction) {
  const double nx = wall.parameters[kNormalX], ny = wall.parameters[kNormalY];
  const cv::Vec3d normal(nx, ny, std::sqrt(1.0 - nx * nx - ny * ny));
  const double cosine = normal.dot(direction);
  if (!(cosine > 1e-6)) return {};
  cv::Vec3d at = direction * (wall.parameters[kDistance] / cosine);
  // The part along the wall is, times the index, the same in every layer.
  const cv::Vec3d beside = direction - cosine * normal;
  const auto in_layer = [&](double index) {
    const cv::Vec3d b = beside * (1.0 / index);
    return cv::Vec3d(b + std::sqrt(1.0 - b.dot(b)) * normal);
  };
  const cv::Vec3d in_glass = in_layer(wall.pane.index);
  at += in_glass * (wall.pane.thickness_mm / in_glass.dot(normal));
  return Ray{at, in_layer(wall.parameters[kIndex])};
}

std::optional<cv::Point2d> CameraModel::pixel(const cv::Vec3d& p_A_mm) const {
  const cv::Vec3d p_C = R_CA * p_A_mm + p_CA_mm;
  cv::Vec3d direction = p_C;
  if (wall && !direction_through_wall(wall->parameters.data(), wall->pane, p_C.val, direction.val)) return {};
  cv::Vec2d seen;
  if (!direction_to_pixel(lens.parameters.data(), direction.val, seen.val)) return {};
  // Beyond the fold of a lens the polynomial comes back into the picture, where another direction is seen.
  const auto back = undistort(lens, {seen[0], seen[1]});
  if (!back || cv::norm(*back - cv::Vec2d(direction[0] / direction[2], direction[1] / direction[2])) > 1e-6) return {};
  return cv::Point2d(seen[0], seen[1]);
}

std::optional<Ray> CameraModel::ray(const cv::Point2d& at) const {
  const auto xy = undistort(lens, at);
  if (!xy) return {};
  Ray ray{{0.0, 0.0, 0.0}, cv::normalize(cv::Vec3d((*xy)[0], (*xy)[1], 1.0))};
  if (wall) {
    const auto bent = refract(*wall, ray.direction);
    if (!bent) return {};
    ray = *bent;
  }
  return Ray{R_CA.t() * (ray.origin_mm - p_CA_mm), R_CA.t() * ray.direction};
}

void check(const CameraModel& model) {
  const std::string camera = "camera " + std::to_string(model.number) + " ";
  const auto require = [&](bool good, const std::string& key, double value, const std::string& allowed) {
    if (!good) throw ArgumentError(camera + key + " is " + number_text(value) + ", allowed: " + allowed);
  };
  // Written so that a NaN is refused.
  const auto within = [&](const std::string& key, double value, double low, double high) {
    require(value >= low && value <= high, key, value, number_text(low) + " to " + number_text(high));
  };
  within("number", model.number, 0, 15);
  within("image_width", model.lens.picture_px.width, 16, 8192);
  within("image_height", model.lens.picture_px.height, 16, 8192);
  const auto& lens = model.lens.parameters;
  const double larger = std::max(model.lens.picture_px.width, model.lens.picture_px.height);
  within("camera_matrix fx (px)", lens[kFx], 0.2 * larger, 100.0 * larger);
  within("camera_matrix fy (px)", lens[kFy], 0.2 * larger, 100.0 * larger);
  within("camera_matrix cx (px)", lens[kCx], -larger, 2.0 * larger);
  within("camera_matrix cy (px)", lens[kCy], -larger, 2.0 * larger);
  for (const int i : {kK1, kK2, kP1, kP2, kK3})
    within("distortion_coefficients " + std::to_string(i - kK1), lens.at(static_cast<size_t>(i)), -1000.0, 1000.0);
  const cv::Matx33d unity = model.R_CA * model.R_CA.t();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      require(std::abs(unity(r, c) - (r == c ? 1.0 : 0.0)) < 1e-6, "rotation_camera_from_A", model.R_CA(r, c),
              "a rotation, its rows of length 1 and square to each other");
  require(cv::determinant(model.R_CA) > 0.0, "rotation_camera_from_A determinant", cv::determinant(model.R_CA), "1");
  for (int i = 0; i < 3; ++i) within("translation_camera_from_A_mm", model.p_CA_mm[i], -1e5, 1e5);
  if (!model.wall) return;
  const auto& wall = model.wall->parameters;
  const double aside = std::hypot(wall[kNormalX], wall[kNormalY]);
  require(aside < 0.95, "wall normal: part across the optical axis", aside, "0 to 0.95");
  within("wall distance_mm", wall[kDistance], 1e-3, 1e5);
  within("wall index", wall[kIndex], 1.0, 2.5);
  within("wall pane_mm", model.wall->pane.thickness_mm, 0.0, 1000.0);
  within("wall pane_index", model.wall->pane.index, 1.0, 2.5);
}

std::optional<cv::Vec3d> nearest_to_rays(const std::vector<Ray>& rays) {
  cv::Matx33d normal = cv::Matx33d::zeros();
  cv::Vec3d right;
  for (const Ray& ray : rays) {
    const cv::Matx33d across = cv::Matx33d::eye() - ray.direction * ray.direction.t();
    normal += across;
    right += across * ray.origin_mm;
  }
  if (!(cv::determinant(normal) > 1e-8)) return {};
  return cv::Vec3d(normal.inv() * right);
}

}  // namespace bevel::camera
