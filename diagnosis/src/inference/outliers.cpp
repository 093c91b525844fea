// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/outliers.hpp>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace bevel::inference {
namespace {

// Sum over a message's axes of squared errors against its neighbours, each in standard deviations. A Gaussian message
// of three axes passes this once in 3e5.
constexpr double kOutlier = 28.0;
constexpr double kAgrees = 11.3;  // of three axes, between two readings: 99 %
constexpr std::array kBeside{-2, -1, 1, 2};
constexpr int kOutlierPasses = 12;
constexpr double kLeastLeft = 0.02;  // of a reading's precision: where a curve takes more, nothing is known of it
constexpr double kClipped = 3.0;     // deviations, by the median of their size, while outliers are still in

// Errors of readings against what their neighbours (and the curve) predict, squared in standard deviations. The noise
// is taken as of first order: neighbours are enough to tell an outlier.
Eigen::VectorXd surprise(const Series& series, Eigen::VectorXd error, const Noise& noise, double sigma) {
  const Eigen::Index n = error.size();
  Noise first_order = noise;
  first_order.ar2 = 0;
  const Whitening whitening = make_whitening(series, first_order, 1.0);
  Eigen::MatrixXd X = spline_basis(series, kKnot_s);
  const Eigen::MatrixXd curve = X;
  Eigen::VectorXd e = error;
  whiten(whitening, X);
  whiten(whitening, e);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(X);
  error -= curve * qr.solve(e).eval();
  // What the curve takes of each reading: with a precision P = W'W the conditional precision of a reading, the curve
  // unknown, is that of P - PX (X'PX)^-1 X'P. At the ends of a series the curve follows a single one.
  const Eigen::MatrixXd basis = qr.householderQ() * Eigen::MatrixXd::Identity(X.rows(), X.cols());
  const auto left_by_curve = [&](Eigen::Index i) {
    const auto at = static_cast<std::size_t>(i);
    const double own = whitening.weight[at];
    double precision = own * own;
    Eigen::RowVectorXd taken = own * basis.row(i);
    if (i + 1 < n) {
      const double next = whitening.carry[at + 1] * whitening.weight[at + 1];
      precision += next * next;
      taken -= next * basis.row(i + 1);
    }
    return std::max(1 - taken.squaredNorm() / precision, kLeastLeft);
  };
  for (Eigen::Index i = 0; i < n; ++i) error[i] /= series.relative_sd[static_cast<std::size_t>(i)];
  Eigen::VectorXd squared(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    // Conditional mean and variance given the neighbours, of a Markov process: precision is tridiagonal.
    double precision = 1, pull = 0;
    const auto join = [&](Eigen::Index j, double carry) {
      precision += carry * carry / (1 - carry * carry);
      pull += carry / (1 - carry * carry) * error[j];
    };
    if (i > 0)
      join(i - 1, whitening.carry[static_cast<std::size_t>(i)] * series.relative_sd[static_cast<std::size_t>(i - 1)] /
                      series.relative_sd[static_cast<std::size_t>(i)]);
    if (i + 1 < n)
      join(i + 1, whitening.carry[static_cast<std::size_t>(i + 1)] * series.relative_sd[static_cast<std::size_t>(i)] /
                      series.relative_sd[static_cast<std::size_t>(i + 1)]);
    const double residual = error[i] - pull / precision;
    squared[i] = residual * residual * precision / (sigma * sigma * left_by_curve(i));
  }
  return squared;
}

// Squared distance in standard deviations of two errors of a series. Where a membrane gives way or a tip jumps,
// readings agree with those on their own side, and with no curve; an outlier agrees with none.
double squared_distance(const Series& series, const Eigen::VectorXd& error, const Noise& noise, double sigma,
                        std::size_t i, std::size_t j) {
  const double a = series.relative_sd[i], b = series.relative_sd[j];
  const double correlation = std::pow(noise.ar1, std::abs(series.time_s[i] - series.time_s[j]) / noise.frame_s);
  const double apart = error[static_cast<Eigen::Index>(i)] - error[static_cast<Eigen::Index>(j)];
  return apart * apart / (sigma * sigma * std::max(a * a + b * b - 2 * a * b * correlation, 1e-12));
}

// The error with what a flexible curve leaves of it clipped: outliers would pass for white noise of their size.
Eigen::VectorXd clipped(const Series& series, const Eigen::VectorXd& error) {
  if (error.size() < 8) return error;
  const Eigen::MatrixXd X = spline_basis(series, kKnot_s);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(X);
  Eigen::VectorXd curve = X * qr.solve(error);
  for (int pass = 0; pass < 2; ++pass) {
    Eigen::VectorXd left = error - curve;
    for (Eigen::Index i = 0; i < left.size(); ++i) left[i] /= series.relative_sd[static_cast<std::size_t>(i)];
    std::vector<double> sizes(static_cast<std::size_t>(left.size()));
    for (std::size_t i = 0; i < sizes.size(); ++i) sizes[i] = std::abs(left[static_cast<Eigen::Index>(i)]);
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    const double limit = kClipped * 1.4826 * *middle;
    for (Eigen::Index i = 0; i < left.size(); ++i)
      left[i] = std::clamp(left[i], -limit, limit) * series.relative_sd[static_cast<std::size_t>(i)];
    left += curve;
    if (pass == 1) return left;
    curve = X * qr.solve(left);
  }
  return error;
}

}  // namespace

