// SPDX-License-Identifier: MIT
#include <bevel/io/base_lag.hpp>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "outlier_limit.hpp"

namespace bevel::io {
namespace {

constexpr std::size_t kParts = 10;
constexpr std::size_t kFewestTips = 40;  // four in each part
constexpr std::size_t kMostTips = 4000;  // more of one insertion are correlated and add time, not information
constexpr double kShortest_s = 4;
constexpr int kSteps = 40;  // of the first search, to either side

struct Point {
  std::int64_t utime = 0;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  double path_mm = 0;
};

/// Removes the points whose residual is an outlier. Returns whether there were any.
bool remove_outliers(std::vector<Point>& points, const Eigen::VectorXd& residual_mm, double sigma_mm) {
  const double limit_mm = outlier_limit({residual_mm.begin(), residual_mm.end()}, sigma_mm);
  std::vector<Point> kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (std::abs(residual_mm[static_cast<Eigen::Index>(i)]) <= limit_mm) kept.push_back(points[i]);
  if (kept.size() == points.size() || kept.size() < kFewestTips) return false;
  points = std::move(kept);
  return true;
}

/// Sets the path length of each point: along the curve x(z), y(z), two cubic polynomials. Noise sideways does not add
/// to it. Returns the distance (mm) of each point from the curve.
Eigen::VectorXd measure_path(std::vector<Point>& points) {
  const auto [low, high] = std::ranges::minmax(points, {}, [](const Point& p) { return p.at_mm.z(); });
  const double from_mm = low.at_mm.z(), length_mm = std::max(high.at_mm.z() - from_mm, 1e-9);
  Eigen::MatrixXd powers(std::ssize(points), 4), sideways(std::ssize(points), 2);
  for (Eigen::Index i = 0; i < std::ssize(points); ++i) {
    const Eigen::Vector3d& at_mm = points[static_cast<std::size_t>(i)].at_mm;
    const double u = (at_mm.z() - from_mm) / length_mm;
    powers.row(i) << 1, u, u * u, u * u * u;
    sideways.row(i) = at_mm.head<2>().transpose();
  }
  const Eigen::MatrixXd curve = powers.completeOrthogonalDecomposition().solve(sideways);
  constexpr std::size_t kPieces = 200;  // trapezoids; error below 1e-4 of a path that turns by 1 rad
  std::array<double, kPieces + 1> length;
  length[0] = 0;
  const auto slope = [&](double u) {
    const Eigen::RowVectorXd s = (curve.row(1) + 2 * u * curve.row(2) + 3 * u * u * curve.row(3)) / length_mm;
    return std::sqrt(1 + s.squaredNorm());
  };
  const double piece_mm = length_mm / kPieces;
  for (std::size_t i = 0; i < kPieces; ++i)
    length[i + 1] =
        length[i] +
        0.5 * piece_mm * (slope(static_cast<double>(i) / kPieces) + slope(static_cast<double>(i + 1) / kPieces));
  for (Point& point : points) {
    const double at = (point.at_mm.z() - from_mm) / piece_mm;
    const auto i = std::min(static_cast<std::size_t>(at), kPieces - 1);
    point.path_mm = length[i] + (at - static_cast<double>(i)) * (length[i + 1] - length[i]);
  }
  return (sideways - powers * curve).rowwise().norm();
}

/// Sums of squares of path length and depth, so that a part can be left out by subtraction.
struct Sums {
  Eigen::Matrix2d ata = Eigen::Matrix2d::Zero();
  Eigen::Vector2d atb = Eigen::Vector2d::Zero();
  double btb = 0;
  Sums& operator+=(const Sums& s) { return ata += s.ata, atb += s.atb, btb += s.btb, *this; }
  Sums& operator-=(const Sums& s) { return ata -= s.ata, atb -= s.atb, btb -= s.btb, *this; }
  double residual2() const { return btb - atb.dot(ata.completeOrthogonalDecomposition().solve(atb)); }
};

class Fit {
 public:
  Fit(std::span<const model::ActuatorState> actuators, std::vector<Point> points)
      : actuators_(actuators), points_(std::move(points)) {
    const auto [low, high] = std::ranges::minmax(actuators, {}, &model::ActuatorState::insertion_mm);
    middle_mm_ = 0.5 * (low.insertion_mm + high.insertion_mm);
    half_mm_ = std::max(0.5 * (high.insertion_mm - low.insertion_mm), 1e-9);
    for (const Point& point : points_) mean_mm_ += point.path_mm / static_cast<double>(points_.size());
  }

  std::size_t size() const { return points_.size(); }

