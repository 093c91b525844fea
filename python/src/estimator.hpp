// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The estimator's configuration and estimate, as bevel.EstimatorConfig and bevel.Estimate hold them.
#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::python {

/// Sets the needle, the variation and the effects of \p config to those of \p model that are known before an insertion.
estimator::EstimatorConfig for_model(estimator::EstimatorConfig config, const io::ModelFile& model);

/// Flags of a health word by name: "no_measurement", "uncertain", ...
std::vector<std::string> names_of_health(std::int32_t health);

}  // namespace bevel::python
