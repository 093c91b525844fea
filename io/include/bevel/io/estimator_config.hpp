// SPDX-License-Identifier: MIT
// Estimator settings from TOML: the section [estimator] of a system file, or the root of a file of its own.
#pragma once

#include <bevel/estimator/config.hpp>
#include <bevel/io/config.hpp>

namespace bevel::io {

// Everything but the prior's means, which are the model file's. Absent keys keep the structure's defaults.
void read_estimator_config(Section section, estimator::EstimatorConfig& config);

}  // namespace bevel::io
