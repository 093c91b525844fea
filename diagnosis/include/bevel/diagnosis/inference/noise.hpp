// SPDX-License-Identifier: MIT
#pragma once
// The sensors' noise: autocorrelated, of first order or second, one standard deviation per channel, and a share of
// outliers. It begins as what a flexible curve leaves of the residuals, so that missing physics does not pass for
// noise; the evidence of each set then fits it anew (refine_noise, error_spread.hpp). Source: restricted maximum
// likelihood, Harville 1977, JASA 72; AR(1) over gaps as an Ornstein-Uhlenbeck process, AR(2) by its partial
// correlations (Barndorff-Nielsen and Schou 1973, J. Multivar. Anal. 3).
#include <span>
#include <vector>

#include <bevel/diagnosis/inference/dataset.hpp>
#include <bevel/diagnosis/inference/heavy_tails.hpp>

namespace bevel::inference {

struct Noise {
  std::vector<double> sigma;    // per channel, of one reading (the process's own)
  double ar1 = 0;               // correlation of readings one frame apart
  double ar2 = 0;               // of readings two frames apart, given the one between; 0: of first order
  Tails tails{};                // of the innovations
  bool tails_are_open = false;  // whether how heavy they are is fitted with the rest; else they stay as they are
  double outlier_share = 0;     // of messages
  double frame_s = 1.0 / 30;
  std::vector<double> own_ar1{};  // per channel, where each has one of its own, of first order; empty: ar1, ar2 of all
  // What it is of one channel.
  Noise of(std::size_t channel) const;
};

// Coefficients that turn a series of errors into independent ones of unit variance:
// white_i = (e_i - carry_i e_(i-1) - carry2_i e_(i-2)) * weight_i.
// Of second order it is the best that two readings predict: exact where no frame is missing.
// Where a reading also has an error of its own (Series::input_sd), what is carried on is not e but the noise in it, as
// a Kalman filter takes it: the error predicted and `gain` of what was not (Anderson and Moore 1979, Optimal Filtering,
// 5.3; of second order but for the covariance of neighbouring estimates).
struct Whitening {
  std::vector<double> carry, carry2, weight;
  std::vector<double> gain;  // empty: one
  double gain_at(std::size_t i) const { return gain.empty() ? 1 : gain[i]; }
};
Whitening make_whitening(const Series& series, const Noise& noise, double sigma);

// In place, on each column; rows are the series in time.
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

// Errors of a model per recording and channel, in the channels' units.
using Errors = std::vector<std::vector<Eigen::VectorXd>>;

// Cubic B-splines over a series with a knot about every knot_s seconds: the flexible curve. Rows are readings.
Eigen::MatrixXd spline_basis(const Series& series, double knot_s);
inline constexpr double kKnot_s = 1.0;

// Deviation and autocorrelation alone, beside the curve. With second_order, ar2 too, where the readings ask for it.
Noise estimate_noise(const Dataset& data, const Errors& errors, bool second_order = true);

// Errors of a series that are not known for sure, by the expectations of their squares and of the products of
// neighbours: what an expectation of whitened squares needs.
class ExpectedErrors {
 public:
  ExpectedErrors() = default;
  // The expected product of two rows is the sum over the columns of theirs: the likeliest errors, and what each
  // direction in which they are uncertain does to them in one standard deviation.
  explicit ExpectedErrors(Eigen::MatrixXd columns);
  Eigen::VectorXd whitened_squares(const Whitening& whitening) const;  // of each row

 private:
  Eigen::MatrixXd columns_;
  Eigen::VectorXd square_, with_last_, with_one_before_;
};
using ErrorsByChannel = std::vector<std::vector<ExpectedErrors>>;  // per recording and channel
// The likeliest noise of such errors, of the order that it begins with.
Noise refine_noise(const Dataset& data, const ErrorsByChannel& errors, const Noise& start);
// So near that nothing depends on the difference.
bool alike(const Noise& a, const Noise& b);

}  // namespace bevel::inference
