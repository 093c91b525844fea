#pragma once
// The noise by which recordings are predicted: the likeliest of the readings' density with everything else integrated
// out, by the linear model about a fit, each channel with an autocorrelation of its own. Beside a set the noise is that
// of the residuals at the mode, which the fit has made smaller, and one autocorrelation has to do for all channels:
// where one of them drifts, it takes up in the others what recordings differ by.
//
// By expectation and maximisation (Dempster, Laird and Rubin 1977, J. R. Stat. Soc. B 39; for variance components Laird
// and Ware 1982, Biometrics 38): expected squares of the errors are those at the mode and those of the unknowns' spread
// about it; the nuisances' standard deviations are the likeliest of the grid meanwhile.
#include "diagnosis/inference/predictive.hpp"

namespace bevel::inference {

// model: with the nuisances' mean or without. As it begins where it fails: outside the model's domain.
Noise prediction_noise(const LinearModel& model, const CurveColumns& curve);

}  // namespace bevel::inference
