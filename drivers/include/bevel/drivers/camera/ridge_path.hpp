// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Detection of the needle in a patch in canonical orientation (it runs down from the first row): a dark-ridge response
/// at the needle's width, and the path down the patch with the largest sum of it. A path collects evidence over all its
/// rows, so that gaps (bubbles, glare) do not end it, and clutter that is not a line does not attract it.
#include <opencv2/core.hpp>
#include <vector>

namespace bevel::camera {

/// Widths of the ridge response, px.
struct RidgeScale {
  int core_px = 5;    ///< odd; box over the needle, and over each side
  int offset_px = 8;  ///< from the middle of the core to the middle of a side
};
/// Computes the widths for a needle.
/// @param needle_width_px diameter of the needle, px
/// @return widths
RidgeScale ridge_scale(double needle_width_px);

/// Computes min(left side, right side) - core of box means over 3 rows; negative values are 0. The minimum suppresses
/// steps (shadow, surface of the gel). The cost is that of two box filters, a hundredth of a bank of Gabor filters.
class RidgeResponse {
 public:
  /// Computes the response.
  /// @param patch brightness, CV_8UC1
  /// @param scale widths
  /// @return response, CV_8UC1, of the size of the patch; valid until the next call
  const cv::Mat& compute(const cv::Mat& patch, const RidgeScale& scale);
  /// @return response of the last compute()
  const cv::Mat& last() const { return response_; }

 private:
  cv::Mat boxes_;
  cv::Mat sides_;
  cv::Mat response_;
};

/// Path down a patch.
struct RidgePath {
  std::vector<int> cols;      ///< one per row from the first row of the patch to the last row of the path
  std::vector<double> ridge;  ///< response along it
  double score = 0.0;         ///< sum of (response^2 - threshold^2) / cap; zero if there is no path
  /// @return last row of the path; -1 if there is no path
  int last_row() const { return static_cast<int>(cols.size()) - 1; }
};

/// Settings of the search.
struct PathQuery {
  int first_col = 0;             ///< first column in which the path may start, in the first row
  int last_col = 0;              ///< last column in which the path may start
  double threshold_gray = 10.0;  ///< rows below this count against the path
  /// Largest response that counts for a row, grey levels. Below it rows count by their square, as the logarithm of a
  /// likelihood does: a dark needle that is seen over a few rows has more evidence than a printed line or an old track
  /// that runs through the whole image.
  double cap_gray = 80.0;
};

/// Finds the best path by dynamic programming. A path moves by at most one column per row. Rows without needle have a
/// small cost, so that a path may begin at the first row although the needle enters behind a frame or the edge of the
/// glass.
class RidgePathFinder {
 public:
  /// Finds the best path.
  /// @param response response of RidgeResponse
  /// @param query    settings of the search
  /// @return path; zero columns if no path is found
  RidgePath find(const cv::Mat& response, const PathQuery& query);

 private:
  cv::Mat gain_;
  cv::Mat sum_;
};

/// Finds the last row of a path that belongs to the needle: the maximum of the sum of (response - share * typical
/// response). Half of the evidence lies on rows at least as dark as the typical response, in the last `window_rows`
/// before that row, so that a fainter line which continues the needle (an old track, a printed line) is excluded. The
/// path ends earlier if it is interrupted and continues with a lateral offset that a needle of this width does not
/// have.
/// @param path        path
/// @param window_rows rows before the end from which the typical response is computed
/// @param width_px    diameter of the needle, px
/// @param share       fraction of the typical response
/// @return row; -1 for an empty path
int end_of_needle(const RidgePath& path, int window_rows, int width_px, double share);

/// Computes the fraction of the rows of a path whose response exceeds a threshold.
/// @param path           path
/// @param threshold_gray threshold, grey levels
/// @return fraction, 0 to 1
double share_of_rows_above(const RidgePath& path, double threshold_gray);

/// Sets the response to zero along a path, so that the next best path can be searched.
/// @param response      response to change
/// @param path          path
/// @param half_width_px largest distance from the path that is erased, px
void erase_path(cv::Mat& response, const RidgePath& path, int half_width_px);

}  // namespace bevel::camera
