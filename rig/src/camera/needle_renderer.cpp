// SPDX-License-Identifier: MIT
#include <bevel/rig/camera/needle_renderer.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <string>

#include <bevel/error.hpp>

namespace bevel::rig {
namespace {

constexpr int kSamples = 4;  // per pixel and axis

void require(bool good, const char* key, double value, const char* allowed) {
  if (!good)
    throw ArgumentError(std::string("scene ") + key + " is " + std::to_string(value) + ", allowed: " + allowed);
}

void check(const SceneConfig& s) {
  const auto gray = [](double v) { return v >= 0.0 && v <= 255.0; };
  require(s.size_px.width >= 32 && s.size_px.width <= 4096, "width_px", s.size_px.width, "32 to 4096");
  require(s.size_px.height >= 32 && s.size_px.height <= 4096, "height_px", s.size_px.height, "32 to 4096");
  require(gray(s.background_gray), "background_gray", s.background_gray, "0 to 255");
  require(gray(s.needle_gray), "needle_gray", s.needle_gray, "0 to 255");
  require(gray(s.grid_gray), "grid_gray", s.grid_gray, "0 to 255");
  require(gray(s.vignette_gray), "vignette_gray", s.vignette_gray, "0 to 255");
  require(s.grid_mm == 0.0 || (s.grid_mm >= 0.5 && s.grid_mm <= 1e3), "grid_mm", s.grid_mm, "0, or 0.5 to 1000");
  require(s.needle_diameter_mm > 0.0 && s.needle_diameter_mm <= 20.0, "needle_diameter_mm", s.needle_diameter_mm,
          "above 0, up to 20");
  require(s.bevel_length_mm >= 0.0 && s.bevel_length_mm <= 50.0, "bevel_length_mm", s.bevel_length_mm, "0 to 50");
  require(s.blur_px >= 0.0 && s.blur_px <= 50.0, "blur_px", s.blur_px, "0 to 50");
  require(s.noise_gray >= 0.0 && s.noise_gray <= 100.0, "noise_gray", s.noise_gray, "0 to 100");
  require(s.face_gray <= 255.0, "face_gray", s.face_gray, "up to 255; negative for none");
  for (int k = 0; k < 2; ++k) {
    require(std::abs(s.light_gradient[k]) <= 0.9, "light_gradient", s.light_gradient[k], "-0.9 to 0.9");
    require(std::abs(s.shutter.motion_px[k]) <= 100.0, "shutter.motion_px", s.shutter.motion_px[k], "-100 to 100");
  }
  require(s.gain > 0.0 && s.gain <= 100.0, "gain", s.gain, "above 0, up to 100");
}

cv::Mat paint_background(const SceneConfig& s, const camera::View& view) {
  cv::Mat light(s.size_px, CV_32F);
  const cv::Point2d origin = view.pixel({0.0, 0.0, 0.0});
  const double spacing_px = s.grid_mm * view.px_per_mm();
  const double half_diagonal_px = 0.5 * std::hypot(s.size_px.width, s.size_px.height);
  const auto line = [spacing_px](double off_px) {  // a printed line one pixel wide, 0 to 1
    if (spacing_px <= 0.0) return 0.0;
    const double d = std::abs(off_px - spacing_px * std::round(off_px / spacing_px));
    return std::clamp(1.0 - 0.5 * d, 0.0, 1.0);
  };
  std::vector<double> column_line(static_cast<size_t>(light.cols));
  // Half a spacing aside, so that no line lies under a straight needle.
  for (int u = 0; u < light.cols; ++u) column_line[static_cast<size_t>(u)] = line(u - origin.x + 0.5 * spacing_px);
  const double per_square = s.vignette_gray / (half_diagonal_px * half_diagonal_px);
  for (int v = 0; v < light.rows; ++v) {
    const double row_line = line(v - origin.y);
    const double off_v = v - 0.5 * light.rows;
    float* here = light.ptr<float>(v);
    for (int u = 0; u < light.cols; ++u) {
      const double off_u = u - 0.5 * light.cols;
      const double grid = std::max(column_line[static_cast<size_t>(u)], row_line);
      const double dimmer = per_square * (off_u * off_u + off_v * off_v);
      here[u] = static_cast<float>(s.background_gray - dimmer - s.grid_gray * grid);
    }
  }
  return light;
}

cv::Rect box_of(const std::vector<cv::Point2d>& axis_px, double margin_px, cv::Size picture) {
  double low_u = picture.width;
  double low_v = picture.height;
  double high_u = -1.0;
  double high_v = -1.0;
  for (const cv::Point2d& p : axis_px) {
    low_u = std::min(low_u, p.x);
    low_v = std::min(low_v, p.y);
    high_u = std::max(high_u, p.x);
    high_v = std::max(high_v, p.y);
  }
  const cv::Point first(cvFloor(low_u - margin_px), cvFloor(low_v - margin_px));
  const cv::Point last(cvCeil(high_u + margin_px), cvCeil(high_v + margin_px));
  return cv::Rect(first, last) & cv::Rect({0, 0}, picture);
}

void add_glare(cv::Mat& light, const Spot& spot) {
  for (int v = 0; v < light.rows; ++v)
    for (int u = 0; u < light.cols; ++u) {
      const double r2 = std::pow(u - spot.centre_px.x, 2) + std::pow(v - spot.centre_px.y, 2);
      if (r2 > 9.0 * spot.radius_px * spot.radius_px) continue;
      const double more = spot.strength_gray * std::exp(-0.5 * r2 / (spot.radius_px * spot.radius_px));
      light.at<float>(v, u) += static_cast<float>(more);
    }
}

}  // namespace

NeedleRenderer::NeedleRenderer(const SceneConfig& scene, const camera::PlanarView& view)
    : NeedleRenderer(scene, std::make_shared<camera::PlanarView>(view)) {}

NeedleRenderer::NeedleRenderer(const SceneConfig& scene, std::shared_ptr<const camera::View> view)
    : scene_(scene),
      optics_(scene.lens, scene.refraction, scene.size_px, view->px_per_mm()),
      view_(std::move(view)),
      random_(scene.seed) {
  check(scene_);
  background_ = optics_.seen(paint_background(scene_, *view_));
}

cv::Point2d NeedleRenderer::while_read_out(const cv::Point2d& p) const {
  const cv::Vec2d& m = scene_.shutter.motion_px;
  const double v = p.y / (1.0 - m[1] / scene_.size_px.height);  // the row in which the moving point is met
  const double time = v / scene_.size_px.height;
  return {p.x + m[0] * time, v};
}

double NeedleRenderer::roll_seen_rad(const camera::Vector3& tip_mm, const camera::Vector3& heading,
                                     const camera::Vector3& pointed_side) const {
  constexpr double kAside_mm = 0.01;
  cv::Matx23d by_mm;  // of u, v by x, y, z
  for (int axis = 0; axis < 3; ++axis) {
    camera::Vector3 before = tip_mm, after = tip_mm;
    before.at(static_cast<size_t>(axis)) -= kAside_mm;
    after.at(static_cast<size_t>(axis)) += kAside_mm;
    const cv::Point2d change = (view_->pixel(after) - view_->pixel(before)) / (2.0 * kAside_mm);
    by_mm(0, axis) = change.x, by_mm(1, axis) = change.y;
  }
  const cv::Vec3d point(pointed_side[0], pointed_side[1], pointed_side[2]);
  const cv::Vec2d along = by_mm * cv::Vec3d(heading[0], heading[1], heading[2]);
  // add_needle's `side` grows this way; with v down, u x v points away from the camera, where the point is at roll 0.
  const cv::Vec3d side = cv::normalize(by_mm.t() * cv::Vec2d(along[1], -along[0]));
  const cv::Vec3d away = cv::normalize(
      cv::Vec3d(by_mm(0, 0), by_mm(0, 1), by_mm(0, 2)).cross(cv::Vec3d(by_mm(1, 0), by_mm(1, 1), by_mm(1, 2))));
  return std::atan2(point.dot(side), point.dot(away));
}

void NeedleRenderer::add_needle(cv::Mat& light, const std::vector<cv::Point2d>& axis_px, double roll_rad) const {
  const double radius_px = 0.5 * scene_.needle_diameter_mm * view_->px_per_mm();
  const double bevel_px = scene_.bevel_length_mm * view_->px_per_mm();
  double length_px = 0.0;
  for (size_t i = 1; i < axis_px.size(); ++i) length_px += cv::norm(axis_px[i] - axis_px[i - 1]);
  // Silhouette: at `side` (in radii) from the axis the metal ends where the bevel plane leaves the cylinder's outline.
  const double across = std::sin(roll_rad);
  const double deep = std::abs(std::cos(roll_rad));
  const auto end_px = [&](double side) {
    const double foremost = side * across + deep * std::sqrt(std::max(0.0, 1.0 - side * side));
    return length_px - 0.5 * bevel_px * (1.0 - foremost);
  };
  // Beyond this the wall before the cut has ended, and its face is what is seen.
  const bool face_seen = scene_.face_gray >= 0.0 && std::cos(roll_rad) > 0.0;
  const auto wall_end_px = [&](double side) {
    const double nearest = side * across - deep * std::sqrt(std::max(0.0, 1.0 - side * side));
    return length_px - 0.5 * bevel_px * (1.0 - nearest);
  };
  const cv::Rect box = box_of(axis_px, radius_px + 2.0, light.size());
  if (box.empty()) return;
  cv::Mat dark = cv::Mat::zeros(box.height * kSamples, box.width * kSamples, CV_8UC1);
  cv::Mat face = face_seen ? dark.clone() : cv::Mat();
  const double first_sample = 0.5 / kSamples - 0.5;  // pixel u covers [u - 0.5, u + 0.5)
  const cv::Point2d corner = cv::Point2d(box.tl()) + cv::Point2d(first_sample, first_sample);
  double before_px = 0.0;
  for (size_t i = 1; i < axis_px.size(); ++i) {
    const cv::Point2d a = axis_px[i - 1];
    const cv::Point2d segment = axis_px[i] - a;
    const double step_px = cv::norm(segment);
    if (step_px <= 0.0) continue;
    const cv::Point2d t = segment / step_px;
    const double reach = radius_px + 1.0;
    const auto sample = [](double px) { return (px + 0.5) * kSamples - 0.5; };
    const int u0 = std::max(0, cvFloor(sample(std::min(a.x, axis_px[i].x) - reach - box.x)));
    const int u1 = std::min(dark.cols - 1, cvCeil(sample(std::max(a.x, axis_px[i].x) + reach - box.x)));
    const int v0 = std::max(0, cvFloor(sample(std::min(a.y, axis_px[i].y) - reach - box.y)));
    const int v1 = std::min(dark.rows - 1, cvCeil(sample(std::max(a.y, axis_px[i].y) + reach - box.y)));
    for (int v = v0; v <= v1; ++v) {
      for (int u = u0; u <= u1; ++u) {
        const cv::Point2d d = corner + cv::Point2d(u, v) / kSamples - a;
        const double along = d.dot(t);
        const double side = (d.x * t.y - d.y * t.x) / radius_px;
        // Segments overlap a little, so that the outer side of a bend has no cracks.
        if (along < -0.5 || along > step_px + 0.5 || std::abs(side) > 1.0) continue;
        if (before_px + along > end_px(side)) continue;
        dark.at<uchar>(v, u) = 255;
        if (face_seen && before_px + along > wall_end_px(side)) face.at<uchar>(v, u) = 255;
      }
    }
    before_px += step_px;
  }
  cv::Mat share, pale;
  cv::resize(dark, share, box.size(), 0.0, 0.0, cv::INTER_AREA);
  if (face_seen) cv::resize(face, pale, box.size(), 0.0, 0.0, cv::INTER_AREA);
  const auto needle = static_cast<float>(scene_.needle_gray);
  const float paler = static_cast<float>(scene_.face_gray) - needle;
  for (int v = 0; v < box.height; ++v) {
    for (int u = 0; u < box.width; ++u) {
      const float covered = static_cast<float>(share.at<uchar>(v, u)) / 255.0F;
      float& here = light.at<float>(box.y + v, box.x + u);
      const float metal =
          face_seen ? needle + paler * static_cast<float>(pale.at<uchar>(v, u)) / 255.0F / std::max(covered, 1e-3F)
                    : needle;
      here += covered * (metal - here);
    }
  }
}

void NeedleRenderer::add_what_is_before(cv::Mat& light) const {
  for (const Occluder& o : scene_.occluders) {
    const cv::Rect area(cvRound(o.area_px.x), cvRound(o.area_px.y), cvRound(o.area_px.width),
                        cvRound(o.area_px.height));
    light(area & cv::Rect({0, 0}, light.size())).setTo(o.gray);
  }
  const cv::Vec2d& g = scene_.light_gradient;
  if (g == cv::Vec2d(0.0, 0.0)) return;
  for (int v = 0; v < light.rows; ++v)
    for (int u = 0; u < light.cols; ++u)
      light.at<float>(v, u) *=
          static_cast<float>(1.0 + g[0] * (2.0 * u / light.cols - 1.0) + g[1] * (2.0 * v / light.rows - 1.0));
}

NeedlePicture NeedleRenderer::render(const std::vector<camera::Vector3>& path_mm, double roll_rad) {
  NeedlePicture picture;
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  picture.tip_px = {none, none};
  cv::Mat light = background_.clone();
  std::vector<cv::Point2d> axis_px;
  axis_px.emplace_back();
  for (const camera::Vector3& p : path_mm) axis_px.push_back(while_read_out(optics_.seen(view_->pixel(p))));
  const auto in_view = [](const cv::Point2d& p) { return std::isfinite(p.x) && std::isfinite(p.y); };
  if (path_mm.size() >= 2 && std::ranges::all_of(axis_px, in_view)) {
    const cv::Point2d first = axis_px[2] - axis_px[1];
    const cv::Point2d last = axis_px.back() - axis_px[axis_px.size() - 2];
    if (cv::norm(first) <= 0.0 || cv::norm(last) <= 0.0)
      throw ArgumentError("needle path: its first or last two points coincide in the picture");
    const double outside_px = 2.0 * (light.cols + light.rows);
    axis_px.front() = axis_px[1] - outside_px * (first / cv::norm(first));
    add_needle(light, axis_px, roll_rad);
    picture.tip_px = axis_px.back();
    picture.direction_px = cv::Vec2d(last.x, last.y) / cv::norm(last);
  }
  for (const Spot& b : scene_.bubbles) {
    const cv::Point centre(cvRound(b.centre_px.x), cvRound(b.centre_px.y));
    const int radius = std::max(1, cvRound(b.radius_px));
    cv::circle(light, centre, radius, cv::Scalar(scene_.background_gray), cv::FILLED);
    cv::circle(light, centre, radius, cv::Scalar(scene_.background_gray - b.strength_gray), 1);
  }
  add_what_is_before(light);
  for (const Spot& g : scene_.glare) add_glare(light, g);
  if (scene_.blur_px > 0.0)
    cv::GaussianBlur(light, light, cv::Size(), scene_.blur_px, scene_.blur_px, cv::BORDER_REPLICATE);
  light *= scene_.gain;
  if (scene_.noise_gray > 0.0) {
    noise_.create(light.size(), CV_32F);
    random_.fill(noise_, cv::RNG::NORMAL, 0.0, scene_.noise_gray);
    light += noise_;
  }
  light.convertTo(picture.gray, CV_8U);
  return picture;
}

}  // namespace bevel::rig
