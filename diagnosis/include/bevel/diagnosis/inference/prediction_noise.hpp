// SPDX-License-Identifier: MIT
#pragma once
// The noise by which recordings are predicted: the likeliest of the readings' density with everything else integrated
// out, by the linear model about a fit, each channel with an autocorrelation of its own. Beside a set one
// autocorrelation has to do for all channels:
// where one of them drifts, it takes up in the others what recordings differ by.
//
// By expectation and maximisation (error_spread.hpp); the nuisances' standard deviations are the likeliest of the grid
// meanwhile.
#include <bevel/diagnosis/inference/predictive.hpp>

namespace bevel::inference {

// model: with the nuisances' mean or without. As it begins where it fails: outside the model's domain.
Noise prediction_noise(const LinearModel& model, const CurveColumns& curve);

}  // namespace bevel::inference
