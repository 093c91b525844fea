// SPDX-License-Identifier: MIT
#pragma once
// The verdict in one sentence.
#include <bevel/diagnosis/mismatch/findings.hpp>

namespace bevel::diagnosis {

std::string sentence_of(const Findings& findings);

}  // namespace bevel::diagnosis
