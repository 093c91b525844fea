#pragma once
// The tracker is written once, for a needle that comes in at the top and runs down. This turns other pictures that way:
// canonical (col, row) against picture (u, v).
#include <opencv2/core.hpp>

#include "drivers/camera/tracker_config.hpp"

namespace bevel::camera {

class Canonical {
 public:
  Canonical(EntrySide side, cv::Size picture) : side_(side), picture_(picture) {}

  /// Size of the turned picture.
  cv::Size size() const { return sideways() ? cv::Size(picture_.height, picture_.width) : picture_; }

  cv::Point2d to_canonical(const cv::Point2d& p) const {
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

  cv::Vec2d direction_to_picture(const cv::Vec2d& d) const {
    const cv::Point2d moved = to_picture({d[0], d[1]}) - to_picture({0.0, 0.0});
    return {moved.x, moved.y};
  }

  /// The canonical rectangle `rect` of `picture`, turned. Shares memory with it where nothing needs turning.
  cv::Mat crop(const cv::Mat& picture, const cv::Rect& rect) const;

 private:
  bool sideways() const { return side_ == EntrySide::left || side_ == EntrySide::right; }
  double last_u() const { return picture_.width - 1.0; }
  double last_v() const { return picture_.height - 1.0; }

  EntrySide side_;
  cv::Size picture_;
};

}  // namespace bevel::camera
