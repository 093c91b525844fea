// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/recording_rows.hpp>

#include <cmath>
#include <numeric>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

RecordingRows::RecordingRows(const Likelihood& likelihood, std::size_t recording, double until_s)
    : likelihood_(&likelihood), recording_(recording) {
  Index row = 0;
  for (const Series& series : data().series)
    for (const double time_s : series.time_s) (time_s > until_s ? rest_ : first_).push_back(row++);
}

std::vector<Index> RecordingRows::all() const {
  std::vector<Index> out(static_cast<std::size_t>(size()));
  std::iota(out.begin(), out.end(), Index{0});
  return out;
}

template <class Visit>
void RecordingRows::each_channel(const Visit& visit) const {
  Index row = 0;
  for (const Whitening& whitening : likelihood_->whitening(recording_)) {
    visit(row, whitening);
    row += static_cast<Index>(whitening.weight.size());
  }
}

MatrixXd RecordingRows::coloured(MatrixXd rows, bool continued) const {
  if (continued)
    for (const Index i : first_) rows.row(i).setZero();
  each_channel([&](Index first, const Whitening& whitening) {
    // The noise in the two rows before, as whiten() carries it on.
    Eigen::RowVectorXd before = Eigen::RowVectorXd::Zero(rows.cols()), twice_before = before, predicted;
    for (std::size_t at = 0; at < whitening.weight.size(); ++at) {
      auto row = rows.row(first + static_cast<Index>(at));
      row /= whitening.weight[at];
      predicted = whitening.carry[at] * before + whitening.carry2[at] * twice_before;
      twice_before = before;
      before = predicted + whitening.gain_at(at) * row;
      row += predicted;
    }
  });
  return rows;
}

VectorXd RecordingRows::noise_variances(bool continued) const {
  VectorXd known = VectorXd::Zero(size()), out = known;
  if (continued) known(first_).setOnes();
  each_channel([&](Index first, const Whitening& whitening) {
    // Variances of what is carried on from the two rows before, and their covariance.
    double before = 0, twice_before = 0, across = 0;
    for (Index k = 0; k < static_cast<Index>(whitening.weight.size()); ++k) {
      const auto at = static_cast<std::size_t>(k);
      const double a = whitening.carry[at], b = whitening.carry2[at];
      const double own = known[first + k] > 0 ? 0 : 1 / (whitening.weight[at] * whitening.weight[at]);
      const double predicted = a * a * before + b * b * twice_before + 2 * a * b * across;
      const double gain = whitening.gain_at(at);
      across = a * before + b * across;
      twice_before = before;
      before = predicted + gain * gain * own;
      out[first + k] = predicted + own;
    }
  });
  return out;
}

double RecordingRows::log_weights(const std::vector<Index>& rows) const {
  VectorXd weights(size());
  each_channel([&](Index first, const Whitening& whitening) {
    for (std::size_t k = 0; k < whitening.weight.size(); ++k)
      weights[first + static_cast<Index>(k)] = whitening.weight[k];
  });
  return weights(rows).array().log().sum();
}

WhiteReadings RecordingRows::rest_alone(const MatrixXd& A, const VectorXd& errors) const {
  WhiteReadings out{.A = A(rest_, Eigen::all), .w = errors(rest_)};
  const Noise& noise = likelihood_->noise();
  Index row = 0, of_recording = 0;
  std::size_t next = 0;
  for (std::size_t c = 0; c < data().series.size(); ++c) {
    const Series& series = data().series[c];
    Series later;
    for (std::size_t i = 0; i < series.time_s.size(); ++i, ++of_recording) {
      if (next >= rest_.size() || rest_[next] != of_recording) continue;
      ++next;
      later.time_s.push_back(series.time_s[i]);
      later.relative_sd.push_back(series.relative_sd[i]);
      if (!series.input_sd.empty()) later.input_sd.push_back(series.input_sd[i]);
      if (!series.precision.empty()) later.precision.push_back(series.precision[i]);
    }
    const auto count = static_cast<Index>(later.time_s.size());
    const Whitening whitening = make_whitening(later, noise.of(c), noise.sigma[c]);
    whiten(whitening, out.A.middleRows(row, count));
    whiten(whitening, out.w.segment(row, count));
    for (const double weight : whitening.weight) out.log_weights += std::log(weight);
    row += count;
  }
  return out;
}

}  // namespace bevel::inference
