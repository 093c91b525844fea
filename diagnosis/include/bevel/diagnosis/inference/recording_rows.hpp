// SPDX-License-Identifier: MIT
#pragma once
// The rows of one recording in two parts, the first readings and the rest, and its noise between them: whitening, its
// inverse, and what the first part says of the rest. Rows are those of the likelihood: channel after channel, in time.
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

// Readings with noise of unit variance.
struct WhiteReadings {
  Eigen::MatrixXd A;       // rows x unknowns
  Eigen::VectorXd w;       // measured - predicted
  double log_weights = 0;  // sum of the logarithms of the whitening's weights
};

class RecordingRows {
 public:
  // first(): readings up to until_s.
  RecordingRows(const Likelihood& likelihood, std::size_t recording, double until_s);
  const std::vector<Eigen::Index>& first() const { return first_; }
  const std::vector<Eigen::Index>& rest() const { return rest_; }
  std::vector<Eigen::Index> all() const;

  // Whitened rows back in the channels' units. continued: less what the first part says of the rest; the first part
  // becomes zero.
  Eigen::MatrixXd coloured(Eigen::MatrixXd rows, bool continued) const;
  // Of the noise of each row; continued: of what the first part does not say of it.
  Eigen::VectorXd noise_variances(bool continued) const;
  double log_weights(const std::vector<Eigen::Index>& rows) const;
  // The rest whitened by itself, as if nothing had been read before it. A, errors: of all rows, not whitened.
  WhiteReadings rest_alone(const Eigen::MatrixXd& A, const Eigen::VectorXd& errors) const;

 private:
  const SeriesSet& data() const { return likelihood_->data().recordings[recording_]; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(first_.size() + rest_.size()); }
  template <class Visit>
  void each_channel(const Visit& visit) const;

  const Likelihood* likelihood_;
  std::size_t recording_;
  std::vector<Eigen::Index> first_, rest_;
};

}  // namespace bevel::inference
