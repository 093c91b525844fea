#pragma once
// The cameras' noise and outliers beside an explanation.
//
// Problem   a fit that took an outlier for a reading is pulled towards it, and hides it; one that missed a jump by a
//           frame has the readings at the jump for outliers, and stays where it is. Measured once, outliers are those
//           of the wrong fit.
// Solution  outliers of the fit, the fit without them, outliers again, until they stay. The noise by which fits are
//           weighed stays as it was meanwhile: settled together with them, it swallows what is not explained.
#include "diagnosis/mismatch/likelihood.hpp"

namespace bevel::diagnosis {

// Whether two calibrations are one: deviations and colour within 3 %, and the same outliers.
bool settled(const Calibration& one, const Calibration& again);

// Of the case with all its readings, beginning from a fit to some of them with the evidence's noise.
Calibration calibrate_beside(const RecordedCase& original, const Evidence& evidence, Fit fitted);

}  // namespace bevel::diagnosis
