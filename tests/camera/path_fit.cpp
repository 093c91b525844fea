// SPDX-License-Identifier: MIT
#include "tests/camera/path_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include <bevel/error.hpp>
#include <bevel/model/slip.hpp>

namespace bevel::test {
namespace {

constexpr double kWheelbase_mm = 20.0;  // inferred from Table I, as everywhere in this project
constexpr int kParameters = 5;

int free_parameters(PathModel model) {
  switch (model) {
    case PathModel::line:
      return 2;
    case PathModel::bicycle:
    case PathModel::agar:
      return 3;
    case PathModel::extended:
      return kParameters;
  }
  return 0;
}

struct Prior {
  double mean = 0.0, sd = 0.0;
};
constexpr Prior kLambda1{0.3, 0.3}, kLambda2{0.13, 0.15};

/// d aside / d depth and d tilt / d depth, (13), (15), (16).
Eigen::Vector2d slope_at(double tilt_rad, const Eigen::VectorXd& p, bool& inside) {
  const auto slip = model::evaluate_slip(std::abs(tilt_rad), p[3], p[4]);
  inside = inside && slip.in_domain;
  const double side = tilt_rad < 0.0 ? -1.0 : 1.0;
  const double gamma = side * slip.gamma_rad, alpha = side * slip.alpha_rad, f = side * slip.f;
  return {std::tan(gamma), (p[2] + f / kWheelbase_mm) * std::cos(alpha) / std::cos(gamma)};
}

}  // namespace

const char* name_of(PathModel model) {
  switch (model) {
    case PathModel::line:
      return "line";
    case PathModel::bicycle:
      return "bicycle";
    case PathModel::agar:
      return "extended, lambda of agar";
    case PathModel::extended:
      return "extended, lambda free";
  }
  return "";
}

double PathFit::aside_mm(double depth_mm) const {
  bool in_domain = true;
  Eigen::Vector2d at(p[0], p[1]);  // aside, tilt
  const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(depth_mm - first_depth_mm) / 2.0)));
  const double h = (depth_mm - first_depth_mm) / steps;
  for (int i = 0; i < steps; ++i) {  // Runge-Kutta
    const Eigen::Vector2d a = slope_at(at[1], p, in_domain), b = slope_at(at[1] + 0.5 * h * a[1], p, in_domain);
    const Eigen::Vector2d c = slope_at(at[1] + 0.5 * h * b[1], p, in_domain),
                          d = slope_at(at[1] + h * c[1], p, in_domain);
    at += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
  }
  return in_domain ? at[0] : std::nan("");
}

PathFit fit_path(const std::vector<PathTip>& tips, PathModel model) {
  const int n = free_parameters(model);
  if (static_cast<int>(tips.size()) < std::min(n, 4)) throw bevel::ArgumentError("path: fewer tips than parameters");
  PathFit fit;
  fit.model = model;
  fit.first_depth_mm = tips.front().depth_mm;
  const double run_mm = tips.back().depth_mm - tips.front().depth_mm;
  fit.p = Eigen::VectorXd::Zero(kParameters);
  fit.p[0] = tips.front().aside_mm, fit.p[1] = std::atan((tips.back().aside_mm - tips.front().aside_mm) / run_mm);
  if (model == PathModel::agar) fit.p[3] = 0.49, fit.p[4] = 0.22;
  if (model == PathModel::extended) fit.p[3] = kLambda1.mean, fit.p[4] = kLambda2.mean;
  const double step[kParameters] = {1e-4, 1e-6, 1e-8, 1e-5, 1e-5};
  const auto cost_of = [&](const PathFit& f) {
    double sum = 0.0;
    for (const PathTip& t : tips) sum += std::pow((f.aside_mm(t.depth_mm) - t.aside_mm) / t.sd_mm, 2);
    if (model == PathModel::extended)
      sum += std::pow((f.p[3] - kLambda1.mean) / kLambda1.sd, 2) + std::pow((f.p[4] - kLambda2.mean) / kLambda2.sd, 2);
    return sum;
  };
  Eigen::MatrixXd normal(n, n);
  double cost = cost_of(fit);
  for (int turn = 0; turn < 30; ++turn) {
    normal.setZero();
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    for (const PathTip& t : tips) {
      const double at = fit.aside_mm(t.depth_mm);
      Eigen::VectorXd g(n);
      for (int k = 0; k < n; ++k) {
        PathFit moved = fit;
        moved.p[k] += step[k];
        g[k] = (moved.aside_mm(t.depth_mm) - at) / step[k];
      }
      normal += g * g.transpose() / (t.sd_mm * t.sd_mm);
      right += g * (t.aside_mm - at) / (t.sd_mm * t.sd_mm);
    }
    if (model == PathModel::extended) {
      normal(3, 3) += 1.0 / (kLambda1.sd * kLambda1.sd),
          right[3] += (kLambda1.mean - fit.p[3]) / (kLambda1.sd * kLambda1.sd);
      normal(4, 4) += 1.0 / (kLambda2.sd * kLambda2.sd),
          right[4] += (kLambda2.mean - fit.p[4]) / (kLambda2.sd * kLambda2.sd);
    }
    Eigen::VectorXd change = normal.ldlt().solve(right);
    PathFit next = fit;
    double there = cost;
    for (int halved = 0; halved < 12; ++halved, change *= 0.5) {
      next = fit;
      next.p.head(n) += change;
      there = cost_of(next);
      if (there <= cost) break;  // not a number is no step
    }
    if (!(there <= cost)) break;
    const bool settled = cost - there < 1e-9 * (1.0 + cost);
    fit = next, cost = there;
    if (settled) break;
  }
  fit.sd = Eigen::VectorXd::Zero(kParameters);
  fit.sd.head(n) = normal.inverse().diagonal().cwiseMax(0.0).cwiseSqrt();
  fit.inside = std::isfinite(cost);
  return fit;
}

std::vector<double> each_left_out(const std::vector<PathTip>& tips, PathModel model) {
  std::vector<double> off_mm;
  for (size_t out = 0; out < tips.size(); ++out) {
    std::vector<PathTip> others(tips);
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(out));
    off_mm.push_back(fit_path(others, model).aside_mm(tips[out].depth_mm) - tips[out].aside_mm);
  }
  return off_mm;
}

std::vector<double> last_left_out(const std::vector<PathTip>& tips, PathModel model, int count) {
  const PathFit fit = fit_path({tips.begin(), tips.end() - count}, model);
  std::vector<double> off_mm;
  for (auto t = tips.end() - count; t != tips.end(); ++t) off_mm.push_back(fit.aside_mm(t->depth_mm) - t->aside_mm);
  return off_mm;
}

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v * v;
  return values.empty() ? std::nan("") : std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace bevel::test
