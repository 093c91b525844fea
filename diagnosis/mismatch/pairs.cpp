#include "diagnosis/mismatch/pairs.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace bevel::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRidge = 1e-9;  // of a column's square: two of one signature are no more than one

// Fall of chi2 by any combination of the columns.
double joint_gain(const MatrixXd& columns, const VectorXd& residual) {
  MatrixXd gram = columns.transpose() * columns;
  gram.diagonal() *= 1 + kRidge;
  const VectorXd projected = columns.transpose() * residual;
  return projected.dot(gram.ldlt().solve(projected));
}

}  // namespace

std::vector<std::array<std::size_t, 2>> best_pairs(const std::vector<Candidate>& candidates, const Ground& ground,
                                                   std::size_t count) {
  std::vector<const Signature*> signatures(candidates.size(), nullptr);
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (candidates[i].local < 0) signatures[i] = most_promising_start(candidates[i], ground).signature;
  std::vector<std::pair<double, std::array<std::size_t, 2>>> pairs;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (!signatures[i] || !signatures[j]) continue;
      if (candidates[i].member.effect == candidates[j].member.effect) continue;
      MatrixXd both(ground.residual.size(), signatures[i]->columns.cols() + signatures[j]->columns.cols());
      both << signatures[i]->columns, signatures[j]->columns;
      if (!(both.colwise().squaredNorm().minCoeff() > 0)) continue;
      pairs.emplace_back(joint_gain(both, ground.residual), std::array{i, j});
    }
  std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  if (pairs.size() > count) pairs.resize(count);
  std::vector<std::array<std::size_t, 2>> out;
  for (const auto& [gain, pair] : pairs) out.push_back(pair);
  return out;
}

}  // namespace bevel::diagnosis
