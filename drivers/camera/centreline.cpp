#include "drivers/camera/centreline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::camera {
namespace {

constexpr int kMinRows = 8;
constexpr double kLeastVariance_px2 = 1e-6;
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

double TangentFit::slope(double row) const {
  const double t = (row - last_row) / scale_px;
  return (coefficient[1] + 2.0 * t * coefficient[2]) / scale_px;
}

double TangentFit::angle_variance_rad2(double row) const {
  const double t = (row - last_row) / scale_px;
  const cv::Vec3d g(0.0, 1.0 / scale_px, 2.0 * t / scale_px);
  double variance = g.dot(covariance * g);
  for (int i = 0; i < kBends; ++i) {
    const double true_slope = std::max(0.0, row - last_row + (i + 0.5) * bend_spacing_px);
    const double off = g.dot(by_bend[static_cast<size_t>(i)]) - true_slope;
    variance += off * off * curvature_change_per_px * curvature_change_per_px / kBends;
  }
  const double s = slope(row);
  return variance / ((1.0 + s * s) * (1.0 + s * s));
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

namespace {

TangentFit fit_tangent(const Centreline& line, const std::vector<cv::Point2d>& centres,
                       const std::vector<double>& weight, const CentrelinePriors& priors) {
  TangentFit fit;
  fit.last_row = line.last_row;
  fit.scale_px = line.scale_px;
  fit.bend_spacing_px = line.scale_px / TangentFit::kBends;
  fit.curvature_change_per_px = priors.curvature_change_per_px;
  cv::Matx33d normal = cv::Matx33d::zeros();
  cv::Vec3d right(0.0, 0.0, 0.0);
  std::array<cv::Vec3d, TangentFit::kBends> drawn;
  for (size_t i = 0; i < centres.size(); ++i) {
    const double off_px = centres[i].y - fit.last_row;
    const double t = off_px / fit.scale_px;
    const cv::Vec3d g(1.0, t, t * t);
    normal += weight[i] * (g * g.t());
    right += weight[i] * centres[i].x * g;
    for (int k = 0; k < TangentFit::kBends; ++k) {
      const double beyond_px = std::max(0.0, off_px + (k + 0.5) * fit.bend_spacing_px);
      drawn[static_cast<size_t>(k)] += 0.5 * weight[i] * beyond_px * beyond_px * g;
    }
  }
  const double variance_px2 = line.residual_px * line.residual_px * priors.tangent_correlation_px;
  const double bend_sigma_px = 0.5 * priors.curvature_sigma_per_px * fit.scale_px * fit.scale_px;
  // Residuals of exactly nothing, of a drawing, would leave no prior at all and its covariance undefined.
  normal(2, 2) += std::max(variance_px2, kLeastVariance_px2) / (bend_sigma_px * bend_sigma_px);
  const cv::Matx33d inverse = normal.inv(cv::DECOMP_CHOLESKY);
  fit.coefficient = inverse * right;
  fit.covariance = inverse * std::max(variance_px2, kLeastVariance_px2);
  for (size_t k = 0; k < drawn.size(); ++k) fit.by_bend[k] = inverse * drawn[k];
  return fit;
}

}  // namespace

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
  fit.tangent = fit_tangent(fit, centres, weight, priors);
  return fit;
}

double darkness_across(const cv::Mat& patch, const cv::Point2d& p, double slope, const RidgeScale& scale) {
  const double length = std::hypot(1.0, slope);
  const cv::Point2d normal(1.0 / length, -slope / length);
  const auto mean = [&](double middle, int half) {
    double sum = 0.0;
    for (int i = -half; i <= half; ++i) {
      const cv::Point2d at = p + (middle + i) * normal;
      sum += bilinear(patch, at.x, at.y);
    }
    return sum / (2 * half + 1);
  };
  const double sides = 0.5 * (mean(-scale.offset_px, 1) + mean(scale.offset_px, 1));
  return sides - mean(0.0, scale.core_px / 2 + 1);
}

double blur_across_px(const cv::Mat& patch, const Centreline& line, int first_row, int last_row,
                      double needle_width_px) {
  constexpr double tail_share = 0.1;  // of the peak: below it is background
  const int reach = static_cast<int>(std::ceil(3.0 * needle_width_px)) + 4;
  const auto at = [reach](int i) {
    const int shifted = reach + i;
    return static_cast<size_t>(shifted);
  };
  std::vector<double> mean(at(reach) + 1, 0.0);
  double cosine = 1.0;
  int rows = 0;
  for (int r = std::max(0, first_row); r <= last_row; ++r, ++rows) {
    const double middle = line.col(r);
    for (int i = -reach; i <= reach; ++i) mean[at(i)] += bilinear(patch, middle + i, r);
    cosine = 1.0 / std::hypot(1.0, line.slope(r));
  }
  if (rows == 0) return 0.0;
  for (double& m : mean) m /= rows;
  std::vector<double> copy = mean;
  const auto bright = copy.begin() + static_cast<std::ptrdiff_t>(copy.size() * 3 / 4);
  std::nth_element(copy.begin(), bright, copy.end());
  const double background = *bright;
  const double peak = background - mean[at(0)];
  if (peak <= 0.0) return 0.0;
  double weight = peak;
  double second = 0.0;
  for (const int side : {-1, 1}) {
    for (int i = 1; i <= reach; ++i) {
      const double dark = background - mean[at(side * i)];
      if (dark < tail_share * peak) break;  // what lies beyond a bright gap is another line
      weight += dark;
      second += dark * i * i;
    }
  }
  const double variance_px2 = second / weight * cosine * cosine - needle_width_px * needle_width_px / 12.0;
  return std::sqrt(std::max(0.0, variance_px2));
}

}  // namespace bevel::camera
