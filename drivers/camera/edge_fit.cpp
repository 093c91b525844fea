#include "drivers/camera/edge_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

namespace bevel::camera {
namespace {

enum Parameter { tip, height, base, log_blur, log_taper, rest };
constexpr int kParameters = 6;
using Vector = cv::Vec<double, kParameters>;
using Matrix = cv::Matx<double, kParameters, kParameters>;

double gauss(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi); }
double step(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

struct Value {
  double model = 0.0;
  Vector gradient;
};

Value evaluate(const Vector& p, double s) {
  const double blur = std::exp(p[log_blur]);
  const double taper = std::exp(p[log_taper]);
  const double z1 = (p[tip] - s) / blur;
  const double z0 = (p[tip] - taper - s) / blur;
  const double ramp = blur * (z1 * step(z1) + gauss(z1) - z0 * step(z0) - gauss(z0)) / taper;
  const double ramp_by_tip = (step(z1) - step(z0)) / taper;
  const double ramp_by_log_blur = (gauss(z1) - gauss(z0)) / taper * blur;
  const double ramp_by_log_taper = step(z0) - ramp;
  const double drop = step(z1);
  const double drop_by_tip = gauss(z1) / blur;
  const double drop_by_log_blur = -z1 * gauss(z1);
  const double q = p[rest];
  const double shape = (1.0 - q) * ramp + q * drop;
  Value v;
  v.model = p[base] + p[height] * shape;
  v.gradient[tip] = p[height] * ((1.0 - q) * ramp_by_tip + q * drop_by_tip);
  v.gradient[height] = shape;
  v.gradient[base] = 1.0;
  v.gradient[log_blur] = p[height] * ((1.0 - q) * ramp_by_log_blur + q * drop_by_log_blur);
  v.gradient[log_taper] = p[height] * (1.0 - q) * ramp_by_log_taper;
  v.gradient[rest] = p[height] * (drop - ramp);
  return v;
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
  constexpr double sigma_log_taper = 0.8;
  constexpr double mean_rest = 0.3;
  constexpr double sigma_rest = 0.3;
  const double unit = kTypical_gray * kTypical_gray * correlation_px;
  const auto weight = [unit](double sigma) { return unit / (sigma * sigma); };
  Prior prior;
  prior.mean = Vector(0.0, guess.height, 0.0, std::log(guess.blur_px), std::log(guess.taper_px), mean_rest);
  prior.weight = Vector(0.0, weight(sigma_height), weight(sigma_base), weight(sigma_log_blur), weight(sigma_log_taper),
                        weight(sigma_rest));
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

Matrix bounded(Matrix m, double damping) {
  for (int k = 0; k < kParameters; ++k) m(k, k) = m(k, k) * (1.0 + damping) + 1e-9;
  return m;
}

/// At most `turns` steps of Levenberg-Marquardt from `p`, which is moved; the cost it ends with.
double descend(std::span<const double> s, std::span<const double> profile, const Prior& prior, double huber, int turns,
               Vector& p) {
  double damping = 1e-3;
  System here = assemble(s, profile, p, huber, prior);
  for (int turn = 0; turn < turns; ++turn) {
    Vector next = p + bounded(here.normal, damping).inv(cv::DECOMP_CHOLESKY) * here.right;
    for (const int k : {log_blur, log_taper}) next[k] = std::clamp(next[k], std::log(0.05), std::log(100.0));
    next[rest] = std::clamp(next[rest], -0.1, 0.95);
    next[tip] = std::clamp(next[tip], s.front(), s.back());
    const System there = assemble(s, profile, next, huber, prior);
    if (there.cost > here.cost) {
      damping = std::min(1e7, damping * 8.0);
      continue;
    }
    const double moved = std::abs(next[tip] - p[tip]);
    p = next;
    here = there;
    damping = std::max(1e-7, damping * 0.2);
    if (moved < 1e-3) break;
  }
  return here.cost;
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
  constexpr double no_outliers = 1e9;  // first the edge is found, then outliers are recognised
  // A long bevel seen from the side and a round end are two valleys of the cost: both are tried.
  Vector p = prior.mean;
  double least = std::numeric_limits<double>::infinity();
  for (const double share : {1.0, 0.4}) {
    Vector attempt = prior.mean;
    attempt[log_taper] += std::log(share);
    attempt[tip] = start.tip_px * share;
    const double cost = descend(s, profile, prior, no_outliers, 12, attempt);
    if (cost < least) {
      least = cost;
      p = attempt;
    }
  }
  double huber = no_outliers;
  for (int round = 0; round < 2; ++round) {
    huber = huber_width(s, profile, p);
    descend(s, profile, prior, huber, 15, p);
  }
  const System end = assemble(s, profile, p, huber, prior);
  const double variance = end.squares / std::max(1.0, end.weight_sum - kParameters);
  const Matrix covariance = bounded(end.normal, 0.0).inv(cv::DECOMP_CHOLESKY);
  fit.tip_variance_px2 = covariance(tip, tip) * variance * correlation_px;
  fit.tip_px = p[tip];
  fit.height = p[height];
  fit.base = p[base];
  fit.rest = p[rest];
  fit.taper_px = std::exp(p[log_taper]);
  fit.blur_px = std::exp(p[log_blur]);
  fit.residual = std::sqrt(variance);
  const bool inside = p[tip] > s.front() + 1.0 && p[tip] < s.back() - 1.0;
  fit.converged = inside && p[height] > 0.0 && std::isfinite(fit.tip_variance_px2) && fit.tip_variance_px2 > 0.0;
  return fit;
}

}  // namespace bevel::camera
