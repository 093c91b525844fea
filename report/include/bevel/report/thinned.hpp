// SPDX-License-Identifier: MIT
// Fewer samples that show the same: every extreme stays, and nothing is picked at equal steps, so that a series in
// which several sources take turns (two cameras) keeps all of them.
#pragma once

#include <cstddef>
#include <vector>

namespace bevel::report {

// Indices, ascending, of at most `most` (12 or more) samples of a series in its own order: first and last, and of each
// of equal stretches between them the smallest, the largest and one other finite value, and the first gap (a value that
// is not finite). All of them if there are no more than `most`.
std::vector<std::size_t> thinned(const std::vector<double>& values, std::size_t most);

// Indices of either, ascending, each once.
std::vector<std::size_t> joined(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b);

}  // namespace bevel::report
