// SPDX-License-Identifier: MIT
/// @file
/// Posterior from the fitted candidate models: probabilities of candidate models, of each effect and of a discrepancy,
/// posteriors of the unknowns, and leave-one-out predictions of each recording.
#pragma once
#include <map>
#include <optional>

#include <bevel/diagnosis/inference/profile.hpp>
#include <bevel/diagnosis/inference/search.hpp>

namespace bevel::inference {

/// Posterior probability of one candidate model.
struct SetShare {
  ModelSet set;                 ///< Candidate model.
  double probability = 0;       ///< Posterior probability, with and without a discrepancy.
  double with_discrepancy = 0;  ///< Part of \p probability with a discrepancy.
  double unknown = 0;           ///< Part of \p with_discrepancy whose discrepancy is as visible as requested.
};

/// Probabilities given that one of the fitted candidate models is true.
struct Posterior {
  std::vector<SetShare> sets;  ///< Candidate models, the most likely first.
  /// Estimated share that the candidate models which were not fitted would have (Search::share_not_visited()).
  double not_visited = 0;
  std::map<std::string, double> inclusion;  ///< Probability of each effect by name: the sum over the sets with it.
  double discrepancy = 0;                   ///< Probability of a discrepancy as visible as requested.
  double nothing = 0;                       ///< Probability of neither an effect nor such a discrepancy.
};

/// Computes the posterior over the candidate models of a search.
/// @param search Finished search.
/// @param visible_sigmas Visible size from which a discrepancy counts, in standard deviations of the noise. Smaller
/// ones are errors of form: they widen intervals and are not reported as missing physics.
/// @return Posterior probabilities.
Posterior posterior_of(const Search& search, double visible_sigmas);

/// Computes the visible size of a fitted discrepancy: the part of its curves' values that the shared and the
/// insertion-specific parameters do not absorb.
/// @param search Search that made the fit.
/// @param fit Fit with curves.
/// @return Root of the sum of squares over all measurements, in standard deviations of the autocorrelated noise; 0
/// where the linear model about the fit is not valid.
double visible_sigmas_of_curve(const Search& search, const Fit& fit);
/// Computes the probability that the visible size exceeds a limit, given a discrepancy. It uses the posterior of the
/// fitted curves' values, or the linear model of every curve if none was likely enough to be fitted.
/// @param search Search that made the evaluation.
/// @param at Evaluated candidate model.
/// @param sigmas Limit, in standard deviations of the noise.
/// @return Probability, in [0, 1].
double probability_visible(const Search& search, const Evaluated& at, double sigmas);

/// Computes the columns of a fit's curves, whitened by the fit's own noise.
/// @param search Search that made the fit.
/// @param fit Fit.
/// @return Columns; empty for a fit without curves.
CurveColumns curve_of(const Search& search, const Fit& fit);
/// Returns the posterior weights over nuisance_grid() of a fit.
/// @param search Search that made the fit.
/// @param fit Fit of one of the visited candidate models.
/// @return Weights of the grid's columns, with the curves if \p fit has any.
/// @throws std::out_of_range if the candidate model was not visited.
const Eigen::VectorXd& nuisance_weights_of(const Search& search, const Fit& fit);

/// Mixture of normal densities: over candidate models with and without their curves, and over the between-insertion
/// standard deviations. All values are in the unknown's unit.
struct Mixture {
  /// One normal component.
  struct Part {
    double weight = 0,  ///< Weight; the sum over the parts need not be 1.
        mean = 0,       ///< Mean.
        sd = 0;         ///< Standard deviation; 0: a point mass.
  };
  std::vector<Part> parts;  ///< Components.
  /// Computes the mean.
  /// @return Mean; NaN for an empty mixture.
  double mean() const;
  /// Computes the standard deviation.
  /// @return Standard deviation; NaN for an empty mixture.
  double sd() const;
  /// Computes a quantile by bisection.
  /// @param share Probability below the quantile, in (0, 1).
  /// @return Quantile, within 8 standard deviations of a component's mean.
  double quantile(double share) const;
};

/// Posteriors of shared unknowns, by the linear models about the modes. Where an unknown has many local minima or the
/// likelihood is not a parabola, the posterior follows the profile likelihood.
class Unknowns {
 public:
  /// Prepares the posteriors of all shared unknowns.
  /// @param search Finished search; it must outlive this object.
  explicit Unknowns(const Search& search);
  /// Computes the posterior of one shared parameter over all candidate models that contain it.
  /// @param effect Index into System::effects(); -1: the nominal model.
  /// @param parameter Index of the parameter in its effect or in System::base().
  /// @return Posterior; empty if no candidate model contains the effect.
  Mixture of(int effect, std::size_t parameter) const;
  /// Computes the posterior of one group's between-insertion standard deviation.
  /// @param group Index into System::nuisance_groups().
  /// @return Probabilities of NuisanceGroup::standard_deviations.
  Eigen::VectorXd of_group(std::size_t group) const;

