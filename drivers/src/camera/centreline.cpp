// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/centreline.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace bevel::camera {
namespace {

constexpr int kMinRows = 8;
constexpr double kTukey = 4.685;  // 95 % efficient for Gaussian residuals

double bilinear(const cv::Mat& m, double x, double y) {
  x = std::clamp(x, 0.0, m.cols - 1.001);
  y = std::clamp(y, 0.0, m.rows - 1.001);
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const double fx = x - x0;
  const double fy = y - y0;
  const uchar* a = m.ptr<uchar>(y0) + x0;
  const uchar* b = m.ptr<uchar>(y0 + 1) + x0;
  return (1.0 - fy) * ((1.0 - fx) * a[0] + fx * a[1]) + fy * ((1.0 - fx) * b[0] + fx * b[1]);
}

constexpr int kSideHalf_px = 2;
constexpr int kNextSide_px = 2 * kSideHalf_px + 1;  // to the middle of the farther window

/// What the needle is seen against: on each side two windows of five pixels beside each other.
struct Beside {
  std::array<double, 2> left_gray{}, right_gray{};  // nearer, farther
};
template <class GrayAt>
Beside beside(const GrayAt& gray_at, int side_px) {
  const auto mean_about = [&](int middle) {
    double sum = 0.0;
    for (int k = -kSideHalf_px; k <= kSideHalf_px; ++k) sum += gray_at(middle + k);
    return sum / (2 * kSideHalf_px + 1);
  };
  return {{mean_about(-side_px), mean_about(-side_px - kNextSide_px)},
          {mean_about(side_px), mean_about(side_px + kNextSide_px)}};
}

/// The background under the needle: the straight line between the lighter window of each side by `typical`. What is
/// printed on the paper or was drawn through the gel is darker than both, and seldom as wide as two windows.
struct Background {
  double middle_gray = 0.0, gray_per_px = 0.0;
};
Background background(const Beside& here, const Beside& typical, int side_px) {
  const size_t l = typical.left_gray[1] > typical.left_gray[0] ? 1 : 0;
  const size_t r = typical.right_gray[1] > typical.right_gray[0] ? 1 : 0;
  const double left_px = -side_px - kNextSide_px * static_cast<double>(l),
               right_px = side_px + kNextSide_px * static_cast<double>(r);
  const double slope = (here.right_gray[r] - here.left_gray[l]) / (right_px - left_px);
  return {here.left_gray[l] - slope * left_px, slope};
}

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

double centre_in_row(const cv::Mat& patch, int row, double near_col, const RidgeScale& scale) {
  constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
  const uchar* line = patch.ptr<uchar>(row);
  const auto mean_about = [&](int x) { return (line[x - 1] + line[x] + line[x + 1]) / 3.0; };
  const int reach = scale.offset_px - 1;
  double centre = near_col;
  for (int turn = 0; turn < 2; ++turn) {
    const int x = cvRound(centre);
    if (x - scale.offset_px - 1 < 0 || x + scale.offset_px + 1 >= patch.cols) return nothing;
    const double left = mean_about(x - scale.offset_px);
    const double right = mean_about(x + scale.offset_px);
    double weight = 0.0;
    double moment = 0.0;
    for (int i = -reach; i <= reach; ++i) {
      const double share = 0.5 + 0.5 * i / scale.offset_px;
      const double dark = (1.0 - share) * left + share * right - line[x + i];
      if (dark <= 0.0) continue;
      weight += dark;
      moment += dark * i;
    }
    if (weight <= 0.0) return nothing;
    centre = x + moment / weight;
  }
  return centre;
}

double Centreline::col(double row) const {
  const double t = (row - last_row) / scale_px;
  return coefficient[0] + t * (coefficient[1] + t * coefficient[2]);
}

double Centreline::slope(double row) const {
  const double t = (row - last_row) / scale_px;
  return (coefficient[1] + 2.0 * t * coefficient[2]) / scale_px;
}

double Centreline::variance_px2(double row) const {
  const double t = (row - last_row) / scale_px;
  const cv::Vec3d g(1.0, t, t * t);
  return g.dot(covariance * g);
}

cv::Point2d Centreline::along(double row, double arc_px) const {
  // Midpoint steps of at most two pixels; the curve turns by far less than a degree in one.
  const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(arc_px) / 2.0)));
  const double step = arc_px / steps;
  for (int i = 0; i < steps; ++i) {
    const double half = 0.5 * step / std::hypot(1.0, slope(row));
    row += step / std::hypot(1.0, slope(row + half));
  }
  return {col(row), row};
}

