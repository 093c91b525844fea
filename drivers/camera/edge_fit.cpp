#include "drivers/camera/edge_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

namespace bevel::camera {
namespace {

enum Parameter { tip, height, base, log_blur, log_taper };
constexpr int kParameters = 5;
using Vector = cv::Vec<double, kParameters>;
using Matrix = cv::Matx<double, kParameters, kParameters>;

double gauss(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi); }
double step(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

struct Value {
  double model;
  Vector gradient;
};

Value evaluate(const Vector& p, double s) {
  const double blur = std::exp(p[log_blur]);
  const double taper = std::exp(p[log_taper]);
  const double z1 = (p[tip] - s) / blur;
  const double z0 = (p[tip] - taper - s) / blur;
  const double ramp = blur * (z1 * step(z1) + gauss(z1) - z0 * step(z0) - gauss(z0)) / taper;
  const double d_tip = (step(z1) - step(z0)) / taper;
  const double d_blur = (gauss(z1) - gauss(z0)) / taper;
  const double d_log_taper = step(z0) - ramp;  // d/d taper of [R(tip - s) - R(tip - taper - s)] / taper, times taper
  return {p[base] + p[height] * ramp,
          {p[height] * d_tip, ramp, 1.0, p[height] * d_blur * blur, p[height] * d_log_taper}};
}

/// Gaussian prior on one parameter, in gray levels: a deviation of one sigma costs as much as kTypical_gray in one row.
struct Prior {
  Vector mean;
  Vector weight;
};

constexpr double kTypical_gray = 2.0;

Prior prior_from(const EdgeGuess& guess, double correlation_px) {
  const double sigma_height = 0.15 * std::max(1.0, std::abs(guess.height));
  constexpr double sigma_base = 3.0;
  constexpr double sigma_log_blur = 0.2;
  constexpr double sigma_log_taper = 0.4;
  const double unit = kTypical_gray * kTypical_gray * correlation_px;
  const auto weight = [unit](double sigma) { return unit / (sigma * sigma); };
  Prior prior;
  prior.mean = Vector(0.0, guess.height, 0.0, std::log(guess.blur_px), std::log(guess.taper_px));
  prior.weight = Vector(0.0, weight(sigma_height), weight(sigma_base), weight(sigma_log_blur), weight(sigma_log_taper));
  return prior;
}

struct System {
  Matrix normal = Matrix::zeros();
  Vector right{};
  double cost = 0.0;
  double weight_sum = 0.0;
  double squares = 0.0;
};

System assemble(std::span<const double> s, std::span<const double> profile, const Vector& p, double huber,
                const Prior& prior) {
  System system;
  for (int k = 0; k < kParameters; ++k) {
    const double off = prior.mean[k] - p[k];
    system.normal(k, k) += prior.weight[k];
    system.right[k] += prior.weight[k] * off;
    system.cost += 0.5 * prior.weight[k] * off * off;
  }
  for (size_t i = 0; i < s.size(); ++i) {
    const Value v = evaluate(p, s[i]);
    const double r = profile[i] - v.model;
    const double size = std::abs(r);
    const double w = size <= huber ? 1.0 : huber / size;
    system.normal += w * (v.gradient * v.gradient.t());
    system.right += w * r * v.gradient;
    system.cost += size <= huber ? 0.5 * r * r : huber * (size - 0.5 * huber);
    system.weight_sum += w;
    system.squares += w * r * r;
  }
  return system;
}

double huber_width(std::span<const double> s, std::span<const double> profile, const Vector& p) {
  std::vector<double> size(s.size());
  for (size_t i = 0; i < s.size(); ++i) size[i] = std::abs(profile[i] - evaluate(p, s[i]).model);
  const auto middle = size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2);
  std::nth_element(size.begin(), middle, size.end());
  return std::max(0.5, 1.345 * 1.4826 * *middle);
}

}  // namespace

EdgeFit fit_edge(std::span<const double> s, std::span<const double> profile, const EdgeGuess& guess,
                 double correlation_px) {
  EdgeFit fit;
  if (s.size() < 8 || s.size() != profile.size()) return fit;
  EdgeGuess start = guess;
  start.taper_px = std::max(guess.taper_px, 0.05);  // the limit of a blunt end, without a second formula
  start.blur_px = std::max(guess.blur_px, 0.3);
  const Prior prior = prior_from(start, correlation_px);
  Vector p = prior.mean;
  p[tip] = start.tip_px;

  double damping = 1e-3;
  double huber = 1e9;  // the first rounds find the edge, then outliers are recognised
  for (int turn = 0; turn < 40; ++turn) {
    if (turn == 8 || turn == 16) huber = huber_width(s, profile, p);
    const System here = assemble(s, profile, p, huber, prior);
    Matrix damped = here.normal;
    for (int k = 0; k < kParameters; ++k) damped(k, k) *= 1.0 + damping;
    for (int k = 0; k < kParameters; ++k) damped(k, k) += 1e-9;
    const Vector change = damped.inv(cv::DECOMP_CHOLESKY) * here.right;
    Vector next = p + change;
    for (const int k : {log_blur, log_taper}) next[k] = std::clamp(next[k], std::log(0.05), std::log(100.0));
    next[tip] = std::clamp(next[tip], s.front(), s.back());
    const System there = assemble(s, profile, next, huber, prior);
    if (there.cost <= here.cost) {
      const double moved = std::abs(next[tip] - p[tip]) + std::abs(next[log_blur] - p[log_blur]);
      p = next;
      damping = std::max(1e-7, damping * 0.2);
      if (moved < 1e-4 && turn > 16) break;
    } else {
      damping = std::min(1e7, damping * 8.0);
    }
  }
  System end = assemble(s, profile, p, huber, prior);
  for (int k = 0; k < kParameters; ++k) end.normal(k, k) += 1e-9;
  const double variance = end.squares / std::max(1.0, end.weight_sum - kParameters);
  const double tip_variance = end.normal.inv(cv::DECOMP_CHOLESKY)(tip, tip) * variance * correlation_px;
  fit.tip_px = p[tip];
  fit.tip_variance_px2 = tip_variance;
  fit.height = p[height];
  fit.base = p[base];
  fit.taper_px = std::exp(p[log_taper]);
  fit.blur_px = std::exp(p[log_blur]);
  fit.residual = std::sqrt(variance);
  const bool inside = p[tip] > s.front() + 1.0 && p[tip] < s.back() - 1.0;
  fit.converged = inside && p[height] > 0.0 && std::isfinite(tip_variance) && tip_variance > 0.0;
  return fit;
}

}  // namespace bevel::camera
