#pragma once
// The covariates of the needle's discrepancy, which are those of the model's.
#include "model/effects/covariates.hpp"

namespace bevel::diagnosis {
using model::CovariateTracker;
}  // namespace bevel::diagnosis
