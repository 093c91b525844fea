// SPDX-License-Identifier: MIT
/// @file
/// Evidence of a candidate model: the integral of likelihood times prior over all unknowns.
///
/// The integral uses Laplace's method for the nonlinear unknowns and is exact for those that are linear about the mode.
/// Grids cover the between-insertion standard deviations and the scale and length of each discrepancy curve.
#pragma once
#include <algorithm>
#include <limits>

#include <bevel/diagnosis/inference/discrepancy.hpp>
#include <bevel/diagnosis/inference/nuisance_grid.hpp>

namespace bevel::inference {

/// Candidate model at its mode, with its evidence. Logarithms are natural. All values from one Likelihood have the same
/// reference.
struct Evaluated {
  /// Makes an evaluation that is not valid yet.
  /// @param f Fit without a discrepancy.
  explicit Evaluated(Fit f) : fit(std::move(f)) {}
  Fit fit;                            ///< Fit without a discrepancy, at the most likely standard deviations.
  std::optional<Fit> fit_with_curve;  ///< Fit with the most likely curves, if any curve is likely.
  double log_evidence = 0;            ///< Log evidence without a discrepancy.
  double log_bayes_factor_curve = 0;  ///< Log Bayes factor of a discrepancy with any number of curves against none.
  std::vector<CurveFactor> curves;    ///< Each curve as the only one, the most likely first.
  /// Log Bayes factors of one curve against none, of two against one, and so on, integrated over the choices.
  std::vector<double> log_factors;
  Eigen::VectorXd nuisance_weights;             ///< Posterior over nuisance_grid(), without a discrepancy.
  Eigen::VectorXd nuisance_weights_with_curve;  ///< Posterior over nuisance_grid(), with the fitted curves.
  bool with_discrepancy = false;                ///< A discrepancy was requested (add_discrepancy()).
  /// The search stopped before the mode was reached, because the evidence stayed too low: log_evidence is a lower
  /// bound.
  bool given_up = false;
  /// The evidence with a discrepancy was computed: at its mode, or by the linear model where no curve stands out.
  bool discrepancy_known = false;
  bool valid = false;  ///< The fit is valid and its evidence finite.
};

/// Computes the mode and the evidence of a candidate model without a discrepancy. The noise is fitted too.
/// @param likelihood Likelihood with the initial noise.
/// @param layout Layout of the candidate model.
/// @param shared Start values of the shared unknowns, in the order of \p layout.
/// @param local Start values of the local unknowns; one vector per recording.
/// @param nuisance_sd Initial between-insertion standard deviations; one per group.
/// @param give_up_below Log evidence below which the iteration stops early.
/// @return Evaluation; not valid where the model cannot follow the recordings.
Evaluated evaluate(const Likelihood& likelihood, const Layout& layout, const Eigen::VectorXd& shared,
                   const std::vector<Eigen::VectorXd>& local, const Eigen::VectorXd& nuisance_sd,
                   double give_up_below = -std::numeric_limits<double>::infinity());

/// Largest gain of a fit with one more curve, as a multiple of the predicted log Bayes factor.
inline constexpr double kMostOfPromise = 2;

/// Settings of the curves of a discrepancy.
struct CurveRules {
  double log_prior_odds;       ///< Natural log prior odds of one curve against none.
  double log_prior_odds_more;  ///< Natural log prior odds of one more curve against no more.
  std::size_t most = 2;        ///< Largest number of curves.
  double optimism = 2;         ///< Log evidence by which a fit may exceed the linear model's prediction of one more.
};
/// Information about a candidate model before a curve is added.
struct CurveStart {
  /// Fit of another candidate model whose curves are tried too, from their values there; null: none.
  const Fit* large_curve = nullptr;
  /// Log evidence, with all predicted gains, below which the model is pruned.
  double hopeless_below = -std::numeric_limits<double>::infinity();
  /// The prediction requires several curves: with the first alone the evidence may be below hopeless_below.
  bool promised_with_several = false;
};
/// Adds a discrepancy to an evaluation: the most likely curve, then further curves while one more is more likely than
/// not and the model is not pruned.
/// @param likelihood Likelihood with which \p discrepancy was prepared.
/// @param discrepancy Prepared curves.
/// @param rules Settings.
/// @param[in,out] evaluated Evaluation without a discrepancy.
/// @param start Start values and limits.
void add_discrepancy(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                     Evaluated& evaluated, const CurveStart& start = {});
/// Tries the most likely curve of each other component where the fitted discrepancy is too large for the linear model
/// that chose it.
/// @param likelihood Likelihood with which \p discrepancy was prepared.
/// @param discrepancy Prepared curves.
/// @param rules Settings.
/// @param[in,out] evaluated Evaluation with a discrepancy; unchanged if no alternative has more evidence.
void add_large_curves(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                      Evaluated& evaluated);
/// Removes one curve from a fit. All other unknowns stay as they are.
/// @param discrepancy Prepared curves.
/// @param fit Fit with curves.
/// @param which Index into the fit's Scales::curves.
/// @return Fit without the curve; not refitted.
Fit without_curve(const Discrepancy& discrepancy, Fit fit, std::size_t which);
/// Computes the log Bayes factor of one more curve, whichever it is.
/// @param discrepancy Prepared curves.
/// @param beside Marginal about the fit that the curve joins.
/// @param known Curves that the fit has; they are not counted.
/// @return Natural log, averaged over curves, scales and lengths; 0 if no curve is left.
double log_factor_of_one_more(const Discrepancy& discrepancy, const Marginal& beside,
                              std::span<const CurvePrior> known);
/// Reduces a fit to the first of its curves, as the start of another candidate model. Their values stay as they are and
/// the tangent is removed.
/// @param discrepancy Prepared curves.
/// @param fit Fit with at least \p count curves.
/// @param count Number of curves to keep.
/// @return Fit with the first \p count curves; not refitted.
Fit with_first_curves(const Discrepancy& discrepancy, Fit fit, std::size_t count);

/// Mode of the same candidate model with the noise of another likelihood.
struct Moved {
  Fit fit;  ///< Fit with the other noise.
  /// Change of the log evidence; -infinity where the model cannot follow the recordings.
  double log_change = -std::numeric_limits<double>::infinity();
  /// Information about the shared unknowns with the fit's own noise divided by that with the other noise (geometric
  /// mean over the unknowns).
  double share_before = 1;
  /// Converts a gain that was predicted with the other noise into a gain relative to the fit with its own noise.
  ///
  /// The other noise may be wrong for the fit and right for a larger model, or the reverse. A fit of the larger model
  /// estimates its own noise, so the gain is the larger of the two estimates.
  /// @param log_promised Predicted gain in log evidence, with the other noise.
  /// @return Gain in log evidence; log_change if the fit is not valid.
  double log_gain(double log_promised) const {
    if (!fit.valid) return log_change;
    return std::max(log_change + log_promised, share_before * log_promised);
  }
};
/// Fits a candidate model again with the noise of another likelihood.
/// @param likelihood Likelihood with the other noise.
/// @param from Fit with its own noise.
/// @param discrepancy Prepared curves.
/// @return New fit and the change of its evidence.
Moved moved_to(const std::shared_ptr<const Likelihood>& likelihood, const Fit& from, const Discrepancy& discrepancy);

/// Fit with smaller between-insertion standard deviations.
///
/// A deviation that some recordings share looks like a difference between insertions until it is modelled. With smaller
/// or zero standard deviations an effect or a curve may gain much more evidence.
struct WithLessSpread {
  Fit fit;                ///< Fit with the smaller standard deviations in its scales.
  double log_change = 0;  ///< Change of the log evidence and the log prior of the standard deviations together.
};
/// Computes the change of the evidence for each smaller set of standard deviations (less_spread() and
/// one_step_less_spread()), by the linear model.
/// @param likelihood Likelihood.
/// @param fit Fit.
/// @param curve Columns of the fit's curves.
/// @return One entry per smaller set; empty if all standard deviations are zero or the fit is outside the domain.
std::vector<WithLessSpread> with_less_spread(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve);
/// Computes one such fit at its mode by the nonlinear model. The shared unknowns move far when they replace a standard
/// deviation, so the prediction of the linear model can be wrong by any amount (observed: 13 predicted, -284 found).
/// @param less Fit by the linear model.
/// @param fit Fit at its mode with its own likelihood.
/// @param curve Columns of the fit's curves.
/// @return Fit at its mode with the change of its evidence.
WithLessSpread at_its_mode(const WithLessSpread& less, const Fit& fit, const CurveColumns& curve);

}  // namespace bevel::inference
