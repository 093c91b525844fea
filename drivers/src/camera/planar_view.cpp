// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/planar_view.hpp>

#include <cmath>
#include <string>

#include <bevel/error.hpp>

namespace bevel::camera {
namespace {

size_t index(const SignedAxis& a) { return static_cast<size_t>(a.axis); }

void require(bool good, const std::string& key, const std::string& value, const char* allowed) {
  if (!good) throw ArgumentError("view " + key + " is " + value + ", allowed: " + allowed);
}

void check(const PlanarViewConfig& c) {
  require(std::isfinite(c.px_per_mm) && c.px_per_mm >= 0.1 && c.px_per_mm <= 1000.0, "px_per_mm",
          std::to_string(c.px_per_mm), "0.1 to 1000");
  const bool origin_near = std::isfinite(c.origin_px.x) && std::isfinite(c.origin_px.y) &&
                           std::abs(c.origin_px.x) <= 1e5 && std::abs(c.origin_px.y) <= 1e5;
  require(origin_near, "origin_px", std::to_string(c.origin_px.x) + ", " + std::to_string(c.origin_px.y),
          "finite, within 100000 pixels");
  require(c.u_axis.sign == 1 || c.u_axis.sign == -1, "u_axis sign", std::to_string(c.u_axis.sign), "+1 or -1");
  require(c.v_axis.sign == 1 || c.v_axis.sign == -1, "v_axis sign", std::to_string(c.v_axis.sign), "+1 or -1");
  require(index(c.u_axis) <= 2, "u_axis", std::to_string(index(c.u_axis)), "x, y or z");
  require(index(c.v_axis) <= 2, "v_axis", std::to_string(index(c.v_axis)), "x, y or z");
  require(c.u_axis.axis != c.v_axis.axis, "v_axis", "the same as u_axis", "two different axes of {A}");
}

}  // namespace

PlanarView::PlanarView(const PlanarViewConfig& config) : config_(config) { check(config_); }

Vector3 PlanarView::position_mm(const cv::Point2d& pixel) const {
  Vector3 position{};
  position[index(config_.u_axis)] = config_.u_axis.sign * (pixel.x - config_.origin_px.x) / config_.px_per_mm;
  position[index(config_.v_axis)] = config_.v_axis.sign * (pixel.y - config_.origin_px.y) / config_.px_per_mm;
  return position;
}

cv::Point2d PlanarView::pixel(const Vector3& position_mm) const {
  const double u_mm = config_.u_axis.sign * position_mm[index(config_.u_axis)];
  const double v_mm = config_.v_axis.sign * position_mm[index(config_.v_axis)];
  return config_.origin_px + config_.px_per_mm * cv::Point2d(u_mm, v_mm);
}

Matrix3 PlanarView::information_per_mm2(const cv::Point2d& /*pixel*/, const cv::Matx22d& covariance_px2) const {
  const cv::Matx22d info = covariance_px2.inv() * (config_.px_per_mm * config_.px_per_mm);
  const size_t u = index(config_.u_axis);
  const size_t v = index(config_.v_axis);
  const double cross = config_.u_axis.sign * config_.v_axis.sign * 0.5 * (info(0, 1) + info(1, 0));
  Matrix3 out{};
  out[3 * u + u] = info(0, 0);
  out[3 * v + v] = info(1, 1);
  out[3 * u + v] = cross;
  out[3 * v + u] = cross;
  return out;
}

// All pixels are the same number of mm to both sides, so that angles in the picture are angles in its plane of {A}.
SeenDirection PlanarView::direction(const cv::Point2d& /*pixel*/, const cv::Vec2d& direction_px,
                                    double variance_rad2) const {
  const cv::Vec2d along = cv::normalize(direction_px);
  SeenDirection seen;
  Vector3 across{};
  seen.direction[index(config_.u_axis)] = config_.u_axis.sign * along[0];
  seen.direction[index(config_.v_axis)] = config_.v_axis.sign * along[1];
  across[index(config_.u_axis)] = -config_.u_axis.sign * along[1];
  across[index(config_.v_axis)] = config_.v_axis.sign * along[0];
  for (size_t r = 0; r < 3; ++r)
    for (size_t c = 0; c < 3; ++c) seen.information_per_rad2[3 * r + c] = across[r] * across[c] / variance_rad2;
  return seen;
}

}  // namespace bevel::camera
