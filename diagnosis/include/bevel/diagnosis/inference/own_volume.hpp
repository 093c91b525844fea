// SPDX-License-Identifier: MIT
#pragma once
// The mode of the shared unknowns where what each recording has of its own is integrated out, not fitted.
//
// Where all are fitted together, the mode goes where a recording's own unknowns move its readings most: there they take
// up most of the noise. Of what is integrated out that is paid for by the volume, log det(L_r' L_r + T_r): its slopes
// by the shared unknowns are the bias of the joint mode (Lee and Nelder 1996, J. R. Stat. Soc. B 58, adjusted profile
// h-likelihood; Tierney and Kadane 1986, JASA 81). Without such unknowns, or where L does not depend on the shared
// ones, the two are one.
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

// Sum over recordings of log det(L_r' L_r + T_r) - log det T_r.
double log_own_volume(const std::vector<ArrowBlock>& blocks);

// From a joint mode on, by Gauss and Newton's steps in the shared unknowns, the recordings' own at their mode for each:
// the least of cost + log_own_volume(). The fit carries the slopes that it is stationary with (Fit::own_volume). One
// that is not valid comes back as it is. Shapes have no slopes: readings are no smooth function of them. curve_at: of
// the fit's curves, as fit_from() has it.
Fit with_own_integrated(Fit fit, const CurveAt& curve_at);

}  // namespace bevel::inference