 private:
  struct Part {
    double weight = 0;
    const Layout* layout = nullptr;
    Eigen::VectorXd mean, sd, nuisance_sd;
    std::map<Eigen::Index, std::vector<ProfileStep>> along;
  };
  static void look_along(const Fit& fit, const CurveColumns& curve, const Eigen::MatrixXd& covariance, Part& part);

  const Search* search_;
  std::vector<Part> parts_;
};

/// One recording given the others, by the linear model about a mode.
struct LeftOut {
  Eigen::VectorXd shared,  ///< Shared unknowns that the others give, within the bounds.
      curve_values;        ///< Curve values that the others give, in their components' units.
  double log_density = 0;  ///< Log predictive density of the recording, without the constants of 2 pi.
  double chi2 = 0;         ///< Chi-square of its measurements under the predictive density.
};
/// Predicts one recording from the others, by the linear model about a fit.
/// @param fit Fit of all recordings.
/// @param blocks Normal equations about \p fit (linearise()).
/// @param curve Columns of the fit's curves.
/// @param recording Index of the recording that is left out.
/// @return Prediction; nothing where the linear model has no mode.
std::optional<LeftOut> leave_out(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                                 std::size_t recording);
/// Predictive density of one recording.
struct Predictive {
  double log_density = 0;  ///< Natural log, without the constants of 2 pi.
  double chi2 = 0;         ///< Chi-square of the measurements under the predictive density.
};
/// Computes the predictive density of one recording about the fit's own values, with the covariance that the other
/// recordings give them.
/// @param fit Fit.
/// @param blocks Normal equations about \p fit (linearise()).
/// @param curve Columns of the fit's curves.
/// @param recording Index of the recording.
/// @return Density; nothing where the linear model has no mode.
std::optional<Predictive> predictive_of(const Fit& fit, const std::vector<ArrowBlock>& blocks,
                                        const CurveColumns& curve, std::size_t recording);

/// Probability of one fit given all recordings but one.
struct LeftOutShare {
  const Fit* fit = nullptr;  ///< Fit of all recordings; valid as long as the search.
  double probability = 0;    ///< Probability given the other recordings.
};
/// Prediction of one recording by the mixture of models that the other recordings give.
struct LeftOutSelection {
  double log_density = 0;            ///< Log density of the mixture, without the constants of 2 pi.
  const Fit* fit = nullptr;          ///< Most likely fit without the recording; valid as long as the search.
  std::vector<LeftOutShare> shares;  ///< Fits with a probability above 0.02, the most likely first.
};
/// Predicts each recording from the others. The linear models weigh the candidate models and fit their parameters
/// without the recording. All recordings decided which candidate models were visited.
/// @param search Finished search.
/// @return One prediction per recording.
/// @throws bevel::DomainError if no model has a mode without one of the recordings.
std::vector<LeftOutSelection> leave_out_selection(const Search& search);

}  // namespace bevel::inference
