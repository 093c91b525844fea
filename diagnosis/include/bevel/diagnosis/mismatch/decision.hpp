// SPDX-License-Identifier: MIT
#pragma once
// What the posterior says, as a verdict, and the model that stands for it.
//
//   nothing missing   neither an effect nor a discrepancy of any consequence is likelier than not
//   otherwise, given that something is missing: it is unknown where a discrepancy of consequence is likelier than not,
//   and every effect is named which is. Where one more is likelier than not, though confounders share its probability,
//   the likeliest of the sets with one more is named, and the confounders are listed with it.
//   An effect is named only if its probability, with that of its confounders, is at least 0.5, the interval of one of
//   its sizes excludes "no effect", and its log Bayes factor is positive. If that leaves no explanation of what is
//   missing, or too much of the probability is in models that were not fitted, the verdict is inconclusive.
#include <functional>

#include <bevel/diagnosis/inference/posterior.hpp>
#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>

namespace bevel::diagnosis {

// From so many standard deviations of the noise, summed over the recordings, an effect counts as visible.
inline constexpr double kVisibleSigmas = 5.0;
// And a discrepancy as one of consequence: half its square makes up for the prior odds of an effect, so that a smaller
// one would not be named if it had a name. That is an error of form, which the intervals carry.
double consequence_sigmas(const inference::SearchRules& rules);

// A model to write, to draw and to compare with: one mode of the posterior. Lives as long as the search.
struct ChosenModel {
  const inference::Fit* fit = nullptr;
  inference::CurveColumns curve;
  std::vector<inference::ArrowBlock> blocks;
  std::vector<inference::CurveValues> discrepancy{};  // its curves; empty: none
};

/// Least probability of a named effect, alone or jointly with the confounders that are listed with it.
inline constexpr double kLeastProbability = 0.5;
/// An effect is a confounder of another one if the model with it in the other one's place is not less likely than this.
inline constexpr double kConfounderOdds = 20;

struct Decision {
  Verdict verdict = Verdict::nothing_missing;
  ChosenModel model;       // inconclusive: the nominal model
  double probability = 0;  // of the verdict, in [0, 1]; inconclusive: 0
  // Why likely effects are not named, one sentence each; inconclusive: why nothing is concluded.
  std::vector<std::string> reasons{};
};
/// Returns why a member of a model may not be named (a clause); empty if it may.
using FaultOfName = std::function<std::string(const ChosenModel& model, std::size_t member)>;

/// Decides on the verdict.
/// @param fault_of evidence that a name needs in addition to its probability (found_effects.hpp: fault_of_name)
Decision decide(const inference::Search& search, const inference::Posterior& posterior, const FaultOfName& fault_of);
/// Returns the verdict "inconclusive" with the nominal model.
/// @param reasons one sentence each
Decision inconclusive(const inference::Search& search, std::vector<std::string> reasons);
/// Lists the effects that explain the recordings about as well in the place of one member of a candidate model.
std::vector<std::string> confounders_of(const inference::Search& search, const inference::Posterior& posterior,
                                        const inference::ModelSet& set, std::size_t effect);
/// Computes the probability that the model has this effect or one of its confounders.
double joint_probability(const inference::Search& search, const inference::Posterior& posterior,
                         const inference::ModelSet& set, std::size_t effect);
// Any other fit, ready for the same uses.
ChosenModel model_of(const inference::Search& search, const inference::Fit& fit);

// The needle alone, refitted by the noise and the variation that go with another model: what that model explains shows
// in its residuals, and is neither noise nor variation.
inference::Fit refitted_base(const inference::Search& search, const inference::Fit& like);

}  // namespace bevel::diagnosis
