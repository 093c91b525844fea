// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Checks the invariants of a verdict, which hold for every diagnosis and all recordings.
#include <string>
#include <vector>

#include <bevel/diagnosis/mismatch/findings.hpp>

namespace bevel::diagnosis {

/// Checks the invariants of a verdict that its findings can show:
///   1. a named effect has a probability of at least 0.5, alone or jointly with the confounders listed with it; the
///      interval (95 %) of one of its sizes excludes "no effect"; its log Bayes factor is positive;
///   2. at most 10 % of the probability is in candidate models that were not fitted;
///   3. a log Bayes factor that is reported is a number that was computed;
///   4. the adopted model predicts left-out recordings no worse than the refitted nominal model: the mean difference in
///      log density between recordings is not below zero by more than its standard error;
///   5. a proposed equation has finite values, the interval of its amplitude excludes none, and that of its shape
///      includes the estimate;
///   6. a parameter at a bound of its range is marked.
/// Rules 1, 2 and 4 do not apply to an inconclusive verdict, which adopts no model. It must name no effect and state a
/// reason.
/// @param findings result of a diagnosis
/// @return one sentence for each violation; empty if all invariants hold
std::vector<std::string> violations(const Findings& findings);

}  // namespace bevel::diagnosis