  /// Scaled depth of each point at a lag.
  Eigen::VectorXd depths(double lag_s) const {
    Eigen::VectorXd out(std::ssize(points_));
    const std::int64_t lag_us = std::llround(lag_s * 1e6);
    std::size_t next = 1;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const std::int64_t utime = points_[i].utime + lag_us;
      while (next + 1 < actuators_.size() && actuators_[next].utime < utime) ++next;
      const model::ActuatorState &a = actuators_[next - 1], &b = actuators_[next];
      const double share = static_cast<double>(utime - a.utime) / static_cast<double>(b.utime - a.utime);
      out[static_cast<Eigen::Index>(i)] =
          (a.insertion_mm + share * (b.insertion_mm - a.insertion_mm) - middle_mm_) / half_mm_;
    }
    return out;
  }

  /// Standard error (s) for residuals that are independent: infinite if the rate of insertion is constant, when a lag
  /// and the zero of the depth have the same effect.
  /// @param sd_mm  standard deviation of the path length
  double independent_sd_s(double lag_s, double step_s, double sd_mm) const {
    const Eigen::VectorXd x = depths(lag_s);
    const Eigen::VectorXd rate = (depths(lag_s + step_s) - depths(lag_s - step_s)) / (2 * step_s);
    Eigen::MatrixXd line(x.size(), 2);
    line << Eigen::VectorXd::Ones(x.size()), x;
    const Eigen::VectorXd varying = rate - line * line.colPivHouseholderQr().solve(rate);
    // Path length per unit of depth is close to 1.
    return sd_mm / (half_mm_ * varying.norm());
  }

  /// Sums of each part of the recording at a lag.
  std::array<Sums, kParts> at(double lag_s) const {
    std::array<Sums, kParts> parts;
    const Eigen::VectorXd depth = depths(lag_s);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double x = depth[static_cast<Eigen::Index>(i)];
      const Eigen::Vector2d powers(1, x);
      const double path_mm = points_[i].path_mm - mean_mm_;
      Sums& part = parts[i * kParts / points_.size()];
      part.ata += powers * powers.transpose();
      part.atb += path_mm * powers;
      part.btb += path_mm * path_mm;
    }
    return parts;
  }

  /// Sum of squared residuals, without one part (kParts: with all of them).
  double residual2(double lag_s, std::size_t without) const {
    Sums sum;
    const auto parts = at(lag_s);
    for (std::size_t i = 0; i < kParts; ++i)
      if (i != without) sum += parts[i];
    return sum.residual2();
  }

  /// Residual of each point.
  Eigen::VectorXd residuals_mm(double lag_s) const {
    Eigen::MatrixXd line(std::ssize(points_), 2);
    Eigen::VectorXd path_mm(std::ssize(points_));
    line << Eigen::VectorXd::Ones(line.rows()), depths(lag_s);
    for (Eigen::Index i = 0; i < path_mm.size(); ++i) path_mm[i] = points_[static_cast<std::size_t>(i)].path_mm;
    return path_mm - line * line.colPivHouseholderQr().solve(path_mm);
  }

  /// Minimum between `low_s` and `high_s` by golden-section search.
  double minimum(double low_s, double high_s, std::size_t without) const {
    const double ratio = (std::sqrt(5.0) - 1) / 2;
    double a_s = high_s - ratio * (high_s - low_s), b_s = low_s + ratio * (high_s - low_s);
    double at_a = residual2(a_s, without), at_b = residual2(b_s, without);
    for (int i = 0; i < 25; ++i) {
      if (at_a < at_b) {
        high_s = b_s, b_s = a_s, at_b = at_a;
        a_s = high_s - ratio * (high_s - low_s);
        at_a = residual2(a_s, without);
      } else {
        low_s = a_s, a_s = b_s, at_a = at_b;
        b_s = low_s + ratio * (high_s - low_s);
        at_b = residual2(b_s, without);
      }
    }
    return 0.5 * (low_s + high_s);
  }

 private:
  std::span<const model::ActuatorState> actuators_;
  std::vector<Point> points_;
  double middle_mm_ = 0, half_mm_ = 1, mean_mm_ = 0;
};

