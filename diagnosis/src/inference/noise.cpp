// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/noise.hpp>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "inference/minimum.hpp"

namespace bevel::inference {
namespace {

constexpr double kLargestAr1 = 0.98;
constexpr double kLowestAr2 = -0.7, kHighestAr2 = 0.5;
constexpr double kSecondOrder = 10.8;  // fall of the deviance that chance brings once in 1000

struct Whitened {
  double rss = 0;
  double dof = 0;
  double log_terms = 0;  // log|V| + log|X^T V^-1 X|, for sigma = 1
};

Whitened project(const Series& series, const Eigen::VectorXd& error, const Eigen::MatrixXd& basis, const Noise& noise) {
  Whitened out;
  if (basis.rows() <= basis.cols()) return out;  // the curve goes through all of them: they say nothing of the noise
  const Whitening whitening = make_whitening(series, noise, 1.0);
  Eigen::VectorXd e = error;
  whiten(whitening, e);
  out.dof = static_cast<double>(e.size());
  for (double weight : whitening.weight) out.log_terms -= 2 * std::log(weight);
  Eigen::MatrixXd X = basis;
  whiten(whitening, X);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(X);
  const Eigen::VectorXd rotated = qr.householderQ().transpose() * e;
  out.rss = rotated.tail(rotated.size() - X.cols()).squaredNorm();
  out.dof -= static_cast<double>(X.cols());
  for (Eigen::Index i = 0; i < X.cols(); ++i)
    out.log_terms += 2 * std::log(std::max(std::abs(qr.matrixQR()(i, i)), 1e-12));
  return out;
}

// Minus twice the restricted log-likelihood at this ar1, with each channel's sigma at its best.
double deviance(const Dataset& data, const Errors& errors, const std::vector<std::vector<Eigen::MatrixXd>>& bases,
                Noise& noise) {
  double sum = 0;
  noise.sigma.assign(data.claimed_sd.size(), 0);
  for (std::size_t c = 0; c < data.claimed_sd.size(); ++c) {
    Whitened total;
    for (std::size_t r = 0; r < data.recordings.size(); ++r) {
      const Series& series = data.recordings[r].series[c];
      if (series.time_s.empty()) continue;
      const Whitened one = project(series, errors[r][c], bases[r][c], noise);
      total.rss += one.rss;
      total.dof += one.dof;
      total.log_terms += one.log_terms;
    }
    const double variance = std::max(total.rss / std::max(total.dof, 1.0), 1e-18);
    noise.sigma[c] = std::sqrt(variance);
    sum += total.dof * std::log(variance) + total.log_terms;
  }
  return sum;
}

// Correlation of errors so many seconds apart; of second order by its recursion over frames, and between them a line.
class Correlations {
 public:
  explicit Correlations(const Noise& noise) : ar1_(noise.ar1), frame_s_(noise.frame_s) {
    if (noise.ar2 == 0) return;
    by_frames_ = {1, noise.ar1};
    while (by_frames_.size() < kFrames)
      by_frames_.push_back(noise.ar1 * (1 - noise.ar2) * by_frames_.back() +
                           noise.ar2 * by_frames_[by_frames_.size() - 2]);
  }
  double operator()(double apart_s) const {
    const double frames = apart_s / frame_s_;
    if (by_frames_.empty()) return std::pow(ar1_, frames);
    const auto whole = static_cast<std::size_t>(frames);
    if (whole + 1 >= kFrames) return 0;
    const double share = frames - static_cast<double>(whole);
    return by_frames_[whole] * (1 - share) + by_frames_[whole + 1] * share;
  }

