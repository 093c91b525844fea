#pragma once
// Instants and phases that each recording has for itself have many valleys: they are scanned, not descended.
#include <algorithm>
#include <cstddef>

#include "diagnosis/mismatch/likelihood.hpp"

namespace bevel::diagnosis {

// chi2 that an instant has to bring in a recording, or it is set to 0, "not in this one": 2 log of the instants that
// are tried, and room.
inline constexpr double kInstantCost = 12.0;

// An instant of its own in more recordings than these (three in four) is no accident but physics of another kind.
inline std::size_t most_recordings_with_an_instant(std::size_t recordings) {
  return std::max<std::size_t>(3 * recordings / 4, 1);
}

// Values with every local unknown at the best of a grid, all else as it is.
Eigen::VectorXd scan_local_unknowns(const Evidence& evidence, const Hypothesis& hypothesis,
                                    const Eigen::VectorXd& values);
// The same, with an instant in at most so many recordings.
Eigen::VectorXd scan_local_unknowns(const Evidence& evidence, const Hypothesis& hypothesis,
                                    const Eigen::VectorXd& values, std::size_t most_recordings);

// Instants at which something happens in one recording; 0: not in this one. (Phases are the other kind.)
bool is_instant(const Hypothesis& hypothesis, const Unknown& unknown);
// An effect that happens at an instant of its own in each recording, or not in this one.
bool has_instants(const Member& member);
// How many instants are not "off".
int instants_in_use(const Fit& fit);
// By which fits are compared: chi2, belief included, and what each instant has to bring.
double cost_of(const Fit& fit);

// A fit, and after it one with the instants held: where a jump meets a reading chi2 has a kink, at which a step of all
// unknowns together stops short.
Fit fit_beside_instants(const Evidence& evidence, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                        FitRules rules = {});

}  // namespace bevel::diagnosis
