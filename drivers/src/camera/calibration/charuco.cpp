// SPDX-License-Identifier: MIT
#include "camera/calibration/charuco.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include <bevel/error.hpp>
#include "camera/calibration/number_text.hpp"

namespace bevel::camera {
namespace {

// For each chessboard corner the markers that are nearest to it, and of each the nearest corner.
void find_nearest_markers(cv::aruco::CharucoBoard& board, double square_mm) {
  board.nearestMarkerIdx.assign(board.chessboardCorners.size(), {});
  board.nearestMarkerCorners.assign(board.chessboardCorners.size(), {});
  for (size_t i = 0; i < board.chessboardCorners.size(); ++i)
    for (size_t m = 0; m < board.objPoints.size(); ++m) {
      const auto& marker = board.objPoints[m];
      const auto distance = [&](const cv::Point3f& p) { return cv::norm(p - board.chessboardCorners[i]); };
      // The centre of a neighbouring square is 0.71 squares away, that of any other 1.58 or more.
      if (distance(0.5F * (marker[0] + marker[2])) > square_mm) continue;
      const auto nearest = std::ranges::min_element(marker, {}, distance);
      board.nearestMarkerIdx[i].push_back(static_cast<int>(m));
      board.nearestMarkerCorners[i].push_back(static_cast<int>(nearest - marker.begin()));
    }
}

}  // namespace

double misfit_squares(const std::vector<cv::Point2d>& board_mm, const std::vector<cv::Point2d>& seen_px,
                      double square_mm) {
  const cv::Mat homography = board_mm.size() < 4 ? cv::Mat() : cv::findHomography(board_mm, seen_px);
  if (homography.empty()) return std::numeric_limits<double>::infinity();
  std::vector<cv::Point2d> shown, next = board_mm, shown_next;
  for (cv::Point2d& p : next) p.x += square_mm;
  cv::perspectiveTransform(board_mm, shown, homography);
  cv::perspectiveTransform(next, shown_next, homography);
  std::vector<double> off;
  for (size_t i = 0; i < shown.size(); ++i)
    off.push_back(cv::norm(seen_px[i] - shown[i]) / std::max(1e-9, cv::norm(shown_next[i] - shown[i])));
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::ranges::nth_element(off, middle);
  return *middle;
}

Charuco::Charuco(const BoardSpec& spec, CharucoPattern pattern)
    : spec_(spec),
      pattern_(pattern),
      dictionary_(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_250)),
      board_(cv::aruco::CharucoBoard::create(spec.columns, spec.rows, static_cast<float>(spec.square_mm),
                                             static_cast<float>(spec.marker_mm), dictionary_)) {
  const auto point = [&](double x, double y) {
    return cv::Point3f(static_cast<float>(x * spec.square_mm), static_cast<float>(y * spec.square_mm), 0.0F);
  };
  const double half = 0.5 * spec.marker_mm / spec.square_mm;
  board_->objPoints.clear();
  board_->ids.clear();
  board_->chessboardCorners.clear();
  for (int row = 0; row < spec.rows; ++row)
    for (int column = 0; column < spec.columns; ++column) {
      if (row > 0 && column > 0) board_->chessboardCorners.push_back(point(column, row));
      if (!has_marker(column, row)) continue;
      const double x = column + 0.5, y = row + 0.5;
      board_->objPoints.push_back(
          {point(x - half, y - half), point(x + half, y - half), point(x + half, y + half), point(x - half, y + half)});
      board_->ids.push_back(static_cast<int>(board_->ids.size()));
    }
  find_nearest_markers(*board_, spec.square_mm);

  constexpr int kSquare_px = 64;
  const cv::Mat drawn = drawing(kSquare_px);
  const Sighting all = find_corners(drawn, find_markers(drawn));
  const int corners = (spec.columns - 1) * (spec.rows - 1);
  if (static_cast<int>(all.ids.size()) != corners)
    throw ArgumentError("board: the detector finds " + std::to_string(all.ids.size()) + " of " +
                        std::to_string(corners) + " corners in a drawing, allowed: all; marker_mm is " +
                        number_text(spec.marker_mm) + " of square_mm " + number_text(spec.square_mm));
  cv::Point2d off;
  for (size_t i = 0; i < all.ids.size(); ++i) {
    // A corner lies between two pixels, half a pixel before the centre of the second.
    const cv::Point3f corner = board_->chessboardCorners[static_cast<size_t>(all.ids[i])] / spec.square_mm;
    off += all.px[i] - kSquare_px * (cv::Point2d(corner.x, corner.y) + cv::Point2d(0.5, 0.5)) + cv::Point2d(0.5, 0.5);
  }
  // Whole halves: the rest is the precision of the corners.
  off /= static_cast<double>(all.ids.size());
  shift_px_ = {std::round(2.0 * off.x) / 2.0, std::round(2.0 * off.y) / 2.0};
}