Centreline fit_centreline(const std::vector<cv::Point2d>& centres, const CentrelinePriors& priors) {
  Centreline fit;
  if (centres.size() < kMinRows) return fit;
  fit.last_row = centres.back().y;
  fit.scale_px = std::max(1.0, fit.last_row - centres.front().y);
  constexpr double typical_residual_px = 0.3;
  const double bend_sigma_px = 0.5 * priors.curvature_sigma_per_px * fit.scale_px * fit.scale_px;
  const double prior_weight =
      typical_residual_px * typical_residual_px * priors.correlation_px / (bend_sigma_px * bend_sigma_px);
  std::vector<double> weight(centres.size(), 1.0);
  std::vector<double> residual(centres.size());
  cv::Matx33d inverse = cv::Matx33d::eye();
  double weight_sum = 0.0;
  for (int turn = 0; turn < 6; ++turn) {
    cv::Matx33d normal = cv::Matx33d::zeros();
    cv::Vec3d right(0.0, 0.0, 0.0);
    for (size_t i = 0; i < centres.size(); ++i) {
      const double t = (centres[i].y - fit.last_row) / fit.scale_px;
      const cv::Vec3d g(1.0, t, t * t);
      normal += weight[i] * (g * g.t());
      right += weight[i] * centres[i].x * g;
    }
    normal(2, 2) += prior_weight;
    inverse = normal.inv(cv::DECOMP_CHOLESKY);
    fit.coefficient = inverse * right;
    std::vector<double> magnitude(centres.size());
    for (size_t i = 0; i < centres.size(); ++i) {
      residual[i] = centres[i].x - fit.col(centres[i].y);
      magnitude[i] = std::abs(residual[i]);
    }
    const double spread = std::max(1.4826 * median_of(magnitude), 0.02);
    weight_sum = 0.0;
    for (size_t i = 0; i < centres.size(); ++i) {
      const double z = residual[i] / (kTukey * spread);
      weight[i] = std::abs(z) < 1.0 ? (1.0 - z * z) * (1.0 - z * z) : 0.0;
      weight_sum += weight[i];
    }
  }
  if (weight_sum < kMinRows) return Centreline{};
  double squares = 0.0;
  for (size_t i = 0; i < centres.size(); ++i) squares += weight[i] * residual[i] * residual[i];
  const double variance = squares / std::max(1.0, weight_sum - 3.0);
  fit.residual_px = std::sqrt(variance);
  fit.covariance = inverse * (variance * priors.correlation_px);
  fit.rows_used = static_cast<int>(weight_sum);
  return fit;
}

EndProfile profile_along(const cv::Mat& patch, const Centreline& line, double row, int from_px, int to_px, int reach_px,
                         const RidgeScale& scale) {
  const int side = scale.offset_px + 1;
  const double margin = side + kNextSide_px + kSideHalf_px + 1.0;
  EndProfile profile;
  std::vector<Beside> sides;
  cv::Point2d p = line.along(row, from_px);
  for (int i = from_px; i <= to_px; ++i, p = line.along(p.y, 1.0)) {
    const bool inside = p.y >= 0.0 && p.y <= patch.rows - 1.0 && p.x >= margin && p.x <= patch.cols - 1.0 - margin;
    if (!inside) {
      if (sides.empty()) continue;
      break;
    }
    const double slope = line.slope(p.y);
    const double length = std::hypot(1.0, slope);
    const cv::Point2d right(1.0 / length, -slope / length);
    const auto gray_at = [&](double off) { return bilinear(patch, p.x + off * right.x, p.y + off * right.y); };
    double dark = 0.0, moment = 0.0, spread = 0.0;
    for (int k = -reach_px; k <= reach_px; ++k) {
      const double gray = gray_at(k);
      dark -= gray, moment -= gray * k, spread -= gray * spread_weight(k, reach_px + 0.5);
    }
    if (sides.empty()) profile.first_s_px = i;
    profile.dark.push_back(dark), profile.moment.push_back(moment), profile.spread.push_back(spread);
    sides.push_back(beside(gray_at, side));
  }
  double weights = 0.0, squares = 0.0, spreads = 0.0;
  for (int k = -reach_px; k <= reach_px; ++k)
    weights += 1.0, squares += k * k, spreads += spread_weight(k, reach_px + 0.5);
  // Which window is the lighter is told by a needle's width of rows: by one alone it would be the noisier one.
  const auto count = static_cast<int>(sides.size());
  const int half = std::max(1, scale.core_px / 2);
  for (int i = 0; i < count; ++i) {
    Beside typical;
    for (int j = std::max(0, i - half); j <= std::min(count - 1, i + half); ++j)
      for (size_t n = 0; n < 2; ++n) {
        typical.left_gray[n] += sides[static_cast<size_t>(j)].left_gray[n];
        typical.right_gray[n] += sides[static_cast<size_t>(j)].right_gray[n];
      }
    const auto at = static_cast<size_t>(i);
    const Background under = background(sides[at], typical, side);
    profile.dark[at] += weights * under.middle_gray;
    profile.moment[at] += squares * under.gray_per_px;
    profile.spread[at] += spreads * under.middle_gray;
    profile.beside.push_back(under.middle_gray);
  }
  return profile;
}

