// SPDX-License-Identifier: MIT
/// @file
/// Measurement noise: autocorrelated of first or second order, one standard deviation per channel, and a share of
/// outliers.
///
/// The initial estimate is taken from the residuals of a flexible curve, so that unmodelled physics is not counted as
/// noise. The evidence of each candidate model then refines it (refine_noise(), error_spread.hpp). Sources: restricted
/// maximum likelihood, Harville 1977, JASA 72; AR(1) over gaps as an Ornstein-Uhlenbeck process; AR(2) by its partial
/// correlations (Barndorff-Nielsen and Schou 1973, J. Multivar. Anal. 3).
#pragma once
#include <span>
#include <vector>

#include <bevel/diagnosis/inference/dataset.hpp>
#include <bevel/diagnosis/inference/heavy_tails.hpp>

namespace bevel::inference {

/// Parameters of the measurement noise.
struct Noise {
  std::vector<double> sigma;      ///< Standard deviation of one measurement per channel, in the channel's unit.
  double ar1 = 0;                 ///< Correlation of measurements one frame apart.
  double ar2 = 0;                 ///< Partial correlation of measurements two frames apart; 0: first order.
  Tails tails{};                  ///< Distribution of the innovations.
  bool tails_are_open = false;    ///< Whether fits estimate the weight of the tails; otherwise they stay constant.
  double outlier_share = 0;       ///< Share of the messages that are outliers, in [0, 1].
  double frame_s = 1.0 / 30;      ///< Time of one frame, in s.
  std::vector<double> own_ar1{};  ///< First-order correlation of each channel; empty: ar1 and ar2 hold for all.
  /// Returns the noise with the correlations of one channel.
  /// @param channel Index of the channel.
  /// @return Copy; if own_ar1 is not empty, with ar1 of this channel and ar2 = 0.
  Noise of(std::size_t channel) const;
};

/// Coefficients that transform a series of errors into independent errors of unit variance:
/// white_i = (e_i - carry_i e_(i-1) - carry2_i e_(i-2)) * weight_i.
///
/// For second order this is the best prediction from two measurements. It is exact if no frame is missing.
/// If a measurement also has an independent error (Series::input_sd), the recursion carries the estimate of the noise
/// in it instead of e, as a Kalman filter does: the predicted error plus `gain` times the innovation (Anderson and
/// Moore 1979, Optimal Filtering, 5.3; for second order without the covariance of neighbouring estimates).
struct Whitening {
  std::vector<double> carry,  ///< Coefficient of the previous error; one per measurement.
      carry2,                 ///< Coefficient of the error before the previous one.
      weight;                 ///< Reciprocal standard deviation of the innovation, in 1 / (unit of the channel).
  std::vector<double> gain;   ///< Filter gain of each measurement, in [0, 1]; empty: 1.
  /// Returns the filter gain of one measurement.
  /// @param i Index of the measurement in its series.
  /// @return Gain, in [0, 1].
  double gain_at(std::size_t i) const { return gain.empty() ? 1 : gain[i]; }
};
/// Computes the whitening of one series.
/// @param series Series.
/// @param noise Correlations of the noise.
/// @param sigma Standard deviation of the channel, in its unit; 1: the result is relative to it.
/// @return Coefficients, one per measurement of \p series.
Whitening make_whitening(const Series& series, const Noise& noise, double sigma);

/// Whitens each column in place.
/// @param whitening Coefficients of the series.
/// @param[in,out] rows Matrix or vector whose rows are the measurements of the series in time.
template <class Matrix>
void whiten(const Whitening& whitening, Matrix&& rows) {
  if (!whitening.gain.empty()) {
    Eigen::RowVectorXd before = Eigen::RowVectorXd::Zero(rows.cols()), last = before, predicted;
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      predicted = whitening.carry[at] * last + whitening.carry2[at] * before;
      rows.row(i) -= predicted;
      before = last;
      last = predicted + whitening.gain[at] * rows.row(i);
      rows.row(i) *= whitening.weight[at];
    }
    return;
  }
  for (Eigen::Index i = rows.rows() - 1; i > 0; --i) {
    const auto at = static_cast<std::size_t>(i);
    rows.row(i) -= whitening.carry[at] * rows.row(i - 1);
    if (whitening.carry2[at] != 0) rows.row(i) -= whitening.carry2[at] * rows.row(i - 2);
    rows.row(i) *= whitening.weight[at];
  }
  if (rows.rows() > 0) rows.row(0) *= whitening.weight[0];
}

/// Errors of a model, indexed by recording and channel, in the channels' units.
using Errors = std::vector<std::vector<Eigen::VectorXd>>;

/// Computes the cubic B-spline basis of the flexible curve over a series. The intervals between knots are equal.
/// @param series Series; not empty.
/// @param knot_s Desired distance of the knots, in s. The distance is larger where the series has too few measurements:
/// the basis has at most a quarter as many functions as measurements, and at least 4.
/// @return Basis values, measurements x functions.
Eigen::MatrixXd spline_basis(const Series& series, double knot_s);
inline constexpr double kKnot_s = 1.0;  ///< Distance of the flexible curve's knots, in s.

/// Estimates standard deviations and autocorrelation jointly with the flexible curve, by restricted maximum likelihood.
/// @param data Dataset.
/// @param errors Errors of a model, per recording and channel of \p data.
/// @param second_order Whether to estimate ar2 too. It stays 0 unless the deviance falls by more than 10.8
/// (probability 0.001 by chance).
/// @return Noise with sigma, ar1, ar2 and frame_s; the rest has the default values.
Noise estimate_noise(const Dataset& data, const Errors& errors, bool second_order = true);

/// Second moments of the uncertain errors of a series: expected squares and products of neighbours. They suffice for
/// the expectation of whitened squares.
class ExpectedErrors {
 public:
  ExpectedErrors() = default;
  /// Makes the moments from a factor of the second-moment matrix.
  /// @param columns Factor: the expected product of two rows is the sum over the columns of their products. The columns
  /// are the most likely errors, and the change of the errors by one standard deviation in each uncertain direction.
  explicit ExpectedErrors(Eigen::MatrixXd columns);
  /// Computes the expected squares of the whitened errors.
  /// @param whitening Coefficients of the series.
  /// @return One expected square per row.
  Eigen::VectorXd whitened_squares(const Whitening& whitening) const;

 private:
  Eigen::MatrixXd columns_;
  Eigen::VectorXd square_, with_last_, with_one_before_;
};
/// Expected errors, indexed by recording and channel.
using ErrorsByChannel = std::vector<std::vector<ExpectedErrors>>;
/// Estimates the most likely sigma and ar1 for expected errors. All other values, ar2 among them, stay as they are.
/// @param data Dataset.
/// @param errors Expected errors, per recording and channel of \p data.
/// @param start Initial noise.
/// @return Refined noise.
Noise refine_noise(const Dataset& data, const ErrorsByChannel& errors, const Noise& start);
/// Tests whether two noise models differ so little that no result depends on the difference.
/// @param a First noise.
/// @param b Second noise, with as many channels.
/// @return True if ar1 and ar2 differ by at most 0.01, each sigma by at most 1 %, and the degrees of freedom are equal.
bool alike(const Noise& a, const Noise& b);

}  // namespace bevel::inference