 private:
  static constexpr std::size_t kFrames = 256;
  double ar1_, frame_s_;
  std::vector<double> by_frames_;
};

}  // namespace

Noise Noise::of(std::size_t channel) const {
  Noise out = *this;
  if (!own_ar1.empty()) out.ar1 = own_ar1[channel], out.ar2 = 0;
  return out;
}

Whitening make_whitening(const Series& series, const Noise& noise, double sigma) {
  Whitening out;
  const std::size_t n = series.time_s.size();
  out.carry.assign(n, 0);
  out.carry2.assign(n, 0);
  out.weight.resize(n);
  const Correlations correlation(noise);
  const bool own = !series.input_sd.empty();
  if (own) out.gain.resize(n);
  std::vector<double> unknown(own ? n : 0);  // variance of the noise in each reading, that and all before it read
  for (std::size_t i = 0; i < n; ++i) {
    double left = 1;
    if (i > 0 && noise.ar1 > 0) {
      const auto between = [&](std::size_t a, std::size_t b) {
        return correlation(series.time_s[a] - series.time_s[b]);
      };
      const double near = between(i, i - 1);
      double first = near, second = 0;
      if (i > 1 && noise.ar2 != 0) {
        const double apart = between(i - 1, i - 2), far = between(i, i - 2);
        second = (far - near * apart) / (1 - apart * apart);
        first = near - second * apart;
        left -= second * far;
      }
      left -= first * near;
      // The process is of errors in units of their claimed standard deviations.
      if (own) left += first * first * unknown[i - 1] + (second != 0 ? second * second * unknown[i - 2] : 0);
      out.carry[i] = first * series.relative_sd[i] / series.relative_sd[i - 1];
      if (second != 0) out.carry2[i] = second * series.relative_sd[i] / series.relative_sd[i - 2];
    }
    double variance = series.relative_sd[i] * series.relative_sd[i] * left;
    if (own) {
      const double noise_part = variance;
      variance += series.input_sd[i] * series.input_sd[i];
      out.gain[i] = noise_part / variance;
      unknown[i] = left * (1 - out.gain[i]);
    }
    out.weight[i] = 1 / (sigma * std::sqrt(variance));
    if (!series.precision.empty()) out.weight[i] *= std::sqrt(series.precision[i]);
  }
  return out;
}

Eigen::MatrixXd spline_basis(const Series& series, double knot_s) {
  const auto n = static_cast<Eigen::Index>(series.time_s.size());
  const double start_s = series.time_s.front();
  const double span_s = std::max(series.time_s.back() - start_s, 1e-9);
  // No more curve than a quarter of the readings can bear.
  const auto intervals =
      std::max<Eigen::Index>(1, std::min(static_cast<Eigen::Index>(std::lround(span_s / knot_s)), n / 4 - 3));
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(n, intervals + 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double x = (series.time_s[static_cast<std::size_t>(i)] - start_s) / span_s * static_cast<double>(intervals);
    const auto k = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(x), 0, intervals - 1);
    const double t = x - static_cast<double>(k);
    const double u = 1 - t;
    X(i, k) = u * u * u / 6;
    X(i, k + 1) = (3 * t * t * t - 6 * t * t + 4) / 6;
    X(i, k + 2) = (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6;
    X(i, k + 3) = t * t * t / 6;
  }
  return X;
}

Noise estimate_noise(const Dataset& data, const Errors& errors, bool second_order) {
  std::vector<std::vector<Eigen::MatrixXd>> bases(data.recordings.size());
  for (std::size_t r = 0; r < bases.size(); ++r)
    for (const auto& series : data.recordings[r].series)
      bases[r].push_back(series.time_s.empty() ? Eigen::MatrixXd() : spline_basis(series, kKnot_s));
  Noise noise;
  noise.frame_s = data.frame_s;
  const auto at = [&](double ar1, double ar2) {
    noise.ar1 = ar1;
    noise.ar2 = ar2;
    return deviance(data, errors, bases, noise);
  };
  // The deviance in ar1 has one minimum: a coarse scan, then golden-section steps.
  const auto best_ar1 = [&](double ar2) {
    double best = 0, best_value = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= 12; ++i) {
      const double ar1 = kLargestAr1 * i / 12;
      const double value = at(ar1, ar2);
      if (value < best_value) best = ar1, best_value = value;
    }
    const double found =
        minimum_of(std::max(0.0, best - kLargestAr1 / 12), std::min(kLargestAr1, best + kLargestAr1 / 12), 0.004,
                   [&](double ar1) { return at(ar1, ar2); });
    return found < 0.004 ? 0.0 : found;
  };
  double ar1 = best_ar1(0), ar2 = 0;
  if (second_order && ar1 > 0) {
    const double first_order = at(ar1, 0);
    double other1 = ar1, other2 = 0;
    for (int turn = 0; turn < 3; ++turn) {
      other2 = minimum_of(kLowestAr2, kHighestAr2, 0.004, [&](double x) { return at(other1, x); });
      other1 = best_ar1(other2);
    }
    if (first_order - at(other1, other2) > kSecondOrder) ar1 = other1, ar2 = other2;
  }
  at(ar1, ar2);
  return noise;
}

