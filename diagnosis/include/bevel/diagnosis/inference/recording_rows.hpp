// SPDX-License-Identifier: MIT
/// @file
/// Rows of one recording in two parts, the first measurements and the rest, with the noise between them: whitening, its
/// inverse, and the prediction of the rest from the first part. Rows have the order of the likelihood: channel after
/// channel, each in time.
#pragma once
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

/// Measurements with noise of unit variance.
struct WhiteReadings {
  Eigen::MatrixXd A;       ///< Derivatives, rows x unknowns.
  Eigen::VectorXd w;       ///< Measured minus predicted.
  double log_weights = 0;  ///< Sum of the natural logs of the whitening's weights.
};

/// Rows of one recording in two parts.
class RecordingRows {
 public:
  /// Splits a recording.
  /// @param likelihood Likelihood; must outlive this object.
  /// @param recording Index of the recording.
  /// @param until_s End of the first part, in s from the recording's start.
  RecordingRows(const Likelihood& likelihood, std::size_t recording, double until_s);
  /// Returns the rows up to until_s.
  /// @return Ascending row indices.
  const std::vector<Eigen::Index>& first() const { return first_; }
  /// Returns the rows after until_s.
  /// @return Ascending row indices.
  const std::vector<Eigen::Index>& rest() const { return rest_; }
  /// Lists all rows.
  /// @return Row indices.
  std::vector<Eigen::Index> all() const;

  /// Converts whitened rows back to the channels' units.
  /// @param rows Whitened rows.
  /// @param continued Whether to subtract the prediction from the first part, whose rows become zero.
  /// @return Rows in the channels' units.
  Eigen::MatrixXd coloured(Eigen::MatrixXd rows, bool continued) const;
  /// Computes the noise variance of each row.
  /// @param continued Whether to condition on the first part.
  /// @return Variances, in squares of the channels' units.
  Eigen::VectorXd noise_variances(bool continued) const;
  /// Sums the natural logs of the whitening's weights.
  /// @param rows Row indices.
  /// @return Sum.
  double log_weights(const std::vector<Eigen::Index>& rows) const;
  /// Whitens the rest as if there were no measurements before it.
  /// @param A Derivatives of all rows, not whitened.
  /// @param errors Measured minus predicted of all rows, in the channels' units.
  /// @return Whitened rest.
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
