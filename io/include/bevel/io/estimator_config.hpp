// SPDX-License-Identifier: MIT
/// \file
/// Settings of the estimator in TOML: the section [estimator] of a system file, or the root of a separate file.
#pragma once

#include <bevel/estimator/config.hpp>
#include <bevel/io/config.hpp>

namespace bevel::io {

/// Reads all settings except the means of the prior, which are in the model file. Faults are reported by
/// ConfigFile::finish().
/// @param section  section with the settings
/// @param[in,out] config  settings; those without a key are unchanged
void read_estimator_config(Section section, estimator::EstimatorConfig& config);

}  // namespace bevel::io
