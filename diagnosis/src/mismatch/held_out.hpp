// SPDX-License-Identifier: MIT
#pragma once
// Each recording predicted from the others, as a new insertion: how far off, and how probable.
#include <bevel/diagnosis/mismatch/decision.hpp>

namespace bevel::diagnosis {

// judge: the model that was chosen, by whose noise and variation the needle alone is judged too. The selection is
// repeated without each recording, among the sets that were visited.
HeldOut hold_out(const NeedleSystem& system, const inference::Search& search, const inference::Fit& judge);

}  // namespace bevel::diagnosis
