// SPDX-License-Identifier: MIT
/// @file
/// Prediction of one recording from the others, row by row: as a new recording, and continued from its first
/// measurements. The linear model about a mode is exact where the measurements are linear in all unknowns:
///
/// \code{.unparsed}
///   y = h(m) + A (u - m) + e     u = (shared unknowns, curve values, local unknowns of the recording)
/// \endcode
///
/// u is normal: given the other recordings, and about zero with the between-insertion standard deviations. The result
/// is a sum over those, weighted by the evidence of the other recordings (and, continued, of the first measurements).
/// To continue, u is conditioned on the first measurements (Rasmussen and Williams 2006, A.6), and so is the noise. Its
/// whitening W is lower triangular in time. For a later part 2 given part 1 the errors are W22^-1 [W (y - h)]_2, the
/// derivatives W22^-1 [W A]_2, and the noise covariance is (W22' W22)^-1.
///
/// The local unknowns are normal about zero or about an unknown mean that all recordings share. The mean is normal
/// about zero with the largest standard deviation of its group, and zero where the recordings do not differ. The
/// evidence of candidate models uses zero mean; a prediction may use the mean, because the next recording shares it.
#pragma once
#include <optional>

#include <bevel/diagnosis/inference/evidence.hpp>

namespace bevel::inference {

/// Prediction of some of a recording's measurements.
struct Forecast {
  std::vector<Eigen::Index> rows;  ///< Predicted rows, in the order of the likelihood.
  Eigen::VectorXd error;           ///< Measured minus mean, in the channels' units.
  Eigen::VectorXd below;           ///< Probability of less than was measured: uniform in (0, 1) for a correct model.
  double log_density = 0;          ///< Joint natural log density of these measurements.
};

/// Predictions of one recording.
struct Forecasts {
  Forecast all;                  ///< All measurements, as a new recording.
  Forecast beyond;               ///< Measurements after until_s, as a new recording.
  Forecast continued;            ///< The rows of \p beyond, given the measurements up to until_s.
  double log_density_first = 0;  ///< Joint natural log density of the measurements up to until_s.
  double log_others = 0;         ///< Result of log_evidence_of_others().
};

/// Selects the combinations of standard deviations whose posterior weight exceeds 1e-4.
/// @param grid Grid.
/// @param weights Posterior over \p grid.
/// @return Selected columns.
NuisanceGrid likely_part(const NuisanceGrid& grid, const Eigen::VectorXd& weights);

/// Mode of all recordings with the linear model about it.
struct LinearModel {
  const Fit* fit = nullptr;        ///< Fit; must outlive this object.
  std::vector<ArrowBlock> blocks;  ///< Normal equations about \p fit.
  /// Mean of the insertion-specific parameters about which the model is linear, if it is an unknown; its columns are
  /// the last shared ones. Empty: the mean is zero.
  Eigen::VectorXd mean{};
};
/// Adds an unknown mean of the insertion-specific parameters to the priors.
/// @param pulls Priors of the model's shared unknowns.
/// @param mean Mean about which the model is linear.
/// @return Priors with the mean last.
Pulls pulls_with_mean(const Pulls& pulls, const Eigen::VectorXd& mean);
/// Computes the prior precision of the mean: that of the largest standard deviation of its group, or of
/// kNone_sd where the recordings do not differ.
/// @param system Model.
/// @param nuisance_sd Standard deviation per group.
/// @return One precision per insertion-specific parameter.
Eigen::VectorXd mean_precision_of(const System& system, const Eigen::VectorXd& nuisance_sd);
/// Adds an unknown mean of the insertion-specific parameters to a model, linear about the mean of the other recordings.
/// @param model Model without a mean.
/// @param recording Recording to leave out; the number of recordings: none.
/// @return Model with a mean.
LinearModel with_mean(LinearModel model, std::size_t recording);
/// Computes the posterior over the between-insertion standard deviations from all recordings.
/// @param model Linear model.
/// @param curve Columns of the fit's curves.
/// @param grid Grid of standard deviations.
/// @return Weight of each column of \p grid.
Eigen::VectorXd spread_weights(LinearModel model, const CurveColumns& curve, const NuisanceGrid& grid);
/// Computes the log evidence of all recordings but one, summed over standard deviations. For one fit, results with and
/// without a mean have the same reference.
/// @param model Linear model.
/// @param curve Columns of the fit's curves.
/// @param spreads Grid of standard deviations.
/// @param recording Recording to leave out.
/// @return Natural log.
double log_evidence_of_others(LinearModel model, const CurveColumns& curve, const NuisanceGrid& spreads,
                              std::size_t recording);

/// Predicts one recording with the noise of the fits' likelihood. Its phases and event times stay as they are.
/// @param others Model fitted to the other recordings.
/// @param begun Model fitted to the others and this recording's measurements up to \p until_s, where the model may be
/// far from linear. Both models have a mean, or neither.
/// @param curve Columns of the fits' curves.
/// @param spreads Grid of standard deviations.
/// @param recording Index of the recording.
/// @param until_s End of the first measurements, in s from the recording's start.
/// @return Predictions; nothing outside the model's domain.
std::optional<Forecasts> forecast(LinearModel others, LinearModel begun, const CurveColumns& curve,
                                  const NuisanceGrid& spreads, std::size_t recording, double until_s);

/// Averages the predictions of several models. Continued predictions are also weighted by the first measurements.
/// @param models Predictions of the same measurements.
/// @param probabilities Probability of each model given the other recordings.
/// @return Prediction of the mixture.
Forecasts averaged(const std::vector<Forecasts>& models, const std::vector<double>& probabilities);

/// Computes the time up to which a share of a recording's measurements lies. Simultaneous measurements are not
/// separated.
/// @param recording Recording.
/// @param share Share, in [0, 1].
/// @return Time from the recording's start, in s.
double time_of_share(const SeriesSet& recording, double share);

}  // namespace bevel::inference
