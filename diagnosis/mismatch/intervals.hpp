#pragma once
// Profile-likelihood intervals: an unknown is moved until chi2, with all else fitted again, has risen by 3.84.
// Source: Venzon and Moolgavkar 1988, Appl. Statist. 37(1).
#include "diagnosis/mismatch/findings.hpp"
#include "diagnosis/mismatch/likelihood.hpp"

namespace bevel::diagnosis {

// For one unknown of a fit. An end that lies on a bound is the bound.
FoundParameter profile(const Evidence& evidence, const Fit& fit, int unknown, const std::string& name);

// For an instant: the span over which it may as well have been, scanned, not descended; its value is the middle.
FoundParameter profile_instant(const Evidence& evidence, const Fit& fit, int unknown, const std::string& name);

}  // namespace bevel::diagnosis
