// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Predicted uncertainty of an open-loop prediction, from the between-insertion standard deviations and the standard
/// errors of the discrepancy terms. The propagation to the measurements is linear; it holds while the uncertainty is
/// small compared with the deflection.
#include <bevel/model/effects/discrepancy.hpp>
#include <bevel/model/effects/open_loop.hpp>
#include <bevel/model/effects/variation.hpp>

namespace bevel::model {

/// Computes the covariance of each position measurement about the prediction of predict(). The prediction is that of
/// the same needle with the effects, followed by the discrepancy terms.
/// @param needle needle parameters
/// @param effects effects of the model, at most kMaxEffects together with \p discrepancies
/// @param discrepancies discrepancy terms with standard errors
/// @param variation between-insertion standard deviations
/// @param motion actuator motion of the recording
/// @return one 3 x 3 covariance per measurement, mm^2 in {A}
/// @throws bevel::DomainError if the tip leaves the domain of the slip law (25)
/// @throws bevel::ArgumentError if there are too many effects, or a discrepancy term has a fault
std::vector<Eigen::Matrix3d> reading_covariances(const NeedleParameters& needle,
                                                 const std::vector<ActiveEffect>& effects,
                                                 const std::vector<DiscrepancyCurve>& discrepancies,
                                                 const Variation& variation, const Motion& motion);

}  // namespace bevel::model
