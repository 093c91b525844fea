// SPDX-License-Identifier: MIT
// Findings of each verdict, made up without a diagnosis: what the page and the files are tried on. The paths are real
// ones: the needle with and without an effect along a rich motion.
#pragma once

#include <bevel/diagnosis/mismatch/findings.hpp>

namespace bevel::diagnosis::testing {

Findings made_up(Verdict verdict);

}  // namespace bevel::diagnosis::testing
