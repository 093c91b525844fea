#pragma once
// Is what a model leaves the noise that was measured before any physics was named? Printed for people.
#include "diagnosis/mismatch/decision.hpp"

namespace bevel::diagnosis {

// measured: the noise that a flexible curve leaves. The model's own noise was fitted beside it, and would hide what it
// leaves out.
Checks check_model(const inference::Search& search, const ChosenModel& model, const inference::Readings& outliers,
                   const inference::Noise& measured);

}  // namespace bevel::diagnosis
