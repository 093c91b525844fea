#pragma once
// The cameras' noise and outliers beside an explanation, settled together with its fit.
//
// Problem   a fit that took an outlier for a reading is pulled towards it, and hides it; one that missed a jump by a
//           frame has the readings at the jump for outliers, and stays where it is. Measured once, noise and outliers
//           are those of the wrong fit.
// Solution  noise of the fit, the fit without its outliers, noise again, until neither changes.
#include "diagnosis/mismatch/likelihood.hpp"

namespace bevel::diagnosis {

// Whether two calibrations are one: deviations and colour within 3 %, and the same outliers.
bool settled(const Calibration& one, const Calibration& again);

// Of the case with all its readings, beginning from a fit to some of them with the evidence's noise.
Calibration calibrate_beside(const RecordedCase& original, const Evidence& evidence, Fit fitted);

}  // namespace bevel::diagnosis
