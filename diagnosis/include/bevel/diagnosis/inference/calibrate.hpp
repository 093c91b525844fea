// SPDX-License-Identifier: MIT
/// @file
/// Initial noise estimate and outliers, from the residuals of a flexible curve fitted to the nominal model's errors.
#pragma once
#include <bevel/diagnosis/inference/likelihood.hpp>
#include <bevel/diagnosis/inference/outliers.hpp>

namespace bevel::inference {

/// Fits the nominal model alone from the centre of its priors.
///
/// The fit uses white noise that starts as large as the residuals and decreases to \p noise. With noise much smaller
/// than the misfit a fit may end in any local minimum.
/// @param system Model and data.
/// @param outliers Messages to leave out, ascending, per recording.
/// @param noise Final noise.
/// @return Fit; not valid where the nominal model cannot follow the recordings.
Fit tempered_base(const System& system, const Readings& outliers, const Noise& noise);

/// Estimates the noise and the outliers, from the claimed standard deviations on.
/// @param system Model and data.
/// @return Noise and outliers.
/// @throws bevel::DomainError if the nominal model cannot follow the recordings.
Calibration calibrate(const System& system);

}  // namespace bevel::inference
