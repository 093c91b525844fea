// SPDX-License-Identifier: MIT
#pragma once
// The Kalman update that every kind of reading ends in: a residual of three numbers, of which some axes are seen.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>

#include <bevel/estimator/error_state.hpp>

namespace bevel::estimator {

// Information below this share of the largest is an axis that the camera does not see.
inline constexpr double kRankTolerance = 1e-9;
// Readings that share the error of a discrepancy: at 30 Hz and some 10 mm/s those of ten millimetres, about a knot.
inline constexpr double kReadingsOfOneError = 30;

// The axes along which a measurement has information, in the last `rank` columns, and its variance along them.
struct SeenAxes {
  Eigen::Matrix3d axes;
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  Eigen::Vector3d shared = Eigen::Vector3d::Zero();    // more of it, of an error that neighbouring readings share
  Eigen::Vector3d coloured = Eigen::Vector3d::Zero();  // more of it, of the three SharedErrors from `first_error`
  int first_error = 0;
  int rank = 0;
};

// `by_state`: derivative of what is seen by the first columns of the error; R of the pose if it is the tip itself.
template <int kSize, int kRank, int kColumns>
Update update_rank(FilterState& state, const Eigen::Matrix<double, 3, kColumns>& by_state, const SeenAxes& seen,
                   const Eigen::Vector3d& residual, double gate) {
  using Vec = Eigen::Matrix<double, kRank, 1>;
  using Mat = Eigen::Matrix<double, kRank, kRank>;
  const auto axes = seen.axes.template rightCols<kRank>();
  Vec variance = (seen.variance + seen.shared).template tail<kRank>();
  const Eigen::Matrix<double, kRank, kColumns> H = axes.transpose() * by_state;
  const auto& covariance = covariance_of<kSize>(state);
  // Derivative by the shared errors of the camera, which are along the axes of {A}.
  using ByErrors = Eigen::Matrix<double, kRank, 3>;
  const Eigen::Index first = kOwn<kSize> + seen.first_error;
  ByErrors by_errors;
  if constexpr (kSize > 10)
    by_errors = seen.coloured.template tail<kRank>().cwiseSqrt().asDiagonal() * axes.transpose();
  const auto times_derivative = [&](const Covariance<kSize>& of) {
    Eigen::Matrix<double, kSize, kRank> product = of.template leftCols<kColumns>().lazyProduct(H.transpose());
    if constexpr (kSize > 10) product += of.template middleCols<3>(first).lazyProduct(by_errors.transpose());
    return product;
  };
  const Eigen::Matrix<double, kSize, kRank> PHt = times_derivative(covariance);
  Mat S = H * PHt.template topRows<kColumns>();
  if constexpr (kSize > 10) S += by_errors * PHt.template middleRows<3>(first);
  S.diagonal() += variance;
  Eigen::LLT<Mat> llt(S);
  Vec y = axes.transpose() * residual;
  if constexpr (kSize > 10) y -= by_errors * state.shared.mean.template segment<3>(seen.first_error);
  const Vec whitened = llt.matrixL().solve(y);

  Update result;
  result.rank = kRank;
  result.mahalanobis2 = whitened.squaredNorm();
  result.test_ratio = result.mahalanobis2 / gate;
  result.innovation.head<kRank>() = y;
  result.innovation_whitened.head<kRank>() = whitened;
  result.accepted = result.test_ratio <= 1;  // false for a NaN too
  if (!result.accepted) return result;

  if (seen.shared != Eigen::Vector3d::Zero()) {
    // The gate asks about one reading. The gain must not average away over many what they have in common: each then
    // counts for its part of one.
    const Vec more = (kReadingsOfOneError - 1) * seen.shared.template tail<kRank>();
    variance += more;
    S.diagonal() += more;
    llt.compute(S);
  }
  // By the inverse of a triangle of no more than three rows: Eigen's solver for the nine right sides is a blocked one.
  const Mat inverse_L = llt.matrixL().solve(Mat::Identity());
  const Eigen::Matrix<double, kSize, kRank> whitened_PHt = PHt.lazyProduct(inverse_L.transpose());
  const Eigen::Matrix<double, kSize, kRank> K = whitened_PHt.lazyProduct(inverse_L);
  const Error<kSize> correction = K * y;
  // Joseph form, (I - K H) P (I - K H)^T + K R K^T, with H only in its first columns; small products written out.
  Covariance<kSize> P = covariance;
  P.noalias() -= K.lazyProduct(PHt.transpose());
  Eigen::Matrix<double, kSize, kRank> PHt2 = times_derivative(P);
  PHt2 -= K * variance.asDiagonal();
  P.noalias() -= PHt2.lazyProduct(K.transpose());
  set_covariance<kSize>(state, 0.5 * (P + P.transpose()));
  move<kSize>(state, correction);
  state.pose.R = model::orthonormalised(state.pose.R);
  return result;
}

template <int kSize, int kColumns>
Update update_seen(FilterState& state, const Eigen::Matrix<double, 3, kColumns>& by_state, const SeenAxes& seen,
                   const Eigen::Vector3d& residual, const std::array<double, 3>& gate) {
  switch (seen.rank) {
    case 1:
      return update_rank<kSize, 1, kColumns>(state, by_state, seen, residual, gate[0]);
    case 2:
      return update_rank<kSize, 2, kColumns>(state, by_state, seen, residual, gate[1]);
    case 3:
      return update_rank<kSize, 3, kColumns>(state, by_state, seen, residual, gate[2]);
    default:
      return {};
  }
}

// The same of all states, those of the rig included, in one function for every rank: an axis that is not seen is a row
// of zeros. `by_state`: by the state's own ten; `by_nuisance`: by the nuisance states, of which the residual has the
// mean.
Update update_all(FilterState& state, const Eigen::Matrix<double, 3, 10>& by_state, const ByNuisance& by_nuisance,
                  const SeenAxes& seen, const Eigen::Vector3d& residual, const std::array<double, 3>& gate);

// The x across `along` with information x = left, where that is singular along it: nothing along it, nor along an axis
// that is not seen.
inline Eigen::Vector3d solve_across(const Eigen::Matrix3d& information, const Eigen::Vector3d& along,
                                    const Eigen::Vector3d& left) {
  const Eigen::Matrix3d bounded =
      information + information.trace() * (along * along.transpose() + kRankTolerance * Eigen::Matrix3d::Identity());
  return bounded.inverse() * left;
}

}  // namespace bevel::estimator
