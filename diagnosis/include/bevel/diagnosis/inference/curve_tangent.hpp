// SPDX-License-Identifier: MIT
/// @file
/// Derivatives of the measurements about non-zero curve values, for a discrepancy too large for the linear model about
/// zero.
#pragma once
#include <memory>
#include <span>

#include <bevel/diagnosis/inference/system.hpp>

namespace bevel::inference {

/// Curve values with the derivatives of the measurements by them.
struct CurveTangent {
  std::vector<CurveValues> about;          ///< Curve values at which the derivatives hold.
  Eigen::VectorXd values;                  ///< These values in one vector, curve after curve.
  std::vector<Eigen::MatrixXd> by_values;  ///< Derivatives per recording, all rows of the system x values.
};

/// Unknowns at which the derivatives are computed. The members refer to the caller's objects.
struct TangentPoint {
  const ModelSet& set;                        ///< Candidate model.
  const Eigen::VectorXd& shared;              ///< Shared unknowns.
  const std::vector<Eigen::VectorXd>& local;  ///< Local unknowns per recording.
};
/// Computes the derivatives about given curve values.
/// @param system Model.
/// @param beside Unknowns of the candidate model.
/// @param about Curve values.
/// @return Tangent; null outside the model's domain.
std::shared_ptr<const CurveTangent> make_tangent(const System& system, const TangentPoint& beside,
                                                 std::vector<CurveValues> about);

}  // namespace bevel::inference
