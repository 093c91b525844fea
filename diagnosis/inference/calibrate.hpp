#pragma once
// The noise to begin with and the outliers: what a flexible curve leaves beside the base alone.
#include "diagnosis/inference/likelihood.hpp"

namespace bevel::inference {

// From the standard deviations that the data claim. Throws std::domain_error where the base alone cannot follow the
// recordings.
Calibration calibrate(const System& system);

// The middle of each group's standard deviations.
Eigen::VectorXd middle_nuisance_sd(const System& system);

}  // namespace bevel::inference
