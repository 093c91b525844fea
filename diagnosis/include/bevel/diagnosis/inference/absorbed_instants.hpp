// SPDX-License-Identifier: MIT
#pragma once
// Steps that happened in some recordings, and that these took up as their own.
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

// Every instant once more with what a recording has of its own following from where it is like the others, at the size
// at which all recordings together cost least, then all else: what happened in some and was not seen at first passes
// for what these have of their own, and what one of them has wrong is the size for all.
void look_from_alike(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

}  // namespace bevel::inference
