// SPDX-License-Identifier: MIT
#include "camera/end_problem.hpp"

#include <algorithm>
#include <cmath>

namespace bevel::camera::end {

void Problem::build(const Vector& p, Tables& tables, bool gradient) const {
  const double bevel = std::exp(p[log_bevel]);
  tables.here.build(bevel, std::sin(p[roll]), priors_.blur_px);
  if (!gradient) return;
  tables.rolled.build(bevel, std::sin(p[roll] + kRollStep_rad), priors_.blur_px);
  tables.longer.build(bevel * std::exp(kLogStep), std::sin(p[roll]), priors_.blur_px);
}

double Problem::shaft_width_px2() const {
  // The first third of the profile is shaft; medians, for what lies beside it.
  const auto shaft = static_cast<std::ptrdiff_t>(profile_.dark.size() / 3 + 1);
  const auto median = [shaft](std::vector<double> values) {
    const auto middle = values.begin() + shaft / 2;
    std::nth_element(values.begin(), middle, values.begin() + shaft);
    return *middle;
  };
  const double dark = median(profile_.dark);
  const double blur_px2 = priors_.blur_px * priors_.blur_px;
  if (dark <= 0.0) return blur_px2;
  const double window = priors_.window_px;
  const double second = (median(profile_.spread) / dark / std::sqrt(5.0) + 0.5) * window * window / 1.5;
  return std::clamp(second - priors_.radius_px * priors_.radius_px / 3.0, 0.25 * blur_px2, 2.0 * blur_px2);
}

void Problem::sample(const Vector& p, const Tables& tables, int i, bool gradient, Sample& out) const {
  const double x = p[tip] - s(i);
  const double r = priors_.radius_px;
  const double ti = t(s(i));
  const double c = offset(p, s(i));
  // The three sums over a shape, per unit of height.
  const double by_second = std::sqrt(5.0) * 1.5 / (priors_.window_px * priors_.window_px);
  const double by_share = -0.5 * std::sqrt(5.0);
  struct Sums {
    double value[kChannels];
  };
  const auto sums_of = [&](const Moments& m) {
    const double moment = c * m.share + r * m.moment;
    const double second = r * r * m.second + 2.0 * c * r * m.moment + (c * c + width_px2_) * m.share;
    return Sums{{m.share, moment_scale_ * moment, by_second * second + by_share * m.share}};
  };
  const auto seen_of = [&](const BevelMoments& b) { return sums_of(b.dark(p[pale])); };
  const BlurredBevel::Value v = tables.here.at(x);
  const Sums here = seen_of(v.moments);
  const auto k = static_cast<size_t>(i);
  const double measured[kChannels] = {profile_.dark[k] - p[base], moment_scale_ * profile_.moment[k],
                                      profile_.spread[k]};
  out.share = here.value[0];
  for (int n = 0; n < kChannels; ++n) out.residual[n] = measured[n] - p[height] * here.value[n];
  if (!gradient) return;
  const double h = p[height];
  const Sums along = seen_of(v.slope);
  const Sums turned = seen_of(tables.rolled.at(x).moments);
  const Sums longer = seen_of(tables.longer.at(x).moments);
  const Sums face = sums_of(v.moments.face);
  const double moment = v.moments.dark(p[pale]).moment;
  const double by_offset[kChannels] = {0.0, h * moment_scale_ * out.share,
                                       h * by_second * 2.0 * (r * moment + c * out.share)};
  for (int n = 0; n < kChannels; ++n) {
    Vector& g = out.gradient[n];
    g[tip] = h * along.value[n];
    g[height] = here.value[n];
    g[base] = n == 0 ? 1.0 : 0.0;
    g[roll] = h * (turned.value[n] - here.value[n]) / kRollStep_rad;
    g[log_bevel] = h * (longer.value[n] - here.value[n]) / kLogStep;
    g[pale] = -h * face.value[n];
    g[c0] = by_offset[n], g[c1] = g[c0] * ti, g[c2] = g[c1] * ti;
    for (int b = 0; b < kBends; ++b) g[bend0 + b] = g[c0] * by_bend(b, s(i));
  }
}

double Problem::weight(double residual, int channel, const Noise& noise) const {
  const double z = residual / (kCauchy * noise.sigma[static_cast<size_t>(channel)]);
  return 1.0 / (1.0 + z * z);
}

Problem::System Problem::assemble(const Vector& p, const Prior& prior, const Noise& noise, bool gradient) {
  build(p, tables_, gradient);
  System system;
  Sample sample_i;
  for (int i = 0; i < size(); ++i) {
    sample(p, tables_, i, gradient, sample_i);
    for (int channel = 0; channel < kChannels; ++channel) {
      const double residual = sample_i.residual[channel];
      const double information = noise.information(channel);
      const double sigma = noise.sigma[static_cast<size_t>(channel)];
      const double width2 = kCauchy * kCauchy * sigma * sigma;
      system.cost += 0.5 * information * width2 * std::log1p(residual * residual / width2);
      if (!gradient) continue;
      const double w = information * weight(residual, channel, noise);
      const Vector& g = sample_i.gradient[channel];
      for (int a = 0; a < kParameters; ++a) {
        const double wa = w * g[a];
        system.right[a] += wa * residual;
        for (int b = 0; b <= a; ++b) system.normal(a, b) += wa * g[b];
      }
    }
  }
  for (int a = 0; a < kParameters; ++a) {
    const double off = prior.mean[a] - p[a];
    system.cost += 0.5 * prior.information[a] * off * off;
    system.right[a] += prior.information[a] * off;
    system.normal(a, a) += prior.information[a];
    for (int b = 0; b < a; ++b) system.normal(b, a) = system.normal(a, b);
  }
  return system;
}

double Problem::descend(Vector& p, const Prior& prior, const Noise& noise, int turns) {
  double damping = 1e-3;
  System here = assemble(p, prior, noise, true);
  for (int turn = 0; turn < turns; ++turn) {
    Matrix damped = here.normal;
    for (int k = 0; k < kParameters; ++k) damped(k, k) = damped(k, k) * (1.0 + damping) + 1e-12;
    Vector next = p + damped.inv(cv::DECOMP_CHOLESKY) * here.right;
    next[tip] = std::clamp(next[tip], first_s(), last_s());
    next[roll] = std::clamp(next[roll], -kHalfPi, kHalfPi);
    next[log_bevel] = std::clamp(next[log_bevel], p[log_bevel] - 0.5, p[log_bevel] + 0.5);
    next[pale] = std::clamp(next[pale], -0.5, 1.5);
    const System there = assemble(next, prior, noise, true);
    if (!(there.cost < here.cost)) {
      damping = std::min(1e7, damping * 10.0);
      if (damping > 1e5) break;
      continue;
    }
    const double moved = std::abs(next[tip] - p[tip]);
    const double gained = here.cost - there.cost;
    p = next;
    here = there;
    damping = std::max(1e-7, damping * 0.1);
    if (moved < 0.01 && gained < 0.01) break;
  }
  return here.cost;
}

Noise Problem::noise_at(const Vector& p) {
  build(p, tables_, false);
  std::array<std::vector<double>, kChannels> residual;
  Sample sample_i;
  for (int i = 0; i < size(); ++i) {
    sample(p, tables_, i, false, sample_i);
    for (size_t k = 0; k < kChannels; ++k) residual[k].push_back(sample_i.residual[k]);
  }
  Noise noise;
  for (size_t k = 0; k < kChannels; ++k) {
    std::vector<double>& channel = residual[k];
    std::vector<double> size_of = channel;
    for (double& r : size_of) r = std::abs(r);
    const auto middle = size_of.begin() + static_cast<std::ptrdiff_t>(size_of.size() / 2);
    std::nth_element(size_of.begin(), middle, size_of.end());
    const double least = 1e-3 * std::abs(p[height]) + 0.1;
    noise.sigma[k] = std::max(1.4826 * *middle, least);
    double squares = 0.0, weights = 0.0, square = 0.0;
    for (double& r : channel) {
      const double w = weight(r, static_cast<int>(k), noise);
      squares += w * r * r, weights += w;
      r *= w;  // outliers have no correlation of their own
      square += r * r;
    }
    // The sum of autocorrelations up to the first that is not positive.
    constexpr size_t most = 8;
    noise.correlation_px[k] = 1.0;
    for (size_t lag = 1; lag <= most; ++lag) {
      double product = 0.0;
      for (size_t i = 0; i + lag < channel.size(); ++i) product += channel[i] * channel[i + lag];
      const double rho = product / std::max(square, 1e-12);
      if (rho <= 0.0) break;
      noise.correlation_px[k] += 2.0 * rho;
    }
    const double free = static_cast<double>(kParameters) / kChannels;
    noise.sigma[k] = std::max(std::sqrt(kWeighted * squares / std::max(1.0, weights - free)), least);
  }
  return noise;
}

std::vector<std::pair<double, double>> Problem::coarse(const Prior& prior, const Noise& noise) {
  Vector p = prior.mean;
  p[roll] = std::asin(0.75);
  build(p, tables_, false);
  std::vector<std::pair<double, double>> cost;  // cost, tip
  Sample sample_i;
  for (int begin = 4; begin < size() - 2; begin += 3) {
    p[tip] = s(begin);
    double sum = 0.0;
    for (int i = 0; i < size(); ++i) {
      sample(p, tables_, i, false, sample_i);
      for (const int channel : {0, 2}) {
        const double sigma = noise.sigma[static_cast<size_t>(channel)];
        const double width2 = kCauchy * kCauchy * sigma * sigma, r = sample_i.residual[channel];
        sum += 0.5 * noise.information(channel) * width2 * std::log1p(r * r / width2);
      }
    }
    cost.emplace_back(sum, p[tip]);
  }
  return cost;
}

}  // namespace bevel::camera::end
