#include "drivers/camera/ridge_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace bevel::camera {
namespace {

// A sideways step costs a little, so that in noise the straight path wins.
constexpr float kStepCost_gray = 1.0F;

}  // namespace

RidgeScale ridge_scale(double needle_width_px) {
  RidgeScale scale;
  scale.core_px = std::max(3, 2 * cvRound((needle_width_px - 1.0) / 2.0) + 1);
  // Far enough out that neither blur nor a needle at 45 degrees (1.4 times as wide in a row) darkens the sides.
  scale.offset_px = scale.core_px + std::max(2, cvRound(0.5 * needle_width_px));
  return scale;
}

const cv::Mat& RidgeResponse::compute(const cv::Mat& patch, const RidgeScale& scale) {
  response_.create(patch.size(), CV_8UC1);
  response_.setTo(0);
  const int d = scale.offset_px;
  const int inner = patch.cols - 2 * d;
  if (inner <= 0) return response_;
  cv::blur(patch, boxes_, cv::Size(scale.core_px, 3), cv::Point(-1, -1), cv::BORDER_REPLICATE);
  cv::min(boxes_.colRange(0, inner), boxes_.colRange(2 * d, 2 * d + inner), sides_);
  cv::Mat middle = response_.colRange(d, d + inner);
  cv::subtract(sides_, boxes_.colRange(d, d + inner), middle);
  return response_;
}

RidgePath RidgePathFinder::find(const cv::Mat& response, const PathQuery& query) {
  const int rows = response.rows;
  const int cols = response.cols;
  RidgePath path;
  if (rows < 2 || cols < 3) return path;
  response.convertTo(gain_, CV_32F);
  gain_ = cv::min(gain_, query.cap_gray);
  gain_ -= query.threshold_gray;
  sum_.create(rows, cols, CV_32F);
  constexpr float unreachable = -1e9F;
  float* first = sum_.ptr<float>(0);
  for (int x = 0; x < cols; ++x)
    first[x] = x >= query.first_col && x <= query.last_col ? gain_.at<float>(0, x) : unreachable;
  for (int r = 1; r < rows; ++r) {
    const float* above = sum_.ptr<float>(r - 1);
    const float* gain = gain_.ptr<float>(r);
    float* here = sum_.ptr<float>(r);
    here[0] = std::max(above[0], above[1] - kStepCost_gray) + gain[0];
    here[cols - 1] = std::max(above[cols - 1], above[cols - 2] - kStepCost_gray) + gain[cols - 1];
    for (int x = 1; x < cols - 1; ++x) {
      const float side = std::max(above[x - 1], above[x + 1]) - kStepCost_gray;
      here[x] = std::max(above[x], side) + gain[x];
    }
  }
  double best = 0.0;
  cv::Point end;
  cv::minMaxLoc(sum_, nullptr, &best, nullptr, &end);
  if (best <= 0.0) return path;
  path.score = best;
  path.cols.resize(static_cast<size_t>(end.y) + 1);
  path.ridge.resize(path.cols.size());
  int x = end.x;
  for (int r = end.y; r >= 0; --r) {
    path.cols[static_cast<size_t>(r)] = x;
    path.ridge[static_cast<size_t>(r)] = response.at<uchar>(r, x);
    if (r == 0) break;
    // The way back is read from the sums: no second table of the size of the picture.
    const float* above = sum_.ptr<float>(r - 1);
    int came_from = x;
    float most = above[x];
    for (const int neighbour : {x - 1, x + 1})
      if (neighbour >= 0 && neighbour < cols && above[neighbour] - kStepCost_gray > most) {
        most = above[neighbour] - kStepCost_gray;
        came_from = neighbour;
      }
    x = came_from;
  }
  return path;
}

int end_of_needle(const RidgePath& path, int window_rows, double share) {
  const int rows = static_cast<int>(path.ridge.size());
  if (rows == 0) return -1;
  std::vector<double> recent(path.ridge.end() - std::min(rows, window_rows), path.ridge.end());
  const auto quartile = recent.begin() + static_cast<std::ptrdiff_t>(recent.size() * 3 / 4);
  std::nth_element(recent.begin(), quartile, recent.end());
  const double typical = *quartile;
  double sum = 0.0;
  double best = -std::numeric_limits<double>::infinity();
  int best_row = rows - 1;
  for (int r = std::max(0, rows - window_rows); r < rows; ++r) {
    sum += std::min(path.ridge[static_cast<size_t>(r)], typical) - share * typical;
    if (sum > best) {
      best = sum;
      best_row = r;
    }
  }
  return best_row;
}

double share_of_rows_above(const RidgePath& path, double threshold_gray) {
  if (path.ridge.empty()) return 0.0;
  const auto above = std::count_if(path.ridge.begin(), path.ridge.end(), [=](double r) { return r > threshold_gray; });
  return static_cast<double>(above) / static_cast<double>(path.ridge.size());
}

void erase_path(cv::Mat& response, const RidgePath& path, int half_width_px) {
  for (int r = 0; r <= path.last_row(); ++r) {
    const int x = path.cols[static_cast<size_t>(r)];
    const int from = std::max(0, x - half_width_px);
    const int to = std::min(response.cols, x + half_width_px + 1);
    response.row(r).colRange(from, to).setTo(0);
  }
}

}  // namespace bevel::camera
