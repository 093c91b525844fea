// SPDX-License-Identifier: MIT
#pragma once
// The tracker is written once, for a needle that comes in at the top, runs down and is a few pixels wide. This turns
// and shrinks other pictures that way: canonical (col, row) against picture (u, v).
#include <opencv2/core.hpp>

#include <bevel/drivers/camera/tracker_config.hpp>

namespace bevel::camera {

class Canonical {
 public:
  /// `shrink`: pixels of the picture to a canonical one, along each axis.
  Canonical(EntrySide side, cv::Size picture, int shrink = 1)
      : side_(side), shrink_(shrink), picture_(picture.width / shrink, picture.height / shrink) {}

  /// Size of the turned picture.
  cv::Size size() const { return sideways() ? cv::Size(picture_.height, picture_.width) : picture_; }

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

  cv::Point2d to_picture(const cv::Point2d& c) const {
    const cv::Point2d p = turned_back(c);
    return {(p.x + 0.5) * shrink_ - 0.5, (p.y + 0.5) * shrink_ - 0.5};
  }

  cv::Vec2d direction_to_picture(const cv::Vec2d& d) const {
    const cv::Point2d moved = turned_back({d[0], d[1]}) - turned_back({0.0, 0.0});
    return {moved.x, moved.y};
  }

  /// The canonical rectangle `rect` of `picture`, turned and shrunk. Shares memory with it where there is nothing to
  /// do.
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
