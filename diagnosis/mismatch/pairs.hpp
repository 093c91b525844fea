#pragma once
// Two effects that explain together what neither shows alone: where one hides the other, the best alone may be a third.
#include <array>
#include <vector>

#include "diagnosis/mismatch/dictionary.hpp"

namespace bevel::diagnosis {

// Pairs of candidates (indices) by the fall of chi2 that a linear model promises of both together, the best first. Each
// candidate at its most promising start; those with unknowns of single recordings are left out.
std::vector<std::array<std::size_t, 2>> best_pairs(const std::vector<Candidate>& candidates, const Ground& ground,
                                                   std::size_t count);

}  // namespace bevel::diagnosis
