// SPDX-License-Identifier: MIT
/// @file
/// Noise for the prediction of recordings: each channel has its own autocorrelation, and all other unknowns are
/// integrated out by the linear model about a fit.
///
/// The noise of a candidate model has one autocorrelation for all channels. If one channel drifts, that autocorrelation
/// absorbs differences between recordings in the others. The method is expectation and maximisation (error_spread.hpp)
/// at the most likely between-insertion standard deviations of the grid.
#pragma once
#include <bevel/diagnosis/inference/predictive.hpp>

namespace bevel::inference {

/// Estimates the noise for predictions.
/// @param model Linear model, with or without a mean of the insertion-specific parameters.
/// @param curve Columns of the fit's curves.
/// @return Noise; the initial noise outside the model's domain.
Noise prediction_noise(const LinearModel& model, const CurveColumns& curve);

}  // namespace bevel::inference
