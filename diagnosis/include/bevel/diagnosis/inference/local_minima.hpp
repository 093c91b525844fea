// SPDX-License-Identifier: MIT
/// @file
/// Escape from local minima: grid scans of the phases, event times and shapes of effects, which derivatives do not
/// find.
#pragma once
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

/// Spacing of the event times in a scan, in s.
inline constexpr double kInstantSpacing_s = 0.3;

/// Tests whether the starts of a shared parameter are a grid (for example a depth or a jump).
/// @param parameter Parameter.
/// @return True if its likelihood has many local minima.
bool has_many_minima(const Parameter& parameter);

/// Computes the spacing of a parameter's starts around a value.
/// @param parameter Parameter with at least two starts.
/// @param value Value, in the parameter's unit.
/// @return Distance of the two nearest starts, in the parameter's unit.
double grid_spacing(const Parameter& parameter, double value);

/// Tests whether a member of a candidate model has event times at which the predictions jump.
/// @param layout Layout of the candidate model.
/// @param member Position of the effect in the candidate model.
/// @return True if it has.
bool has_jump(const Layout& layout, int member);

/// Computes the reduction of chi-square that an event must bring in a recording to be accepted, from its expected odds.
/// @param duration_s Duration in which the event can occur, in s.
/// @return Cost, in units of chi-square.
double instant_cost(double duration_s);
/// Computes the cost of a fit plus instant_cost() of each of its events.
/// @param fit Fit.
/// @return Cost, in units of chi-square.
double cost_with_instants(const Fit& fit);
/// Computes the number of event times in the scan of a recording.
/// @param duration_s Duration, in s.
/// @return Number, at least 4.
int instants_of(double duration_s);

/// Tests whether a candidate model has phases or event times.
/// @param layout Layout of the candidate model.
/// @return True if it has.
bool has_scanned(const Layout& layout);

/// Moves every phase and event time to the best value of a grid with all else constant, until the cost no longer falls.
/// @param likelihood Likelihood.
/// @param curve Columns of the fit's curves.
/// @param[in,out] fitted Fit.
void scan_locals(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

/// Removes each event in turn, fits all else again, and keeps the event out or moves it if the cost falls. A scan with
/// wrong parameters can place events that then keep the parameters wrong. An event stays if its removal costs far too
/// much by the linear model.
/// @param likelihood Likelihood.
/// @param curve Columns of the fit's curves.
/// @param[in,out] fitted Fit.
void doubt_instants(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

/// Scans each shared parameter with many local minima on a finer grid around its value. The linear model adjusts all
/// other unknowns; the event times are adjusted too.
/// @param likelihood Likelihood.
/// @param curve Columns of the fit's curves.
/// @param[in,out] fitted Fit.
void scan_shapes(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted);

/// Replaces a member of a fit by another effect that describes the same path. The member is removed step by step and
/// all else follows, because an immediate change would lose parameters with many local minima (a depth, a jump).
/// @param likelihood Likelihood.
/// @param curve Columns of the fit's curves.
/// @param from Fit.
/// @param member Position of the member to remove.
/// @param effect Index into System::effects() of the new effect.
/// @param start Start values of the new effect's shared parameters.
/// @return Fit without final scans; not valid if a step leaves the model's domain.
Fit replaced(const Likelihood& likelihood, const CurveColumns& curve, const Fit& from, std::size_t member,
             std::size_t effect, const Eigen::VectorXd& start);

/// Predicts the decrease of the log likelihood if one member's sizes are set to `none`, by the linear model.
/// @param fit Fit with its likelihood.
/// @param curve Columns of the fit's curves.
/// @return One decrease per member; infinite if the member has no size, or is at a bound other than `none`.
std::vector<double> log_costs_of_dropping(const Fit& fit, const CurveColumns& curve = {});

}  // namespace bevel::inference
