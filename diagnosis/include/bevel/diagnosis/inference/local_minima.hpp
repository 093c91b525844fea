// SPDX-License-Identifier: MIT
#pragma once
// Ways out of local minima: phases, instants and shapes of effects at the best of a grid, as derivatives do not see
// them.
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

// Between instants that are tried.
inline constexpr double kInstantSpacing_s = 0.3;

// Of a shared parameter: its starts are a grid (a depth, a jump).
bool has_many_minima(const Parameter& parameter);

// Of its starts: from a value's neighbour to the next.
double grid_spacing(const Parameter& parameter, double value);

// Whether a member of the set happens at instants at which readings jump.
bool has_jump(const Layout& layout, int member);

// What an instant has to bring in a recording to be taken for one, in chi2: its expected odds.
double instant_cost(double duration_s);
// The cost of a fit, its instants' with it.
double cost_with_instants(const Fit& fit);
// Of a grid over a recording.
int instants_of(double duration_s);

// Whether it has phases or instants.
bool has_scanned(const Layout& layout);

// Every phase and instant at the best of a grid, all else as it is, again and again until that helps no more.
void scan_locals(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

// Each instant in turn taken out, all else fitted anew: kept out, or put elsewhere in its recording, where it is not
// missed. What a scan finds beside parameters that are still off may hold them there. One that is missed by far by the
// linear model stays.
void doubt_instants(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

// Each shared parameter that has many local minima along a finer grid about where it is, all else following by the
// linear model, and the instants too.
void scan_shapes(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

// From a fit to one in which another effect does what one of its members does: that member is taken out step by step,
// and all else follows, the other effect too, from where it starts (its shared parameters). Between two names of one
// path the rest of the model has to change as well, and what has many local minima (a depth, a jump) is lost on the
// way if the change is made at once. Not settled yet: without scans. Invalid where the way leaves the model's domain.
Fit replaced(const Likelihood& likelihood, const CurveColumns& curve, const Fit& from, std::size_t member,
             std::size_t effect, const Eigen::VectorXd& start);

// By the linear model: by how much the log likelihood falls where one member's sizes are none, for each member.
// Infinite for one that has no size to be none, or one that presses against a bound other than that.
std::vector<double> log_costs_of_dropping(const Fit& fit, const CurveColumns& curve = {});

}  // namespace bevel::inference
