// SPDX-License-Identifier: MIT
#pragma once
// How far off an open-loop prediction is to be expected: by what an insertion has of its own and by the standard errors
// of the discrepancies, carried to the readings by their sensitivities (linearised: right while the spread is small
// against the bend).
#include <bevel/model/effects/discrepancy.hpp>
#include <bevel/model/effects/open_loop.hpp>
#include <bevel/model/effects/variation.hpp>

namespace bevel::model {

// Covariance (mm^2) of each reading about what predict() gives for the same needle, effects and, behind them,
// discrepancies. Throws DomainError where the tip leaves the domain of the slip law.
std::vector<Eigen::Matrix3d> reading_covariances(const NeedleParameters& needle,
                                                 const std::vector<ActiveEffect>& effects,
                                                 const std::vector<DiscrepancyCurve>& discrepancies,
                                                 const Variation& variation, const Motion& motion);

}  // namespace bevel::model
