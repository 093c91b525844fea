#pragma once
// Covariance of pose (6) and parameters through one step of the model: P <- F P F^T with F = [Phi G; 0 I].
#include <Eigen/Core>

#include "model/kinematics.hpp"

namespace bevel::estimator {

// By blocks and row by row, products written out: Eigen's general product would pack these small operands for its
// blocked kernel, which takes several times as long as the arithmetic. Phi keeps its lower left block of zeros.
template <int kSize>
void propagate(Eigen::Matrix<double, kSize, kSize>& P, const model::Matrix6d& Phi,
               const Eigen::Matrix<double, 6, kSize - 6>& G) {
  constexpr int kParameters = kSize - 6;
  using Rows3x6 = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;
  using Rows6x6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  using Rows6xN = Eigen::Matrix<double, 6, kParameters, Eigen::RowMajor>;
  using RowsNx6 = Eigen::Matrix<double, kParameters, 6, Eigen::RowMajor>;
  const Eigen::Matrix3d R = Phi.topLeftCorner<3, 3>();
  const Eigen::Matrix3d X = Phi.topRightCorner<3, 3>();
  const Eigen::Matrix3d Y = Phi.bottomRightCorner<3, 3>();
  const Rows3x6 top = P.template topLeftCorner<3, 6>();
  const Rows3x6 bottom = P.template block<3, 6>(3, 0);
  const RowsNx6 by_parameters = P.template bottomLeftCorner<kParameters, 6>();
  const Rows6xN cross = P.template topRightCorner<6, kParameters>();

  Rows6x6 FP;  // rows of F P that belong to the pose: its columns of the pose, then those of the parameters
  FP.noalias() = G.lazyProduct(by_parameters);
  FP.template topRows<3>().noalias() += R.lazyProduct(top);
  FP.template topRows<3>().noalias() += X.lazyProduct(bottom);
  FP.template bottomRows<3>().noalias() += Y.lazyProduct(bottom);
  Rows6xN moved;
  moved.noalias() = G.lazyProduct(P.template bottomRightCorner<kParameters, kParameters>());
  moved.template topRows<3>().noalias() += R.lazyProduct(cross.template topRows<3>());
  moved.template topRows<3>().noalias() += X.lazyProduct(cross.template bottomRows<3>());
  moved.template bottomRows<3>().noalias() += Y.lazyProduct(cross.template bottomRows<3>());

  const Rows6x6 Phi_t = Phi.transpose();
  const RowsNx6 G_t = G.transpose();
  Rows6x6 pose;
  pose.noalias() = FP.lazyProduct(Phi_t);
  pose.noalias() += moved.lazyProduct(G_t);
  P.template topLeftCorner<6, 6>() = 0.5 * (pose + pose.transpose());
  P.template topRightCorner<6, kParameters>() = moved;
  P.template bottomLeftCorner<kParameters, 6>() = moved.transpose();
}

}  // namespace bevel::estimator
