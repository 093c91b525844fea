// SPDX-License-Identifier: MIT
#pragma once
// The parts of a model file that say what the model does not: [[discrepancy]], curves without a name, and [variation],
// by how much insertions differ.
#include <optional>
#include <string>
#include <vector>

#include <bevel/io/config.hpp>
#include <bevel/model/effects/discrepancy.hpp>
#include <bevel/model/effects/variation.hpp>

namespace bevel::io {

// The [[discrepancy]]s of a section that has so many [[effect]]s too: together they are at most model::kMaxEffects.
std::vector<model::DiscrepancyCurve> read_discrepancies(Section parent, std::size_t effects);
// Nothing where the section has no [variation].
std::optional<model::Variation> read_variation(Section parent);

std::string to_toml(const model::DiscrepancyCurve& curve);
std::string to_toml(const model::Variation& variation);

}  // namespace bevel::io
