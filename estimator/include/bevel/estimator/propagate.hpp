// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Propagation of the covariance through one step of the model.
#include <Eigen/Core>

#include <bevel/model/kinematics.hpp>

namespace bevel::estimator {

/// Propagates the covariance of pose (6) and parameters through one step: P <- F P F^T with F = [Phi G; 0 I].
///
/// The products are written in pairs of numbers, in less than half the time of Eigen's blocked and lazy products for
/// these sizes. The lower left block of Phi, which is zero, is skipped. One triangle is mirrored, so P stays exactly
/// symmetric.
/// @tparam kSize number of error states, 9 or 10
/// @param P covariance before and after the step, shape (kSize, kSize)
/// @param Phi derivative of the pose by the error of the previous pose, body frame (mm | rad), shape (6, 6)
/// @param G derivative of the pose by the parameters, shape (6, kSize - 6)
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