/// @param sigma_mm  smallest standard deviation of the path length
BaseLag lag_of(const Fit& fit, double range_s, double sigma_mm) {
  // One pass over the range for all, and for all but each part.
  const double step_s = range_s / kSteps;
  std::array<double, kParts + 1> lowest, best_s{};
  lowest.fill(std::numeric_limits<double>::infinity());
  std::array<double, 2 * kSteps + 1> of_all;
  for (int k = -kSteps; k <= kSteps; ++k) {
    const auto parts = fit.at(k * step_s);
    Sums all;
    for (const Sums& part : parts) all += part;
    of_all[static_cast<std::size_t>(k + kSteps)] = all.residual2();
    for (std::size_t without = 0; without <= kParts; ++without) {
      Sums sum = all;
      if (without < kParts) sum -= parts[without];
      const double residual2 = sum.residual2();
      if (residual2 < lowest[without]) lowest[without] = residual2, best_s[without] = k * step_s;
    }
  }
  BaseLag lag;
  lag.determined = std::abs(best_s[kParts]) < range_s - 0.5 * step_s;
  for (std::size_t without = 0; without <= kParts; ++without)
    best_s[without] = fit.minimum(best_s[without] - step_s, best_s[without] + step_s, without);
  lag.lag_s = best_s[kParts];
  lag.rms_mm = std::sqrt(std::max(0.0, fit.residual2(lag.lag_s, kParts)) / static_cast<double>(fit.size()));
  double mean_s = 0, squares = 0;
  for (std::size_t i = 0; i < kParts; ++i) mean_s += best_s[i] / kParts;
  for (std::size_t i = 0; i < kParts; ++i) squares += (best_s[i] - mean_s) * (best_s[i] - mean_s);
  // Successive residuals are correlated where the tip does not follow a line: with a correlation r they count as a
  // share of (1 - r) / (1 + r).
  const Eigen::VectorXd residual_mm = fit.residuals_mm(lag.lag_s);
  const auto pairs = residual_mm.size() - 1;
  const double r = std::clamp(
      residual_mm.head(pairs).dot(residual_mm.tail(pairs)) / std::max(residual_mm.squaredNorm(), 1e-12), 0.0, 0.99);
  const double correlated = (1 + r) / (1 - r);
  // Lags that fit as well, within two standard deviations. A rate that is constant but for its beginning and its end
  // has a range of such lags.
  const double as_good = lowest[kParts] * (1 + 4 * correlated / static_cast<double>(fit.size()));
  const auto is_as_good = [&](double residual2) { return residual2 <= as_good; };
  const auto first = std::ranges::find_if(of_all, is_as_good);
  const auto last = std::find_if(of_all.rbegin(), of_all.rend(), is_as_good).base();  // one behind
  const double width_s = step_s * static_cast<double>(last - first - 1);
  lag.sd_s =
      std::max({std::sqrt(squares * (kParts - 1) / kParts), width_s / 4,
                std::sqrt(correlated) * fit.independent_sd_s(lag.lag_s, step_s, std::max(lag.rms_mm, sigma_mm))});
  lag.determined = lag.determined && lag.sd_s < kLargestLagSd_s;
  return lag;
}

}  // namespace

bool BaseLag::significant() const { return determined && std::abs(lag_s) > 3 * sd_s; }

std::optional<BaseLag> estimate_base_lag(std::span<const model::ActuatorState> actuators,
                                         std::span<const model::TipMeasurement> tips) {
  if (actuators.size() < 2) return std::nullopt;
  const double length_s = static_cast<double>(actuators.back().utime - actuators.front().utime) * 1e-6;
  if (length_s < kShortest_s) return std::nullopt;
  const double range_s = std::min(kLargestLag_s, length_s / 8);
  const std::int64_t range_us = std::llround(range_s * 1e6);
  std::vector<Point> points;  // the same ones at every lag
  double sigma_mm = 0;        // the largest of z
  for (const model::TipMeasurement& tip : tips)
    if (tip.information_per_mm2(2, 2) > 0 && tip.utime >= actuators.front().utime + range_us &&
        tip.utime <= actuators.back().utime - range_us) {
      points.push_back({.utime = tip.utime, .at_mm = tip.position_mm});
      sigma_mm = std::max(sigma_mm, 1 / std::sqrt(tip.information_per_mm2(2, 2)));
    }
  if (points.size() < kFewestTips) return std::nullopt;
  if (const std::size_t every = points.size() / kMostTips + 1; every > 1) {
    std::vector<Point> fewer;
    for (std::size_t i = 0; i < points.size(); i += every) fewer.push_back(points[i]);
    points = std::move(fewer);
  }
  BaseLag lag;
  for (int pass = 0; pass < kOutlierPasses; ++pass) {
    if (remove_outliers(points, measure_path(points), sigma_mm)) measure_path(points);
    const Fit fit(actuators, points);
    lag = lag_of(fit, range_s, sigma_mm);
    if (!remove_outliers(points, fit.residuals_mm(lag.lag_s), sigma_mm)) break;
  }
  return lag;
}

}  // namespace bevel::io
