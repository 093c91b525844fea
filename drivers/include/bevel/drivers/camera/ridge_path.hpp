// SPDX-License-Identifier: MIT
#pragma once
// Finding the needle in a patch (canonical: it runs down from the first row): a dark-ridge response at the needle's
// width, and the path down the patch that collects most of it. A path collects evidence over all its rows, so gaps
// (bubbles, glare) and clutter that is no line do not end or attract it as they would a blob.
#include <opencv2/core.hpp>
#include <vector>

namespace bevel::camera {

/// Widths in which the needle is looked at across, in pixels.
struct RidgeScale {
  int core_px = 5;    ///< odd; box over the needle, and over each side
  int offset_px = 8;  ///< from the middle of the core to the middle of a side
};
RidgeScale ridge_scale(double needle_width_px);

/// min(left side, right side) - core, box means over 3 rows, CV_8UC1, negative values are 0. The minimum keeps a step
/// (shadow, surface of the gel) from looking like a line. Costs two box filters; the bank of Gabor filters it replaces
/// costs a hundred times as much.
class RidgeResponse {
 public:
  const cv::Mat& compute(const cv::Mat& patch, const RidgeScale& scale);
  const cv::Mat& last() const { return response_; }

 private:
  cv::Mat boxes_;
  cv::Mat sides_;
  cv::Mat response_;
};

struct RidgePath {
  std::vector<int> cols;      ///< one per row from the first row of the patch to the last row of the path
  std::vector<double> ridge;  ///< response along it
  double score = 0.0;         ///< sum of (response^2 - threshold^2) / cap; zero if there is no path
  int last_row() const { return static_cast<int>(cols.size()) - 1; }
};

struct PathQuery {
  int first_col = 0;  ///< columns in which the path may start, in the first row
  int last_col = 0;
  double threshold_gray = 10.0;  ///< rows below this count against the path
  /// Rows count no more than this. Below it they count by their square, as the logarithm of a likelihood does: a dark
  /// needle that is seen over a few rows is more than a printed line or an old track that runs through the whole
  /// picture.
  double cap_gray = 80.0;
};

/// Best path by dynamic programming; a path moves by at most one column a row. Rows without needle cost so little
/// that it needs none above: it may come in behind a frame or the edge of the glass.
class RidgePathFinder {
 public:
  RidgePath find(const cv::Mat& response, const PathQuery& query);

 private:
  cv::Mat gain_;
  cv::Mat sum_;
};

/// The row up to which the path really is needle: where the sum of (response - share * its typical response) peaks.
/// Typical is what half of the evidence lies above, in the last `window_rows` before that row, so that a fainter line
/// which continues the needle (an old track, a printed one) is not taken for it.
/// The path ends before that where it is interrupted and goes on aside of where it went, as a needle `width_px` wide
/// does not.
int end_of_needle(const RidgePath& path, int window_rows, int width_px, double share);

double share_of_rows_above(const RidgePath& path, double threshold_gray);

/// Sets the response to zero along a path, so that the next best can be looked for.
void erase_path(cv::Mat& response, const RidgePath& path, int half_width_px);

}  // namespace bevel::camera
