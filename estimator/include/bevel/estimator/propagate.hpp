// SPDX-License-Identifier: MIT
#pragma once
// Covariance of pose (6) and parameters through one step of the model: P <- F P F^T with F = [Phi G; 0 I].
#include <Eigen/Core>

#include <bevel/model/kinematics.hpp>

namespace bevel::estimator {

// In products of pairs of numbers: Eigen's general product would pack these small operands for its blocked kernel, and
// its lazy ones wait for what was just written in other widths; either takes more than twice as long as the arithmetic.
// Phi's lower left block of zeros is left out; one triangle is mirrored, so that P stays symmetric to the last bit.
template <int kSize>
void propagate(Eigen::Matrix<double, kSize, kSize>& P, const model::Matrix6d& Phi,
               const Eigen::Matrix<double, 6, kSize - 6>& G) {
  constexpr int kParameters = kSize - 6;
  using Pair = Eigen::Array2d;
  constexpr Eigen::Index kPairs = 5;  // of a row, the last half empty for nine
  Eigen::Array<double, 2 * kPairs, kSize> rows;
  rows.template topRows<kSize>() = P.array();  // symmetric: its columns are its rows
  if constexpr (kSize % 2) rows.template bottomRows<1>().setZero();
  const auto pair = [](const double* at) -> Pair { return Eigen::Map<const Pair, Eigen::Aligned16>(at); };

  // The first six rows of F P.
  Eigen::Array<double, 2 * kPairs, 6> FP;
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index c = 0; c < kPairs; ++c) {
      const double* column = rows.data() + 2 * c;
      Pair sum = G(i, 0) * pair(column + 12 * kPairs);
      for (Eigen::Index j = 1; j < kParameters; ++j) sum += G(i, j) * pair(column + (6 + j) * 2 * kPairs);
      for (Eigen::Index j = 3; j < 6; ++j) sum += Phi(i, j) * pair(column + j * 2 * kPairs);
      if (i < 3)
        for (Eigen::Index j = 0; j < 3; ++j) sum += Phi(i, j) * pair(column + j * 2 * kPairs);
      Eigen::Map<Pair, Eigen::Aligned16>(FP.data() + i * 2 * kPairs + 2 * c) = sum;
    }
  }
  // Times the transpose, by pairs of columns.
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double* row = FP.data() + i * 2 * kPairs;
    for (Eigen::Index c = i / 2; c < 3; ++c) {
      const auto column = [&](Eigen::Index j) -> Pair { return pair(Phi.data() + 6 * j + 2 * c); };
      Pair sum = row[3] * column(3);
      for (Eigen::Index j = 4; j < 6; ++j) sum += row[j] * column(j);
      for (Eigen::Index j = 0; j < kParameters; ++j) sum += row[6 + j] * pair(G.data() + 6 * j + 2 * c);
      if (c < 2)
        for (Eigen::Index j = 0; j < 3; ++j) sum += row[j] * column(j);
      P(2 * c, i) = P(i, 2 * c) = sum[0];
      P(2 * c + 1, i) = P(i, 2 * c + 1) = sum[1];
    }
    for (Eigen::Index c = 6; c < kSize; ++c) P(c, i) = P(i, c) = row[c];
  }
}

}  // namespace bevel::estimator
