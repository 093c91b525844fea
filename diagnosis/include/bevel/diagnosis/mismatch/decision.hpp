// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Converts the posterior over candidate models into a verdict and selects the adopted model.
///
/// The verdict is "nothing missing" if neither an effect nor a discrepancy of consequence is likelier than not.
/// Otherwise all probabilities are conditional on something being missing:
/// - The verdict is "unknown effect" if a discrepancy of consequence is likelier than not.
/// - Every effect that is likelier than not is named.
/// - An additional effect can be likelier than not although confounders share its probability. Then the likeliest
///   candidate model with an additional effect is adopted, and the confounders are listed with that effect.
/// - An effect is named only if its probability, jointly with that of its confounders, is at least 0.5, the 95 %
///   interval of one of its sizes excludes "no effect", and its log Bayes factor is positive.
/// - The verdict is "inconclusive" if these rules leave no explanation, or if too much of the probability belongs to
///   candidate models that were not fitted.
#include <functional>

#include <bevel/diagnosis/inference/posterior.hpp>
#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>

namespace bevel::diagnosis {

/// Size from which an effect counts as visible, in standard deviations of the noise, summed over the recordings.
inline constexpr double kVisibleSigmas = 5.0;
/// Computes the size from which a discrepancy is one of consequence. Half its square equals minus the log prior odds of
/// an effect. A smaller discrepancy would not be named if it were an effect of the library; it is an error of form,
/// which the intervals include.
/// @param rules rules of the search, with the log prior odds of an effect
/// @return size in standard deviations of the noise, summed over the recordings
double consequence_sigmas(const inference::SearchRules& rules);

/// One mode of the posterior, linearised. Valid as long as the search.
struct ChosenModel {
  const inference::Fit* fit = nullptr;                ///< fit at the mode; owned by the search
  inference::CurveColumns curve;                      ///< columns of the discrepancy terms
  std::vector<inference::ArrowBlock> blocks;          ///< block-arrow normal equations, one block per recording
  std::vector<inference::CurveValues> discrepancy{};  ///< values of its discrepancy terms; empty: none
};

/// Least probability of a named effect, alone or jointly with the confounders that are listed with it.
inline constexpr double kLeastProbability = 0.5;
/// An effect is a confounder of another one if the model with it in the other one's place is not less likely than this.
inline constexpr double kConfounderOdds = 20;

/// Verdict with the adopted model.
struct Decision {
  Verdict verdict = Verdict::nothing_missing;  ///< the conclusion
  ChosenModel model;                           ///< adopted model; inconclusive: the nominal model
  double probability = 0;                      ///< of the verdict, in [0, 1]; inconclusive: 0
  /// Why likely effects are not named, one sentence each; inconclusive: why nothing is concluded.
  std::vector<std::string> reasons{};
};
/// Returns why a member of a model may not be named (a clause); empty if it may.
using FaultOfName = std::function<std::string(const ChosenModel& model, std::size_t member)>;

/// Selects the verdict and the adopted model.
/// @param search completed search
/// @param posterior posterior over its candidate models
/// @param fault_of evidence that a name needs in addition to its probability (found_effects.hpp: fault_of_name)
/// @return verdict, adopted model and reasons
Decision decide(const inference::Search& search, const inference::Posterior& posterior, const FaultOfName& fault_of);
/// Returns the verdict "inconclusive" with the nominal model.
/// @param search completed search
/// @param reasons one sentence each
/// @return the verdict, with probability 0
Decision inconclusive(const inference::Search& search, std::vector<std::string> reasons);
/// Lists the confounders of one member of a candidate model: the effects that replace it at odds of less than
/// kConfounderOdds to 1.
/// @param search completed search
/// @param posterior posterior over its candidate models
/// @param set the candidate model
/// @param effect the member, an index into System::effects()
/// @return names in alphabetical order, without the effect's own
std::vector<std::string> confounders_of(const inference::Search& search, const inference::Posterior& posterior,
                                        const inference::ModelSet& set, std::size_t effect);
/// Computes the probability that the model has this effect or one of its confounders.
/// @param search completed search
/// @param posterior posterior over its candidate models
/// @param set candidate model that defines the confounders
/// @param effect the member, an index into System::effects()
/// @return posterior probability, in [0, 1]
double joint_probability(const inference::Search& search, const inference::Posterior& posterior,
                         const inference::ModelSet& set, std::size_t effect);
/// Linearises a fit of the search.
/// @param search completed search
/// @param fit one of its fits; has to outlive the result
/// @return the model at the fit
ChosenModel model_of(const inference::Search& search, const inference::Fit& fit);

/// Refits the nominal model with the noise and the between-insertion standard deviations of another model. The physics
/// that the other model explains then appears in the residuals, not in the noise or in the insertion-specific
/// parameters.
/// @param search completed search
/// @param like fit of the other model
/// @return fit of the nominal model without effects and discrepancy
inference::Fit refitted_base(const inference::Search& search, const inference::Fit& like);

}  // namespace bevel::diagnosis
