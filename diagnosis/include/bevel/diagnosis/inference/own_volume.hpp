// SPDX-License-Identifier: MIT
/// @file
/// Mode of the shared unknowns with the local unknowns of each recording integrated out instead of fitted.
///
/// A joint mode moves to where the local unknowns change the measurements most, because they absorb most noise there.
/// Integration compensates this by the volume log det(L_r' L_r + T_r). Its slopes by the shared unknowns are the bias
/// of the joint mode (Lee and Nelder 1996, J. R. Stat. Soc. B 58, adjusted profile h-likelihood; Tierney and Kadane
/// 1986, JASA 81). Without local unknowns, or where L does not depend on the shared ones, both modes are equal.
#pragma once
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

/// Computes the log volume of the local unknowns.
/// @param blocks Normal equations.
/// @return Sum over recordings of log det(L_r' L_r + T_r) - log det T_r.
double log_own_volume(const std::vector<ArrowBlock>& blocks);

/// Minimises cost + log_own_volume() from a joint mode, by Gauss-Newton steps in the shared unknowns with the local
/// ones at their mode for each. Shape parameters have no slopes, because the predictions are not smooth in them.
/// @param fit Joint mode.
/// @param curve_at Columns of the fit's curves, as for fit_from().
/// @return Fit with the slopes at which it is stationary (Fit::own_volume); \p fit itself if it is not valid.
Fit with_own_integrated(Fit fit, const CurveAt& curve_at);

}  // namespace bevel::inference