Calibration calibrate_noise(const Dataset& data, const Errors& errors) {
  Calibration out;
  out.outliers.resize(data.recordings.size());
  Dataset now = data;
  Errors left = errors;
  std::size_t messages = 0, dropped = 0;
  for (const auto& recording : data.recordings) messages += recording.messages;
  for (int pass = 0; pass < kOutlierPasses; ++pass) {
    Errors without_outliers = left;
    for (std::size_t r = 0; r < left.size(); ++r)
      for (std::size_t c = 0; c < left[r].size(); ++c)
        without_outliers[r][c] = clipped(now.recordings[r].series[c], left[r][c]);
    out.noise = estimate_noise(now, without_outliers, false);
    bool found = false;
    for (std::size_t r = 0; r < now.recordings.size(); ++r) {
      const auto& recording = now.recordings[r];
      std::vector<double> sum(recording.messages, 0);
      std::array<std::vector<double>, kBeside.size()> apart;  // of a message from those beside it
      apart.fill(sum);
      for (std::size_t c = 0; c < now.claimed_sd.size(); ++c) {
        const Series& series = recording.series[c];
        if (series.time_s.size() < 8) continue;
        const Eigen::VectorXd squared = surprise(series, left[r][c], out.noise, out.noise.sigma[c]);
        for (std::size_t i = 0; i < series.message.size(); ++i) {
          sum[series.message[i]] += squared[static_cast<Eigen::Index>(i)];
          for (std::size_t n = 0; n < kBeside.size(); ++n) {
            const auto beside = static_cast<std::ptrdiff_t>(i) + kBeside[n];
            if (beside >= 0 && beside < std::ssize(series.message))
              apart[n][series.message[i]] += squared_distance(series, left[r][c], out.noise, out.noise.sigma[c], i,
                                                              static_cast<std::size_t>(beside));
            else
              apart[n][series.message[i]] = std::numeric_limits<double>::infinity();
          }
        }
      }
      for (std::size_t i = 0; i < sum.size(); ++i)
        if (std::ranges::any_of(apart, [&](const auto& from) { return from[i] < kAgrees; })) sum[i] = 0;
      for (std::size_t i = 0; i < sum.size(); ++i) {
        // An outlier makes its neighbours look bad too: only the worst of three goes, the others are looked at again.
        const bool worst = (i == 0 || sum[i] >= sum[i - 1]) && (i + 1 == sum.size() || sum[i] >= sum[i + 1]);
        if (worst && sum[i] > kOutlier) out.outliers[r].push_back(i), ++dropped, found = true;
      }
    }
    if (!found) break;
    for (auto& readings : out.outliers) std::sort(readings.begin(), readings.end());
    now = without(data, out.outliers);
    for (std::size_t r = 0; r < now.recordings.size(); ++r)
      for (std::size_t c = 0; c < now.claimed_sd.size(); ++c) {
        const auto& all = data.recordings[r].series[c].message;
        const auto& kept = now.recordings[r].series[c].message;
        left[r][c].resize(static_cast<Eigen::Index>(kept.size()));
        for (std::size_t i = 0, j = 0; i < kept.size(); ++i, ++j) {
          while (all[j] != kept[i]) ++j;
          left[r][c][static_cast<Eigen::Index>(i)] = errors[r][c][static_cast<Eigen::Index>(j)];
        }
      }
  }
  out.noise = estimate_noise(now, left);
  out.noise.outlier_share = static_cast<double>(dropped) / static_cast<double>(std::max<std::size_t>(messages, 1));
  return out;
}

}  // namespace bevel::inference
