// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/ridge_path.hpp>

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
  cv::min(gain_, query.cap_gray, gain_);
  cv::multiply(gain_, gain_, gain_, 1.0 / query.cap_gray);
  gain_ -= query.threshold_gray * query.threshold_gray / query.cap_gray;
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

namespace {

/// The first row after which the path leaves the needle for something else: where it is faint for longer than a needle
/// is wide, and goes on elsewhere than straight ahead. A needle that is hidden for a while goes on where it went.
int first_kink(const RidgePath& path, int window_rows, int width_px, double faint) {
  const int rows = static_cast<int>(path.ridge.size());
  const auto dark = [&](int r) { return path.ridge[static_cast<size_t>(r)] > faint; };
  for (int r = 0; r < rows; ++r) {
    if (dark(r)) continue;
    int on = r;
    while (on < rows && !dark(on)) ++on;
    const int behind = std::min(window_rows / 2, r);
    if (on - r > width_px && behind > 2 * width_px && on < rows) {
      // Straight line through the rows before the gap; what follows is met a needle's width on.
      double n = 0.0, sum_t = 0.0, sum_x = 0.0, sum_tt = 0.0, sum_tx = 0.0;
      for (int i = r - behind; i < r; ++i) {
        const double t = i - r, x = path.cols[static_cast<size_t>(i)];
        n += 1.0, sum_t += t, sum_x += x, sum_tt += t * t, sum_tx += t * x;
      }
      const double slope = (n * sum_tx - sum_t * sum_x) / (n * sum_tt - sum_t * sum_t);
      const int met = std::min(rows - 1, on + width_px);
      const double ahead = met - r;
      const double expected = (sum_x - slope * sum_t) / n + slope * ahead;
      // An arc of ten needle lengths' radius, and as much as the slope is uncertain by.
      const double allowed = width_px + ahead * ahead / (20.0 * window_rows) + 0.5 * width_px * ahead / behind;
      if (std::abs(path.cols[static_cast<size_t>(met)] - expected) > allowed) return r;
    }
    r = on;
  }
  return rows;
}

}  // namespace

int end_of_needle(const RidgePath& path, int window_rows, int width_px, double share) {
  int rows = static_cast<int>(path.ridge.size());
  if (rows == 0) return -1;
  // Half of the evidence lies on rows at least as dark as this.
  const auto typical_in = [&](int from, int to) {
    std::vector<double> ridge(path.ridge.begin() + from, path.ridge.begin() + to);
    std::sort(ridge.begin(), ridge.end());
    double all = 0.0, sum = 0.0;
    for (const double r : ridge) all += r * r;
    for (const double r : ridge)
      if ((sum += r * r) >= 0.5 * all) return r;
    return 0.0;
  };
  double typical = typical_in(0, rows);
  rows = first_kink(path, window_rows, width_px, share * typical);
  int end = rows - 1;
  for (int turn = 0; turn < 2; ++turn) {
    double sum = 0.0;
    double best = -std::numeric_limits<double>::infinity();
    for (int r = 0; r < rows; ++r) {
      sum += std::min(path.ridge[static_cast<size_t>(r)], typical) - share * typical;
      if (sum <= best) continue;
      best = sum;
      end = r;
    }
    // Light differs along a needle: what counts is how dark it is near its end.
    typical = typical_in(std::max(0, end - window_rows), end + 1);
  }
  return end;
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
