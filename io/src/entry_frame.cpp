// SPDX-License-Identifier: MIT
#include <bevel/io/entry_frame.hpp>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <bevel/error.hpp>
#include "outlier_limit.hpp"

namespace bevel::io {
namespace {

using Parameters = Eigen::Matrix<double, 8, 1>;  // origin (3), tilt (2), curvature (2), scale

struct Point {
  double depth_mm = 0;
  Eigen::Vector3d at_mm, sigma_mm;
};

std::string figure(double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// Rotation that takes {A} to the measurements' frame: a tilt about x and y, in addition to `start`.
Eigen::Quaterniond orientation(const Parameters& p, const Eigen::Quaterniond& start) {
  const Eigen::Vector3d tilt(p[3], p[4], 0);
  const double angle = tilt.norm();
  return start *
         (angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, tilt / angle)) : Eigen::Quaterniond::Identity());
}

/// Points of the arc at a depth, in {A}.
Eigen::Vector3d arc_mm(const Parameters& p, double depth_mm) {
  const Eigen::Vector2d curvature = p.segment<2>(5);
  const double k = curvature.norm(), s = p[7] * depth_mm, angle = k * s;
  // (1 - cos) / k^2 and sin / k, also for a straight path
  const double half = 0.5 * angle;
  const double sinc_half = std::abs(half) < 1e-6 ? 1 : std::sin(half) / half;
  const double along = std::abs(angle) < 1e-6 ? s : std::sin(angle) / k;
  const Eigen::Vector2d sideways = 0.5 * s * s * sinc_half * sinc_half * curvature;
  return {sideways.x(), sideways.y(), along};
}

Eigen::VectorXd residuals(const std::vector<Point>& points, const Parameters& p, const Eigen::Quaterniond& start) {
  Eigen::VectorXd out(3 * std::ssize(points));
  const Eigen::Matrix3d to_A = orientation(p, start).conjugate().toRotationMatrix();
  for (Eigen::Index i = 0; i < std::ssize(points); ++i) {
    const Point& point = points[static_cast<std::size_t>(i)];
    out.segment<3>(3 * i) =
        (to_A * (point.at_mm - p.head<3>()) - arc_mm(p, point.depth_mm)).cwiseQuotient(point.sigma_mm);
  }
  return out;
}

Eigen::MatrixXd jacobian(const std::vector<Point>& points, const Parameters& p, const Eigen::Quaterniond& start) {
  // Steps that move the tip by about 1e-4 mm at a depth of 100 mm.
  const Parameters step = (Parameters() << 1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-8, 1e-8, 1e-6).finished();
  Eigen::MatrixXd out(3 * std::ssize(points), 8);
  for (Eigen::Index i = 0; i < 8; ++i) {
    Parameters lower = p, upper = p;
    lower[i] -= step[i], upper[i] += step[i];
    out.col(i) = (residuals(points, upper, start) - residuals(points, lower, start)) / (2 * step[i]);
  }
  return out;
}

std::vector<Point> points_of(std::span<const model::ActuatorState> actuators,
                             std::span<const model::TipMeasurement> tips) {
  std::vector<Point> points;
  std::size_t next = 1;
  const model::ActuatorState& first = actuators.front();
  for (const model::TipMeasurement& tip : tips) {
    while (next + 1 < actuators.size() && actuators[next].utime < tip.utime) ++next;
    const model::ActuatorState &a = actuators[next - 1], &b = actuators[next];
    if (std::abs(b.rotation_rad - first.rotation_rad) > kTurnedSinceEntry_rad) break;
    const auto span_us = static_cast<double>(b.utime - a.utime);
    const double share = std::clamp(static_cast<double>(tip.utime - a.utime) / span_us, 0.0, 1.0);
    points.push_back({.depth_mm = a.insertion_mm + share * (b.insertion_mm - a.insertion_mm) - first.insertion_mm,
                      .at_mm = tip.position_mm,
                      .sigma_mm = tip.information_per_mm2.diagonal().cwiseInverse().cwiseSqrt()});
  }
  return points;
}

/// Start of the fit, from a parabola through the positions over the depth.
Eigen::Quaterniond start_of(const std::vector<Point>& points, Parameters& p) {
  Eigen::MatrixXd powers(std::ssize(points), 3), positions(std::ssize(points), 3);
  for (Eigen::Index i = 0; i < std::ssize(points); ++i) {
    const Point& point = points[static_cast<std::size_t>(i)];
    powers.row(i) << 1, point.depth_mm, point.depth_mm * point.depth_mm;
    positions.row(i) = point.at_mm.transpose();
  }
  const Eigen::Matrix3d fit = powers.colPivHouseholderQr().solve(positions);
  const Eigen::Vector3d along = fit.row(1).transpose();
  if (!(along.z() > 0))
    throw ParseError("the tip moves along (" + figure(along.x()) + ", " + figure(along.y()) + ", " + figure(along.z()) +
                     ") per mm of insertion by tip.axes, and the frame is from-straight-insertion. Allowed: a z "
                     "above 0. Change signs or order of tip.axes so that z leads into the tissue");
  const auto start = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), along);
  const Eigen::Vector3d bend = start.conjugate() * fit.row(2).transpose();
  p << fit.row(0).transpose(), 0, 0, 2 * bend.head<2>() / along.squaredNorm(), along.norm();
  return start;
}

