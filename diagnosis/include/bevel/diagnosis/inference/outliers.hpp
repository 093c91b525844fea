// SPDX-License-Identifier: MIT
#pragma once
// Readings that belong to nothing, and the noise without them: what a flexible curve leaves of a model's errors.
#include <bevel/diagnosis/inference/noise.hpp>

namespace bevel::inference {

struct Calibration {
  Noise noise;
  Readings outliers;  // ascending
};

// errors: of the model in use, of which a flexible curve is taken out.
Calibration calibrate_noise(const Dataset& data, const Errors& errors);

}  // namespace bevel::inference