std::vector<double> mean_dark_across(const cv::Mat& patch, const Centreline& line, double row, double from_px,
                                     double to_px, double across_px, int reach_px, const RidgeScale& scale) {
  const int side = scale.offset_px + 1;
  const int rows = std::max(1, cvRound(to_px - from_px));
  const int furthest = std::max(reach_px, side + 3 * kSideHalf_px + 1);
  std::vector<double> gray(static_cast<size_t>(2 * furthest + 1), 0.0);
  double* const middle = gray.data() + furthest;
  for (int i = 0; i < rows; ++i) {
    const cv::Point2d p = line.along(row, from_px + (i + 0.5) * (to_px - from_px) / rows);
    const double slope = line.slope(p.y);
    const double length = std::hypot(1.0, slope);
    for (int k = -furthest; k <= furthest; ++k) {
      const double off = (across_px + k) / length;
      middle[k] += bilinear(patch, p.x + off, p.y - off * slope) / rows;
    }
  }
  const auto gray_at = [&](int k) { return middle[k]; };
  const Beside sides = beside(gray_at, side);
  const Background under = background(sides, sides, side);
  std::vector<double> dark;
  for (int k = -reach_px; k <= reach_px; ++k) dark.push_back(under.middle_gray + under.gray_per_px * k - gray_at(k));
  return dark;
}

namespace {

/// Robust sum of squares of mean[i] - (height * bar(i) + base + tilt * i), with the bar blurred by `blur_px`; i from
/// -reach.
double misfit(const std::vector<double>& mean, int reach, double half_width_px, double blur_px) {
  const auto step = [blur_px](double x) { return 0.5 * std::erfc(-x / (blur_px * std::numbers::sqrt2)); };
  std::vector<cv::Vec3d> shape(mean.size());
  for (size_t i = 0; i < mean.size(); ++i) {
    const double x = static_cast<double>(i) - reach;
    shape[i] = {step(x + half_width_px) - step(x - half_width_px), 1.0, x / reach};
  }
  std::vector<double> weight(mean.size(), 1.0);
  std::vector<double> size(mean.size());
  double cost = 0.0;
  for (int turn = 0; turn < 3; ++turn) {
    cv::Matx33d normal = cv::Matx33d::eye() * 1e-9;
    cv::Vec3d right(0.0, 0.0, 0.0);
    for (size_t i = 0; i < mean.size(); ++i) {
      normal += weight[i] * (shape[i] * shape[i].t());
      right += weight[i] * mean[i] * shape[i];
    }
    const cv::Vec3d solved = normal.inv(cv::DECOMP_CHOLESKY) * right;
    for (size_t i = 0; i < mean.size(); ++i) size[i] = std::abs(mean[i] - solved.dot(shape[i]));
    // What lies beside the needle (a track, a printed line) is no part of its profile.
    constexpr double typical_gray = 2.0;
    cost = 0.0;
    for (size_t i = 0; i < mean.size(); ++i) {
      const double z = size[i] / typical_gray;
      weight[i] = 1.0 / (1.0 + z * z);
      cost += std::log1p(z * z);
    }
  }
  return cost;
}

}  // namespace

double blur_across_px(const cv::Mat& patch, const Centreline& line, int first_row, int last_row,
                      double needle_width_px) {
  const int reach = static_cast<int>(std::ceil(1.6 * needle_width_px)) + 4;
  std::vector<double> mean(static_cast<size_t>(2 * reach + 1), 0.0);
  double cosine = 1.0;
  int rows = 0;
  for (int r = std::max(0, first_row); r <= last_row; ++r, ++rows) {
    const double middle = line.col(r);
    for (size_t i = 0; i < mean.size(); ++i) mean[i] += bilinear(patch, middle + static_cast<double>(i) - reach, r);
    cosine = 1.0 / std::hypot(1.0, line.slope(r));
  }
  if (rows == 0) return 0.0;
  for (double& m : mean) m /= rows;
  const double half_width_px = 0.5 * needle_width_px / cosine;  // in a row
  constexpr int tries = 13;
  constexpr double first_px = 0.35;
  const double ratio = std::pow(std::max(1.0, 1.5 * needle_width_px) / first_px, 1.0 / (tries - 1));
  std::array<double, tries> cost{};
  for (size_t k = 0; k < tries; ++k)
    cost[k] = misfit(mean, reach, half_width_px, first_px * std::pow(ratio, static_cast<double>(k)));
  const auto best = static_cast<size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
  double place = static_cast<double>(best);
  if (best > 0 && best + 1 < tries) {
    const double bend = cost[best - 1] - 2.0 * cost[best] + cost[best + 1];
    if (bend > 0.0) place += std::clamp(0.5 * (cost[best - 1] - cost[best + 1]) / bend, -0.5, 0.5);
  }
  return cosine * first_px * std::pow(ratio, place);
}

}  // namespace bevel::camera
