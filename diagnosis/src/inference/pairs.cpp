// SPDX-License-Identifier: MIT
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/diagnosis/inference/proposals.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

VectorXd Proposals::prior_precision(const Side& side) const {
  const Candidate& candidate = candidates_[side.effect];
  VectorXd out = VectorXd::Ones(side.width);
  for (std::size_t a = 0; a < candidate.amplitudes.size(); ++a) {
    const Parameter& p = system_->effects()[side.effect].parameters[candidate.amplitudes[a]];
    const double unit =
        candidate.signatures[side.signature].values[static_cast<Index>(candidate.amplitudes[a])] - p.none;
    out[static_cast<Index>(a)] = unit * unit * precision_of(p.prior);
  }
  return out;
}

std::vector<MatrixXf> Proposals::side_by_side(std::vector<Side>& sides) const {
  Index columns = 0;
  for (Side& side : sides) {
    side.first = columns;
    side.width = candidates_[side.effect].width();
    columns += side.width;
  }
  std::vector<MatrixXf> out;
  for (std::size_t r = 0; !sides.empty() && r < candidates_[sides.front().effect].columns.size(); ++r) {
    MatrixXf X(candidates_[sides.front().effect].columns[r].rows(), columns);
    for (const Side& side : sides) {
      const Candidate& candidate = candidates_[side.effect];
      Index from = candidate.signatures[side.signature].first;
      if (candidate.local >= 0) {
        const auto choices = static_cast<Index>(candidate.choices[r].size());
        from = from * choices + choices / 2;
      }
      X.middleCols(side.first, side.width) = candidate.columns[r].middleCols(from, side.width);
    }
    out.push_back(std::move(X));
  }
  return out;
}

std::vector<std::pair<double, ModelSet>> Proposals::pairs(const Marginal& base, std::size_t count) const {
  std::vector<Side> sides;
  for (const Proposal& one : beside(base, 1))
    if (candidates_[one.effect].local < 0 && !one.starts.empty())
      sides.push_back({.effect = one.effect, .signature = nearest_signature(one)});
  std::vector<std::pair<double, ModelSet>> out;
  if (sides.empty()) return out;
  const Marginal::Added all = base.added(side_by_side(sides));
  for (std::size_t i = 0; i < sides.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const ModelSet set = with({sides[i].effect}, sides[j].effect);
      if (!system_->allows(set)) continue;
      std::vector<Index> both;
      for (const Side& side : {sides[i], sides[j]})
        for (Index a = 0; a < side.width; ++a) both.push_back(side.first + a);
      VectorXd prior(static_cast<Index>(both.size()));
      prior << prior_precision(sides[i]), prior_precision(sides[j]);
      MatrixXd square = all.square(both, both);
      square.diagonal() += prior;
      const VectorXd pull = all.pull(both);
      const Eigen::LDLT<MatrixXd> factor(square);
      out.emplace_back(0.5 * (pull.dot(factor.solve(pull)) + prior.array().log().sum() -
                              factor.vectorD().array().max(1e-300).log().sum()),
                       set);
    }
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  if (out.size() > count) out.resize(count);
  return out;
}

// The signature whose shape is nearest to that of the best start, sizes apart.
std::size_t Proposals::nearest_signature(const Proposal& proposal) const {
  const Effect& effect = system_->effects()[proposal.effect];
  const auto& signatures = candidates_[proposal.effect].signatures;
  std::size_t best = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t s = 0; s < signatures.size(); ++s) {
    double apart = 0;
    Index i = 0;
    for (std::size_t p = 0; p < effect.parameters.size(); ++p) {
      if (effect.parameters[p].scope != Scope::shared) continue;
      const double difference = signatures[s].values[static_cast<Index>(p)] - proposal.starts.front().shared[i++];
      if (!is_size(effect.parameters[p])) apart += difference * difference;
    }
    if (apart < nearest) nearest = apart, best = s;
  }
  return best;
}

}  // namespace bevel::inference
