#pragma once
// What the posterior says, as a verdict, and the model that stands for it.
//
//   nothing missing   neither an effect nor a discrepancy of any consequence is likelier than not
//   otherwise, given that something is missing: it is unknown where a discrepancy of consequence is likelier than not,
//   and every effect is named which is. Where one more is likelier than not, though rivals share its probability, the
//   likeliest of the sets with one more is named, and the rivals beside it.
#include "diagnosis/inference/posterior.hpp"
#include "diagnosis/mismatch/findings.hpp"
#include "diagnosis/needle/needle_system.hpp"

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

struct Decision {
  Verdict verdict = Verdict::nothing_missing;
  ChosenModel model;
};
Decision decide(const inference::Search& search, const inference::Posterior& posterior);
// Any other fit, ready for the same uses.
ChosenModel model_of(const inference::Search& search, const inference::Fit& fit);

// The needle alone, refitted by the noise and the variation that go with another model: what that model explains shows
// in its residuals, and is neither noise nor variation.
inference::Fit refitted_base(const inference::Search& search, const inference::Fit& like);

}  // namespace bevel::diagnosis
