// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Rotation and reduction of images to canonical coordinates (col, row), in which the needle enters at the top, runs
/// down and is a few pixels wide. The tracker is implemented only for these.
#include <opencv2/core.hpp>

#include <bevel/drivers/camera/tracker_config.hpp>

namespace bevel::camera {

/// Maps between an image (u, v) and canonical coordinates (col, row).
class Canonical {
 public:
  /// Creates the mapping.
  /// @param side    side of the image through which the needle enters
  /// @param picture size of the image, px
  /// @param shrink  pixels of the image in a canonical pixel, along each axis
  Canonical(EntrySide side, cv::Size picture, int shrink = 1)
      : side_(side), shrink_(shrink), picture_(picture.width / shrink, picture.height / shrink) {}

  /// @return size of the canonical image, px
  cv::Size size() const { return sideways() ? cv::Size(picture_.height, picture_.width) : picture_; }

  /// Converts a point.
  /// @param pixel pixel (u, v) of the image
  /// @return canonical (col, row)
  cv::Point2d to_canonical(const cv::Point2d& pixel) const {
    const cv::Point2d p((pixel.x + 0.5) / shrink_ - 0.5, (pixel.y + 0.5) / shrink_ - 0.5);
    switch (side_) {
      case EntrySide::top:
        return p;
      case EntrySide::bottom:
        return {p.x, last_v() - p.y};
      case EntrySide::left:
        return {p.y, p.x};
      case EntrySide::right:
        return {p.y, last_u() - p.x};
    }
    return p;
  }

  /// Converts a point back.
  /// @param c canonical (col, row)
  /// @return pixel (u, v) of the image
  cv::Point2d to_picture(const cv::Point2d& c) const {
    const cv::Point2d p = turned_back(c);
    return {(p.x + 0.5) * shrink_ - 0.5, (p.y + 0.5) * shrink_ - 0.5};
  }

  /// Converts a direction.
  /// @param d canonical (col, row)
  /// @return direction (u, v) in the image, of unchanged length
  cv::Vec2d direction_to_picture(const cv::Vec2d& d) const {
    const cv::Point2d moved = turned_back({d[0], d[1]}) - turned_back({0.0, 0.0});
    return {moved.x, moved.y};
  }

  /// Extracts a part of an image in canonical orientation and scale.
  /// @param picture image
  /// @param rect    canonical rectangle
  /// @return canonical image; shares memory with `picture` if no conversion is needed
  cv::Mat crop(const cv::Mat& picture, const cv::Rect& rect) const;

 private:
  cv::Point2d turned_back(const cv::Point2d& c) const {
    switch (side_) {
      case EntrySide::top:
        return c;
      case EntrySide::bottom:
        return {c.x, last_v() - c.y};
      case EntrySide::left:
        return {c.y, c.x};
      case EntrySide::right:
        return {last_u() - c.y, c.x};
    }
    return c;
  }

  bool sideways() const { return side_ == EntrySide::left || side_ == EntrySide::right; }
  double last_u() const { return picture_.width - 1.0; }
  double last_v() const { return picture_.height - 1.0; }

  EntrySide side_;
  int shrink_;
  cv::Size picture_;
};

}  // namespace bevel::camera
