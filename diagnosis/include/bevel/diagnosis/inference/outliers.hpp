// SPDX-License-Identifier: MIT
/// @file
/// Detection of outliers, and the noise without them, from a model's errors after a flexible curve was removed.
#pragma once
#include <bevel/diagnosis/inference/noise.hpp>

namespace bevel::inference {

/// Initial noise and outliers.
struct Calibration {
  Noise noise;        ///< Noise without the outliers.
  Readings outliers;  ///< Messages that are outliers, ascending, per recording.
};

/// Estimates the noise and detects the outliers.
/// @param data Dataset.
/// @param errors Errors of the nominal model, per recording and channel; the function removes a flexible curve.
/// @return Noise and outliers.
Calibration calibrate_noise(const Dataset& data, const Errors& errors);

}  // namespace bevel::inference
