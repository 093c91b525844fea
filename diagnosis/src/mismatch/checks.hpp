// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Checks of the final model's residuals. They are printed; the verdict does not depend on them.
#include <bevel/diagnosis/mismatch/decision.hpp>

namespace bevel::diagnosis {

/// Compares the final model's residuals with the noise that a smoothing curve leaves of them, and tests whether they
/// are autocorrelated. The noise that was fitted with the model cannot serve: it covers what the model leaves out.
/// @param outliers  of each recording, left out
/// @param start  noise of the calibration: its structure, and its values if the model cannot be evaluated
Checks check_model(const inference::Search& search, const ChosenModel& model, const inference::Readings& outliers,
                   const inference::Noise& start);

}  // namespace bevel::diagnosis
