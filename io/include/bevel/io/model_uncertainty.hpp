// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The parts of a model file that state its uncertainty: [[discrepancy]], discrepancy terms, and [variation], the
/// between-insertion standard deviations. bevel/io/model_file.hpp describes the format.
#include <optional>
#include <string>
#include <vector>

#include <bevel/io/config.hpp>
#include <bevel/model/effects/discrepancy.hpp>
#include <bevel/model/effects/variation.hpp>

namespace bevel::io {

/// Reads the tables [[discrepancy]] of a section. Faults are reported by ConfigFile::finish().
/// @param parent  section that contains the tables
/// @param effects  number of tables [[effect]] in the section; together at most model::kMaxEffects
/// @return the discrepancy terms in the order of the file
std::vector<model::DiscrepancyCurve> read_discrepancies(Section parent, std::size_t effects);
/// Reads the table [variation] of a section. Faults are reported by ConfigFile::finish().
/// @param parent  section that contains the table
/// @return nothing if the section has no such table
std::optional<model::Variation> read_variation(Section parent);

/// Formats a table [[discrepancy]].
/// @param curve  discrepancy term
/// @return TOML text
std::string to_toml(const model::DiscrepancyCurve& curve);
/// Formats a table [variation].
/// @param variation  between-insertion standard deviations
/// @return TOML text
std::string to_toml(const model::Variation& variation);

}  // namespace bevel::io
