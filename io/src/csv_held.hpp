// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Removes repeated values of slow sensors from the rows of a CSV recording.

#include <string>
#include <vector>

#include "csv_rows.hpp"

namespace bevel::io {

/// Empties cells that repeat a value between two updates of a slow sensor (held_values.hpp), so that what remains was
/// measured at its time, and is interpolated between these times.
///
/// A base that really moves in steps at regular intervals looks the same in its own column. The insertion is therefore
/// changed only if the interpolated values predict the tip's path length better than the values of the rows
/// (base_lag.hpp), and the rotation only if it is updated together with such an insertion.
/// @param tip_rows  rows with the tip and its heading
/// @param base_rows  rows with insertion and rotation
/// @return a sentence for each column that is held, also if it was left as it is
std::vector<std::string> remove_held_values(std::vector<CsvRow>& tip_rows, std::vector<CsvRow>& base_rows,
                                            bool has_rotation);

}  // namespace bevel::io
