// SPDX-License-Identifier: MIT
/// @file
/// Likelihood of additional columns about a fit. The shared unknowns, the local unknowns and the curves are integrated
/// out with their priors, by the linear model (with flat priors: the null-space projection of least squares).
#pragma once
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

/// Linear model about a fit with all its unknowns integrated out.
class Marginal {
 public:
  /// Computes the projections.
  /// @param likelihood Likelihood of the fit.
  /// @param fit Fit.
  /// @param curve Columns of the fit's curves.
  /// @param columns_by Likelihood that whitens the additional columns; null: \p likelihood. It has the same noise
  /// without the uncertain inputs (with_inputs_of()). The weight of each row decreases by that uncertainty: exact for
  /// white noise.
  Marginal(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
           const Likelihood* columns_by = nullptr);
  /// Tests whether the fit is inside the model's domain.
  /// @return False outside the model's domain.
  bool valid() const { return valid_; }
  /// Counts the recordings.
  /// @return Number of recordings.
  std::size_t recordings() const { return own_.size(); }
  /// Returns the candidate model of the fit.
  /// @return Candidate model.
  const ModelSet& set() const { return set_; }
  /// Returns the step from the fit to the mode of the linear model.
  /// @return Shared unknowns, then curve values.
  const Eigen::VectorXd& step() const { return step_; }
  /// Returns R, a root of the covariance R R' of the shared unknowns and curve values.
  /// @return Square matrix.
  const Eigen::MatrixXd& root() const { return root_; }

  /// Inner products of a recording's whitened columns X after its local unknowns are integrated out. The shared
  /// unknowns are not integrated out: `across` describes them in units of R.
  struct Part {
    Eigen::MatrixXd own;                      ///< X'Q, where QQ' = L (L'L + T)^-1 L'.
    Eigen::MatrixXd across;                   ///< X'MZR.
    Eigen::VectorXd pull;                     ///< X'M(w - Z step).
    const Eigen::VectorXf* weight = nullptr;  ///< Weights of the rows; null: one.
    /// Computes X'MX of a range of columns.
    /// @param X Whitened columns.
    /// @param first First column.
    /// @param size Number of columns.
    /// @return Square matrix.
    Eigen::MatrixXd square(const Eigen::MatrixXf& X, Eigen::Index first, Eigen::Index size) const;
    /// Computes the diagonal of X'MX for all columns.
    /// @param X Whitened columns.
    /// @return One element per column.
    Eigen::VectorXd squares(const Eigen::MatrixXf& X) const;
  };
  /// Computes the inner products of one recording.
  /// @param recording Index of the recording.
  /// @param X Whitened columns, rows x columns.
  /// @return Inner products; valid as long as this object.
  Part part(std::size_t recording, const Eigen::MatrixXf& X) const;

  /// Quadratic log likelihood of the columns' sizes c relative to zero: pull'c - c' square c / 2.
  struct Added {
    Eigen::MatrixXd square;  ///< Information matrix.
    Eigen::VectorXd pull;    ///< Gradient at zero.
  };
  /// Sums the inner products over all recordings and integrates all unknowns of the fit out.
  /// @param X Whitened columns per recording; not empty.
  /// @return Quadratic log likelihood.
  Added added(const std::vector<Eigen::MatrixXf>& X) const;

 private:
  // Q removes the local unknowns and MZR the shared ones. Both are orthogonal projections, so no product is larger than
  // the columns. Where paths diverge, derivatives reach 1e9: their inner products in single precision, or normal
  // equations, would lose all digits.
  ModelSet set_;
  std::vector<Eigen::MatrixXf> own_, shared_;  // Q and MZR, per recording
  std::vector<Eigen::VectorXf> left_;          // w - L l - Z z at the mode
  std::vector<Eigen::VectorXf> weight_;        // of the columns' rows; empty: one. Already applied to the members above
  Eigen::VectorXd step_;
  Eigen::MatrixXd root_;
  bool valid_ = false;
};

}  // namespace bevel::inference
