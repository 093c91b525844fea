// SPDX-License-Identifier: MIT
#pragma once
// What a fit leaves to columns that are not in it: its shared unknowns, each recording's own and its curve integrated
// out, with their priors, by the linear model about it (the null-space projection of least squares, where the priors
// are flat).
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

class Marginal {
 public:
  // columns_by: by what the columns are whitened, if by another likelihood, of the same noise without the errors of
  // this one's inputs (with_inputs_of). Their rows have as much less weight then as those make them uncertain: exact
  // for white noise.
  Marginal(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
           const Likelihood* columns_by = nullptr);
  // False outside the model's domain.
  bool valid() const { return valid_; }
  std::size_t recordings() const { return own_.size(); }
  const ModelSet& set() const { return set_; }
  // The step from the fit to the mode of the shared unknowns, the curve's values last; and R: their covariance is RR'.
  const Eigen::VectorXd& step() const { return step_; }
  const Eigen::MatrixXd& root() const { return root_; }

  // Inner products of a recording's columns X (whitened) with what is left at the mode, once its own unknowns are
  // integrated out; those that all recordings share are still in: `across` is by them, in units of R.
  struct Part {
    Eigen::MatrixXd own;                      // X'Q, where QQ' = L (L'L + T)^-1 L'
    Eigen::MatrixXd across;                   // X'MZR
    Eigen::VectorXd pull;                     // X'M(w - Z step)
    const Eigen::VectorXf* weight = nullptr;  // of the rows; null: one
    // X'MX of columns [first, first + size); its diagonal for all of them.
    Eigen::MatrixXd square(const Eigen::MatrixXf& X, Eigen::Index first, Eigen::Index size) const;
    Eigen::VectorXd squares(const Eigen::MatrixXf& X) const;
  };
  Part part(std::size_t recording, const Eigen::MatrixXf& X) const;

  // Summed over recordings: square and pull with everything integrated out. The logarithm of the likelihood of the
  // columns' sizes c, relative to none, is pull'c - c' square c / 2.
  struct Added {
    Eigen::MatrixXd square;
    Eigen::VectorXd pull;
  };
  Added added(const std::vector<Eigen::MatrixXf>& X) const;

 private:
  // By rows that are orthogonal to what they leave out, a recording's own unknowns by Q and the shared ones by MZR, all
  // products are no larger than the columns: where paths diverge, derivatives are 10^9, and of their own products in
  // single precision, or of normal equations, nothing is left.
  ModelSet set_;
  std::vector<Eigen::MatrixXf> own_, shared_;  // Q and MZR, per recording
  std::vector<Eigen::VectorXf> left_;          // w - L l - Z z at the mode
  std::vector<Eigen::VectorXf> weight_;        // of the rows of columns; empty: one. All of the above have it already
  Eigen::VectorXd step_;
  Eigen::MatrixXd root_;
  bool valid_ = false;
};

}  // namespace bevel::inference
