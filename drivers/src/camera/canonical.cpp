// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/canonical.hpp>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace bevel::camera {

cv::Mat Canonical::crop(const cv::Mat& picture, const cv::Rect& rect) const {
  const cv::Point2d a = turned_back({rect.x + 0.0, rect.y + 0.0});
  const cv::Point2d b = turned_back({rect.x + rect.width - 1.0, rect.y + rect.height - 1.0});
  const cv::Point first(cvRound(std::min(a.x, b.x)), cvRound(std::min(a.y, b.y)));
  const cv::Point last(cvRound(std::max(a.x, b.x)), cvRound(std::max(a.y, b.y)));
  const cv::Rect small(first, last + cv::Point(1, 1));
  cv::Mat piece = picture(cv::Rect(small.tl() * shrink_, small.size() * shrink_));
  if (shrink_ > 1) {
    cv::Mat averaged;
    cv::resize(piece, averaged, small.size(), 0.0, 0.0, cv::INTER_AREA);
    piece = averaged;
  }
  cv::Mat turned;
  switch (side_) {
    case EntrySide::top:
      return piece;
    case EntrySide::bottom:
      cv::flip(piece, turned, 0);
      break;
    case EntrySide::left:
      cv::transpose(piece, turned);
      break;
    case EntrySide::right: {
      cv::Mat mirrored;
      cv::flip(piece, mirrored, 1);
      cv::transpose(mirrored, turned);
      break;
    }
  }
  return turned;
}

}  // namespace bevel::camera
