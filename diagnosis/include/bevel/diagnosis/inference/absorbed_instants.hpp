// SPDX-License-Identifier: MIT
/// @file
/// Events that occurred in some recordings and that the insertion-specific parameters absorbed.
#pragma once
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

/// Scans every event time again from insertion-specific parameters that are equal in all recordings.
///
/// The scan uses the effect size with the least total cost over all recordings; then all other unknowns are fitted.
/// This finds events in some recordings that the insertion-specific parameters absorbed. The common size also corrects
/// a recording that alone has a wrong one.
/// @param likelihood Likelihood.
/// @param curve Columns of the fit's curves.
/// @param[in,out] fitted Fit.
void look_from_alike(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

}  // namespace bevel::inference
