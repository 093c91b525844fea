// SPDX-License-Identifier: MIT
#pragma once
// One pattern of a ChArUco board, with the same numbering and axes for all versions of OpenCV. Private to board.cpp.
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include <bevel/drivers/camera/calibration/board.hpp>

namespace bevel::camera {

/// Markers detected in one image.
struct FoundMarkers {
  std::vector<std::vector<cv::Point2f>> corners;  ///< px, by marker: top left, top right, bottom right, bottom left
  std::vector<int> ids;
};

class Charuco {
 public:
  /// Lays out the board itself: OpenCV's own layout depends on its version.
  Charuco(const BoardSpec& spec, CharucoPattern pattern);

  FoundMarkers find_markers(const cv::Mat& gray) const;
  /// Median distance of marker corners from where this pattern has them, in squares, after the best homography;
  /// infinite for fewer than two markers of this board. A lens leaves a few hundredths; the other pattern leaves about
  /// 1, since it has every row of markers displaced by one square, alternately to the left and to the right.
  double misfit_squares(const FoundMarkers& markers) const;
  /// Chessboard corners between the markers, numbered by rows from the top left as printed.
  Sighting find_corners(const cv::Mat& gray, const FoundMarkers& markers) const;
  /// As printed, with a white margin of half a square; CV_8UC1.
  cv::Mat drawing(int px_per_square) const;

 private:
  bool has_marker(int column, int row) const;

  BoardSpec spec_;
  CharucoPattern pattern_;
  cv::Ptr<cv::aruco::Dictionary> dictionary_;
  cv::Ptr<cv::aruco::CharucoBoard> board_;
  cv::Point2d shift_px_;  // some versions count pixels from their edge, 0.5 more than the rest of OpenCV
};

/// Median distance of `seen_px` from the best homography of `board_mm`, in squares; infinite if there is no homography.
double misfit_squares(const std::vector<cv::Point2d>& board_mm, const std::vector<cv::Point2d>& seen_px,
                      double square_mm);

}  // namespace bevel::camera