/// Fits the arc by Levenberg-Marquardt, and returns the whitened residuals.
Eigen::VectorXd fit_arc(const std::vector<Point>& points, const Eigen::Quaterniond& start, Parameters& p) {
  Eigen::VectorXd residual = residuals(points, p, start);
  double damping = 1e-3;
  for (int i = 0; i < 60; ++i) {
    const Eigen::MatrixXd j = jacobian(points, p, start);
    Eigen::Matrix<double, 8, 8> normal = j.transpose() * j;
    normal.diagonal() *= 1 + damping;
    const Parameters trial = p - normal.ldlt().solve(j.transpose() * residual);
    const Eigen::VectorXd after = residuals(points, trial, start);
    if (!(after.squaredNorm() < residual.squaredNorm())) {
      if ((damping *= 10) > 1e9) break;
      continue;
    }
    const double gain = 1 - after.squaredNorm() / residual.squaredNorm();
    p = trial, residual = after, damping = std::max(damping / 10, 1e-12);
    if (gain < 1e-10) break;
  }
  return residual;
}

/// Factor of the variances of correlated residuals, (1 + r) / (1 - r) for a correlation r of successive ones.
double correlation_factor(const Eigen::VectorXd& residual) {
  double products = 0, squares = 0;
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    squares += residual[i] * residual[i];
    if (i >= 3) products += residual[i] * residual[i - 3];
  }
  const double r = std::clamp(squares > 0 ? products / squares : 0, 0.0, 0.99);
  return (1 + r) / (1 - r);
}

}  // namespace

EntryFrame fit_entry_frame(std::span<const model::ActuatorState> actuators,
                           std::span<const model::TipMeasurement> tips) {
  std::vector<Point> points = actuators.size() < 2 ? std::vector<Point>{} : points_of(actuators, tips);
  double deepest_mm = 0;
  for (const Point& point : points) deepest_mm = std::max(deepest_mm, point.depth_mm);
  constexpr std::size_t kFewestTips = 6;  // 18 coordinates for 8 parameters
  if (points.size() < kFewestTips || deepest_mm < kShortestArc_mm)
    throw ParseError("frame is from-straight-insertion, and before the base turns by " + figure(kTurnedSinceEntry_rad) +
                     " rad there are " + std::to_string(points.size()) + " tips to a depth of " + figure(deepest_mm) +
                     " mm; needed are " + std::to_string(kFewestTips) + " and " + figure(kShortestArc_mm) +
                     " mm. Give the frame as [tip.transform] instead");
  Parameters p;
  Eigen::Quaterniond start = start_of(points, p);
  Eigen::VectorXd residual = fit_arc(points, start, p);
  for (int pass = 1; pass < kOutlierPasses; ++pass) {
    const double limit = outlier_limit({residual.begin(), residual.end()}, 1);
    std::vector<Point> kept;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (residual.segment<3>(3 * static_cast<Eigen::Index>(i)).cwiseAbs().maxCoeff() <= limit)
        kept.push_back(points[i]);
    if (kept.size() == points.size() || kept.size() < kFewestTips) break;
    points = std::move(kept);
    start = start_of(points, p);
    residual = fit_arc(points, start, p);
  }
  const Eigen::MatrixXd j = jacobian(points, p, start);
  const auto freedom = static_cast<double>(residual.size() - 8);
  const Eigen::Matrix<double, 8, 8> covariance =
      (j.transpose() * j).inverse() * (residual.squaredNorm() / freedom) * correlation_factor(residual);
  EntryFrame frame;
  // The tilt's own roll about z is removed: the smallest rotation from the initial direction to z.
  frame.to_A =
      Eigen::Quaterniond::FromTwoVectors(orientation(p, start) * Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitZ());
  frame.origin_mm = p.head<3>();
  frame.direction_sd_rad = std::sqrt(covariance.diagonal().segment<2>(3).maxCoeff());
  frame.origin_sd_mm = std::sqrt(covariance.diagonal().head<3>().maxCoeff());
  frame.radius_mm = 1 / p.segment<2>(5).norm();
  frame.scale = p[7];
  frame.tips = points.size();
  double squares_mm2 = 0;
  for (Eigen::Index i = 0; i < residual.size(); ++i)
    squares_mm2 += std::pow(residual[i] * points[static_cast<std::size_t>(i / 3)].sigma_mm[i % 3], 2);
  frame.rms_mm = std::sqrt(squares_mm2 / static_cast<double>(residual.size()));
  if (!(frame.direction_sd_rad < kLargestDirectionSd_rad))
    throw ParseError("frame is from-straight-insertion, and the entry direction has a standard error of " +
                     figure(frame.direction_sd_rad) + " rad; allowed " + figure(kLargestDirectionSd_rad) +
                     " rad. Give the frame as [tip.transform] instead");
  return frame;
}

}  // namespace bevel::io
