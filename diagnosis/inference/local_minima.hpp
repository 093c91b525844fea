#pragma once
// Ways out of local minima: phases, instants and shapes of effects at the best of a grid, as derivatives do not see
// them.
#include "diagnosis/inference/likelihood.hpp"

namespace bevel::inference {

// Between instants that are tried.
inline constexpr double kInstantSpacing_s = 0.3;

// Of a shared parameter: its starts are a grid (a depth, a jump).
bool has_many_minima(const Parameter& parameter);

// Every phase and instant at the best of a grid, all else as it is, again and again until that helps no more.
void scan_locals(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

// Each instant in turn taken out, all else fitted anew: kept out where it is not missed. What a scan finds beside
// parameters that are still off may hold them there.
void doubt_instants(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

// Each shared parameter that has many local minima along a finer
// grid about where it is, all else following by the linear model.
void scan_shapes(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

// By the linear model: by how much the log likelihood falls where one member's sizes are none, for each member.
// Infinite for one that has no size to be none, or one that presses against a bound.
std::vector<double> log_costs_of_dropping(const Fit& fit);

}  // namespace bevel::inference
