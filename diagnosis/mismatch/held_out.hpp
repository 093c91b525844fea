#pragma once
// Each recording predicted from the others, as a new insertion: how far off, and how probable.
#include "diagnosis/mismatch/decision.hpp"

namespace bevel::diagnosis {

// base: the needle alone, refitted with the noise and the variation of the model that was chosen (refitted_base). The
// selection is repeated without each recording, among the sets that were visited.
HeldOut hold_out(const NeedleSystem& system, const inference::Search& search, const ChosenModel& base);

}  // namespace bevel::diagnosis
