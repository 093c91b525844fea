// SPDX-License-Identifier: MIT
#pragma once
// The noise to begin with and the outliers: what a flexible curve leaves beside the base alone.
#include <bevel/diagnosis/inference/likelihood.hpp>
#include <bevel/diagnosis/inference/outliers.hpp>

namespace bevel::inference {

// The base alone fitted from the middle of its priors, by a white noise that begins as large as what the base leaves
// there and falls with it to `noise` at most: by a noise much smaller than the misfit, a fit may run into any local
// minimum. Not valid where the base cannot follow the recordings.
Fit tempered_base(const System& system, const Readings& outliers, const Noise& noise);

// From the standard deviations that the data claim. Throws DomainError where the base alone cannot follow the
// recordings.
Calibration calibrate(const System& system);

}  // namespace bevel::inference
