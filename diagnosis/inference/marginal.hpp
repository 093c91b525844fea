#pragma once
// What a fit leaves to columns that are not in it: its shared unknowns, each recording's own and its curve integrated
// out, with their priors, by the linear model about it (the null-space projection of least squares, where the priors
// are flat).
#include "diagnosis/inference/likelihood.hpp"

namespace bevel::inference {

class Marginal {
 public:
  // columns_by: by what the columns are whitened, if by another likelihood, of the same noise without the errors of
  // this one's inputs (with_inputs_of). Their rows have as much less weight then as those make them uncertain: exact
  // for white noise.
  Marginal(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
           const Likelihood* columns_by = nullptr);
  // False outside the model's domain.
  bool valid() const { return solution_.valid; }
  std::size_t recordings() const { return blocks_.size(); }
  const ModelSet& set() const { return set_; }
  // Covariance of the shared unknowns, the curve's values last, and the step from the fit to their mode.
  const Eigen::MatrixXd& covariance() const { return solution_.covariance; }
  const Eigen::VectorXd& step() const { return solution_.shared; }

  // Inner products of a recording's columns X (whitened) with what is left once its own unknowns are integrated out;
  // those that all recordings share are still in: `across` is by them.
  struct Part {
    Eigen::MatrixXd own, by_own;              // X'L (L'L + T)^-1, X'L
    Eigen::MatrixXd across;                   // X'MZ
    Eigen::VectorXd pull;                     // X'Mw
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
  ModelSet set_;
  std::vector<ArrowBlock> blocks_;
  std::vector<Eigen::MatrixXf> LZ_;  // [L Z] per recording
  std::vector<Eigen::VectorXf> w_;
  std::vector<Eigen::VectorXf> weight_;  // of the rows of columns; empty: one. LZ_ and w_ have it already
  std::vector<Eigen::MatrixXd> inner_;   // (L'L + T)^-1
  std::vector<Eigen::VectorXd> pull_;    // L'w and the prior's part
  ArrowSolution solution_;
};

}  // namespace bevel::inference