ExpectedErrors::ExpectedErrors(Eigen::MatrixXd columns) : columns_(std::move(columns)) {
  const Eigen::Index n = columns_.rows();
  square_ = columns_.rowwise().squaredNorm();
  with_last_ = with_one_before_ = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 1; i < n; ++i) with_last_[i] = columns_.row(i).dot(columns_.row(i - 1));
  for (Eigen::Index i = 2; i < n; ++i) with_one_before_[i] = columns_.row(i).dot(columns_.row(i - 2));
}

Eigen::VectorXd ExpectedErrors::whitened_squares(const Whitening& whitening) const {
  if (!whitening.gain.empty()) {  // what is carried on is no reading
    Eigen::MatrixXd white = columns_;
    whiten(whitening, white);
    return white.rowwise().squaredNorm();
  }
  Eigen::VectorXd out(square_.size());
  for (Eigen::Index i = 0; i < square_.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double a = whitening.carry[at], b = whitening.carry2[at];
    double square = square_[i];
    if (i > 0) square += a * (a * square_[i - 1] - 2 * with_last_[i]);
    if (i > 1) square += b * (b * square_[i - 2] - 2 * with_one_before_[i] + 2 * a * with_last_[i - 1]);
    out[i] = square * whitening.weight[at] * whitening.weight[at];
  }
  return out;
}

Noise refine_noise(const Dataset& data, const ErrorsByChannel& errors, const Noise& start) {
  Noise noise = start;
  const double information = information_of(noise.tails);
  const auto at = [&](double ar1) {
    noise.ar1 = ar1;
    double deviance = 0;
    for (std::size_t c = 0; c < data.claimed_sd.size(); ++c) {
      double squares = 0, count = 0;
      for (std::size_t r = 0; r < data.recordings.size(); ++r) {
        const Whitening whitening = make_whitening(data.recordings[r].series[c], noise, 1.0);
        squares += errors[r][c].whitened_squares(whitening).sum();
        count += static_cast<double>(whitening.weight.size());
        for (const double weight : whitening.weight) deviance -= 2 * std::log(weight);
      }
      const double variance = std::max(squares / std::max(count * information, 1.0), 1e-18);
      noise.sigma[c] = std::sqrt(variance);
      deviance += count * std::log(variance);
    }
    return deviance;
  };
  constexpr double kWidth = 0.002;
  const double found = minimum_of(0, kLargestAr1, kWidth, at);
  at(found < kWidth ? 0 : found);
  return noise;
}

bool alike(const Noise& a, const Noise& b) {
  constexpr double kShare = 0.01, kCorrelation = 0.01;
  if (std::abs(a.ar1 - b.ar1) > kCorrelation || std::abs(a.ar2 - b.ar2) > kCorrelation) return false;
  if (a.tails.degrees != b.tails.degrees) return false;
  for (std::size_t c = 0; c < a.sigma.size(); ++c)
    if (std::abs(a.sigma[c] - b.sigma[c]) > kShare * b.sigma[c]) return false;
  return true;
}

}  // namespace bevel::inference
