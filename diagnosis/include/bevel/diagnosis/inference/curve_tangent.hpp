// SPDX-License-Identifier: MIT
#pragma once
// Where a discrepancy is no small thing, its linear model about none is not enough: the readings, and their derivatives
// by its curves' values, about other values of them.
#include <memory>
#include <span>

#include <bevel/diagnosis/inference/system.hpp>

namespace bevel::inference {

struct CurveTangent {
  std::vector<CurveValues> about;
  Eigen::VectorXd values;                  // the same, one curve after the other
  std::vector<Eigen::MatrixXd> by_values;  // per recording: rows of the system x values
};

// What unknowns and values the derivatives are taken beside.
struct TangentPoint {
  const ModelSet& set;
  const Eigen::VectorXd& shared;
  const std::vector<Eigen::VectorXd>& local;
};
// Null outside the model's domain.
std::shared_ptr<const CurveTangent> make_tangent(const System& system, const TangentPoint& beside,
                                                 std::vector<CurveValues> about);

}  // namespace bevel::inference
