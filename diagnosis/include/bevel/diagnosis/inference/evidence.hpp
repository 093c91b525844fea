// SPDX-License-Identifier: MIT
#pragma once
// The evidence of a set of effects: the integral of likelihood times prior over everything unknown. By Laplace's method
// in what is nonlinear, exactly in what is linear about the mode; over grids for the standard deviations of the
// nuisances and for each of the discrepancy's curves, their scales and lengths.
#include <algorithm>
#include <limits>

#include <bevel/diagnosis/inference/discrepancy.hpp>
#include <bevel/diagnosis/inference/nuisance_grid.hpp>

namespace bevel::inference {

// A set at its mode, with its evidence. Logarithms, natural; all of one Likelihood stand on one scale.
struct Evaluated {
  explicit Evaluated(Fit f) : fit(std::move(f)) {}
  Fit fit;                            // without a curve, at the likeliest standard deviations
  std::optional<Fit> fit_with_curve;  // with the likeliest curves, where one is likely at all
  double log_evidence = 0;            // without a discrepancy
  double log_bayes_factor_curve = 0;  // of a discrepancy of any number of curves, against none
  std::vector<CurveFactor> curves;    // each of them as the first, the likeliest first
  std::vector<double> log_factors;    // of one curve against none, of two against one, choices integrated over
  Eigen::VectorXd nuisance_weights;   // posterior over the grid of standard deviations
  Eigen::VectorXd nuisance_weights_with_curve;
  bool with_discrepancy = false;  // whether that was asked
  // The search stopped before the mode was reached, because the evidence stayed too low: log_evidence is a lower bound.
  bool given_up = false;
  // The evidence with a discrepancy was computed: at its mode, or by the linear model where no curve stands out.
  bool discrepancy_known = false;
  bool valid = false;
};

// Starting values; nuisance_sd is where the standard deviations begin. Without a discrepancy. The noise is fitted too;
// `likelihood` is where it begins. Once the evidence is so low, it is left as it is.
Evaluated evaluate(const Likelihood& likelihood, const Layout& layout, const Eigen::VectorXd& shared,
                   const std::vector<Eigen::VectorXd>& local, const Eigen::VectorXd& nuisance_sd,
                   double give_up_below = -std::numeric_limits<double>::infinity());

// Of the log Bayes factor that is promised of one more curve: what a fit comes to at most.
inline constexpr double kMostOfPromise = 2;

struct CurveRules {
  double log_prior_odds;       // of a curve, against none
  double log_prior_odds_more;  // of one more, against no more
  std::size_t most = 2;
  double optimism = 2;  // by which a fit may exceed what the linear model promised of one more
};
// What is known of a set before it has a curve.
struct CurveStart {
  const Fit* large_curve = nullptr;  // the curves that another set's fit has are tried too, from there; null: none
  double hopeless_below = -std::numeric_limits<double>::infinity();  // log evidence with all that it may have
  bool promised_with_several = false;                                // with the first alone it may be below that
};
// The discrepancy's part, added to a set that was evaluated without: the likeliest curve, then beside it the next, for
// as long as one more is likelier than not, and not hopeless.
void add_discrepancy(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                     Evaluated& evaluated, const CurveStart& start = {});
// Where that is too large for the linear model, which chose it: the likeliest of each other component in its place.
void add_large_curves(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                      Evaluated& evaluated);
// The same without one of its curves, all else where it is.
Fit without_curve(const Discrepancy& discrepancy, Fit fit, std::size_t which);
// Log Bayes factor of one more curve than those known, whichever it is, beside what a set leaves.
double log_factor_of_one_more(const Discrepancy& discrepancy, const Marginal& beside,
                              std::span<const CurvePrior> known);
// The same with the first of its curves alone, as another set's is begun: their values as they are, about no tangent.
Fit with_first_curves(const Discrepancy& discrepancy, Fit fit, std::size_t count);

// The same mode sought again by the noise of another likelihood.
struct Moved {
  Fit fit;
  // By how much its evidence is more there; where the model cannot follow, without end less.
  double log_change = -std::numeric_limits<double>::infinity();
  // What the readings say of the shared unknowns by the noise that the fit had, as a share of what they say by this one
  // (the geometric mean of their information).
  double share_before = 1;
  // Of what is promised by this noise: what it comes to, relative to the fit by its own. This noise may be wrong for
  // the fit and right for what has more, or the other way about: that finds its own, which promises no less than
  // either.
  double log_gain(double log_promised) const {
    if (!fit.valid) return log_change;
    return std::max(log_change + log_promised, share_before * log_promised);
  }
};
Moved moved_to(const std::shared_ptr<const Likelihood>& likelihood, const Fit& from, const Discrepancy& discrepancy);

// The same fit with less_spread() and one_step_less_spread(), each way, and by how much its evidence, the prior of the
// spread with it, is more there (less, as a rule), by the linear model. What some recordings share looks like a spread
// until it has a name: beside what spread is left then, none or less, an effect or a curve may be worth much more.
struct WithLessSpread {
  Fit fit;
  double log_change = 0;
};
std::vector<WithLessSpread> with_less_spread(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve);
// One of them at its mode, by the nonlinear model: the shared unknowns go far for what a spread no longer takes up, and
// what the linear model promises there may be off by any amount (of 13 in log evidence -284 is left). `fit` is at its
// mode by its own likelihood.
WithLessSpread at_its_mode(const WithLessSpread& less, const Fit& fit, const CurveColumns& curve);

}  // namespace bevel::inference