bool Charuco::has_marker(int column, int row) const {
  // Older versions of OpenCV count rows from the bottom: with an even number of them the first square is white.
  const bool shifted = pattern_ == CharucoPattern::legacy && spec_.rows % 2 == 0;
  return (column + row) % 2 == (shifted ? 0 : 1);
}

FoundMarkers Charuco::find_markers(const cv::Mat& gray) const {
  FoundMarkers out;
  cv::aruco::detectMarkers(gray, dictionary_, out.corners, out.ids, cv::aruco::DetectorParameters::create());
  return out;
}

double Charuco::misfit_squares(const FoundMarkers& markers) const {
  std::vector<cv::Point2d> board_mm, seen_px;
  for (size_t m = 0; m < markers.ids.size(); ++m) {
    const auto id = static_cast<size_t>(markers.ids[m]);
    if (id >= board_->objPoints.size()) continue;
    for (size_t i = 0; i < 4; ++i) {
      board_mm.emplace_back(board_->objPoints[id][i].x, board_->objPoints[id][i].y);
      seen_px.emplace_back(markers.corners[m][i]);
    }
  }
  constexpr size_t kTwoMarkers = 8;  // corners; one marker fits any board
  if (board_mm.size() < kTwoMarkers) return std::numeric_limits<double>::infinity();
  return camera::misfit_squares(board_mm, seen_px, spec_.square_mm);
}

Sighting Charuco::find_corners(const cv::Mat& gray, const FoundMarkers& markers) const {
  Sighting out;
  out.pattern = pattern_;
  if (markers.ids.empty()) return out;
  std::vector<cv::Point2f> corners;
  cv::aruco::interpolateCornersCharuco(markers.corners, markers.ids, gray, board_, corners, out.ids);
  for (const cv::Point2f& corner : corners) out.px.push_back(cv::Point2d(corner) - shift_px_);
  return out;
}

cv::Mat Charuco::drawing(int px_per_square) const {
  const int margin = px_per_square / 2;
  const int marker_px = static_cast<int>(std::lround(px_per_square * spec_.marker_mm / spec_.square_mm));
  const int inset = (px_per_square - marker_px) / 2;
  cv::Mat out(spec_.rows * px_per_square + 2 * margin, spec_.columns * px_per_square + 2 * margin, CV_8UC1,
              cv::Scalar(255));
  int id = 0;
  for (int row = 0; row < spec_.rows; ++row)
    for (int column = 0; column < spec_.columns; ++column) {
      const int x = margin + column * px_per_square, y = margin + row * px_per_square;
      if (!has_marker(column, row)) {
        out(cv::Rect(x, y, px_per_square, px_per_square)) = 0;
        continue;
      }
      cv::Mat marker;
      cv::aruco::drawMarker(dictionary_, id++, marker_px, marker);
      marker.copyTo(out(cv::Rect(x + inset, y + inset, marker_px, marker_px)));
    }
  return out;
}

}  // namespace bevel::camera
