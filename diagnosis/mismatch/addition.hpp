#pragma once
// One effect more: the full fit of a set of effects with one added, past the many valleys of depths, instants and
// phases.
#include <memory>

#include "diagnosis/mismatch/dictionary.hpp"

namespace bevel::diagnosis {

// The best of several fits of set + member, begun where a linear model promises most; local unknowns (instants,
// phases) scanned anew with the full model in between. Null where no fit stays in the model's domain.
std::shared_ptr<const Fit> fit_addition(const Evidence& evidence, const Fit& from, const Candidate& candidate,
                                        const std::vector<Promise>& promises);

// A jump's instants trade against its size, with barriers between: the best of fits begun at other sizes, each held
// until all else has followed. The fit itself where no member has instants.
std::shared_ptr<const Fit> from_other_sizes(const Evidence& evidence, std::shared_ptr<const Fit> best);

}  // namespace bevel::diagnosis
