#pragma once
// The verdict in one sentence.
#include "diagnosis/mismatch/findings.hpp"

namespace bevel::diagnosis {

std::string sentence_of(const Findings& findings);

}  // namespace bevel::diagnosis
