// SPDX-License-Identifier: MIT
#include <bevel/rig/camera/optics.hpp>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include <bevel/error.hpp>

namespace bevel::rig {
namespace {

void require(bool good, const char* key, double value, const char* allowed) {
  if (!good)
    throw ArgumentError(std::string("scene ") + key + " is " + std::to_string(value) + ", allowed: " + allowed);
}

}  // namespace

Optics::Optics(const LensDistortion& lens, const FlatRefraction& refraction, cv::Size picture_px, double px_per_mm)
    : lens_(lens),
      refraction_(refraction),
      middle_(0.5 * (picture_px.width - 1), 0.5 * (picture_px.height - 1)),
      half_diagonal_px_(0.5 * std::hypot(picture_px.width, picture_px.height)),
      px_per_mm_(px_per_mm),
      trivial_(lens.k1 == 0.0 && lens.k2 == 0.0 && refraction.gel_depth_mm == 0.0) {
  require(std::abs(lens.k1) <= 0.3, "lens.k1", lens.k1, "-0.3 to 0.3");
  require(std::abs(lens.k2) <= 0.3, "lens.k2", lens.k2, "-0.3 to 0.3");
  require(refraction.gel_depth_mm >= 0.0, "refraction.gel_depth_mm", refraction.gel_depth_mm, "0 or more");
  require(refraction.distance_mm > 0.0, "refraction.distance_mm", refraction.distance_mm, "above 0");
  require(refraction.index >= 1.0 && refraction.index <= 2.5, "refraction.index", refraction.index, "1 to 2.5");
  if (trivial_) return;
  // The way back, of which there is no formula, by a table of the radius.
  std::vector<double> seen_at;
  for (int radius_px = 0; radius_px < 2.0 * half_diagonal_px_; ++radius_px) {
    const double r = radius_px;
    seen_at.push_back(seen_radius_px(r));
    const bool grows = seen_at.size() < 2 || seen_at.back() > seen_at[seen_at.size() - 2];
    if (!grows) require(r > 1.1 * half_diagonal_px_, "lens.k1", lens.k1, "less: the picture folds over within itself");
    if (!grows) break;
  }
  map_.create(picture_px, CV_32FC2);
  for (int v = 0; v < map_.rows; ++v)
    for (int u = 0; u < map_.cols; ++u) {
      const cv::Point2d off = cv::Point2d(u, v) - middle_;
      const double r = cv::norm(off);
      const auto next = std::upper_bound(seen_at.begin(), seen_at.end() - 1, r);
      const auto i = std::max<std::ptrdiff_t>(1, next - seen_at.begin());
      const double low = seen_at[static_cast<size_t>(i - 1)], high = seen_at[static_cast<size_t>(i)];
      const double ideal = static_cast<double>(i - 1) + (r - low) / (high - low);
      const cv::Point2d from = r > 0.0 ? middle_ + ideal / r * off : middle_;
      map_.at<cv::Vec2f>(v, u) = {static_cast<float>(from.x), static_cast<float>(from.y)};
    }
}

double Optics::seen_radius_px(double radius_px) const {
  double r = radius_px;
  if (refraction_.gel_depth_mm > 0.0) {
    const double wanted_mm = r / px_per_mm_;
    const double paraxial_mm = refraction_.distance_mm + refraction_.gel_depth_mm / refraction_.index;
    double slope = wanted_mm / paraxial_mm;  // tan(a)
    for (int i = 0; i < 8; ++i) {
      const double sine = slope / std::sqrt(1.0 + slope * slope) / refraction_.index;
      const double cosine = std::sqrt(1.0 - sine * sine);
      const double reached_mm = refraction_.distance_mm * slope + refraction_.gel_depth_mm * sine / cosine;
      const double by_slope = refraction_.distance_mm +
                              refraction_.gel_depth_mm /
                                  (refraction_.index * cosine * cosine * cosine * std::pow(1.0 + slope * slope, 1.5));
      slope += (wanted_mm - reached_mm) / by_slope;
    }
    r = slope * paraxial_mm * px_per_mm_;
  }
  const double q2 = (r / half_diagonal_px_) * (r / half_diagonal_px_);
  return r * (1.0 + lens_.k1 * q2 + lens_.k2 * q2 * q2);
}

cv::Point2d Optics::seen(const cv::Point2d& p) const {
  if (trivial_) return p;
  const cv::Point2d off = p - middle_;
  const double r = cv::norm(off);
  return r > 0.0 ? middle_ + seen_radius_px(r) / r * off : p;
}

cv::Mat Optics::seen(const cv::Mat& ideal) const {
  if (trivial_) return ideal;
  cv::Mat out;
  cv::remap(ideal, out, map_, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return out;
}

}  // namespace bevel::rig
