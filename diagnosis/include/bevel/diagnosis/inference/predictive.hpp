// SPDX-License-Identifier: MIT
#pragma once
// One recording predicted from the others, reading by reading, in two ways: as a new recording, and continued from its
// first readings. By the linear model about a mode, exact where the readings are linear in everything:
//
//   y = h(m) + A (u - m) + e     u = (shared unknowns, the curve's values, the recording's own)
//
// u is normal: given the others, and about zero with the nuisances' standard deviations; over those there is a sum,
// each weighed by what it makes of the others (and, continued, of the first readings). Continued, u is conditioned on
// the first readings (Rasmussen and Williams 2006, A.6) and so is the noise: its whitening W is lower triangular in
// time, so that of a later part 2, given part 1, errors are W22^-1 [W (y - h)]_2, derivatives W22^-1 [W A]_2, and the
// noise's covariance is (W22' W22)^-1.
//
// What the recording has of its own is normal about zero, or about a mean that all recordings share and nobody knows:
// normal about zero with the largest standard deviation that is tried for its group, none where the recordings do not
// differ. Which set explains what recordings have in common is asked by the evidence, with a mean of zero; a prediction
// need not have the answer, and what the others have in common the next has too.
#include <optional>

#include <bevel/diagnosis/inference/evidence.hpp>

namespace bevel::inference {

// Of some of a recording's readings.
struct Forecast {
  std::vector<Eigen::Index> rows;  // which: in the order of the likelihood's rows
  Eigen::VectorXd error;           // measured - mean, in the channels' units
  Eigen::VectorXd below;           // probability of less than was measured: uniform in (0, 1) if the model is right
  double log_density = 0;          // of all of these readings together, natural
};

struct Forecasts {
  Forecast all;                  // every reading, as of a new recording
  Forecast beyond;               // those after until_s, as of a new recording
  Forecast continued;            // the same ones, given the readings up to until_s
  double log_density_first = 0;  // of the readings up to until_s together
  double log_others = 0;         // log_evidence_of_others()
};

// Those combinations of the nuisances' standard deviations that have a share in the posterior worth a computation.
NuisanceGrid likely_part(const NuisanceGrid& grid, const Eigen::VectorXd& weights);

// A mode and the linear model about it, of all recordings.
struct LinearModel {
  const Fit* fit = nullptr;
  std::vector<ArrowBlock> blocks;
  Eigen::VectorXd mean{};  // of the nuisances, where it is an unknown: about this; its columns are the last shared ones
};
// Priors of its shared part with that mean, about the model's; and its precision: normal by the widest standard
// deviation that is tried, none where the nuisances do not vary.
Pulls pulls_with_mean(const Pulls& pulls, const Eigen::VectorXd& mean);
Eigen::VectorXd mean_precision_of(const System& system, const Eigen::VectorXd& nuisance_sd);
// The same with a mean of the nuisances that is unknown, about that of the other recordings' (of all: past the last).
LinearModel with_mean(LinearModel model, std::size_t recording);
// Posterior over the grid of the nuisances' standard deviations, of all recordings.
Eigen::VectorXd spread_weights(LinearModel model, const CurveColumns& curve, const NuisanceGrid& grid);
// Of all recordings but this one, over the spreads: for one fit on one scale, with a mean and without.
double log_evidence_of_others(LinearModel model, const CurveColumns& curve, const NuisanceGrid& spreads,
                              std::size_t recording);

// others: fitted to the other recordings; begun: to them and this one's readings up to until_s, where the model may be
// far from linear. By the noise of their likelihood; this recording's phases and instants are taken as they stand.
// Both with a mean of the nuisances or neither. Empty outside the model's domain.
std::optional<Forecasts> forecast(LinearModel others, LinearModel begun, const CurveColumns& curve,
                                  const NuisanceGrid& spreads, std::size_t recording, double until_s);

// Of several models of the same readings, with their probabilities given the others; continued, they are weighed by the
// first readings too.
Forecasts averaged(const std::vector<Forecasts>& models, const std::vector<double>& probabilities);

// The time up to which a share of a recording's readings lies: of two at one time both or none.
double time_of_share(const SeriesSet& recording, double share);

}  // namespace bevel::inference
