// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/mismatch/invariants.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <bevel/diagnosis/mismatch/decision.hpp>
#include <bevel/diagnosis/statistics/quantiles.hpp>
#include <bevel/model/effects/effect.hpp>

namespace bevel::diagnosis {

namespace {

std::string text(double value) {
  char out[32];
  std::snprintf(out, sizeof out, "%.3g", value);
  return out;
}

void check_name(const FoundEffect& effect, std::vector<std::string>& out) {
  const double probability = effect.ambiguous_with.empty() ? effect.probability : effect.joint_probability;
  if (!(probability >= kLeastProbability))
    out.push_back(effect.name + " has a probability of " + text(probability) + "; a name needs " +
                  text(kLeastProbability));
  const auto has_size = [](const FoundParameter& p) { return !std::isnan(p.none); };
  if (std::ranges::any_of(effect.parameters, has_size) && std::ranges::none_of(effect.parameters, excludes_none))
    out.push_back("the 95 % interval of the size of " + effect.name + " includes no effect");
  if (!(effect.log_bayes_factor > 0))
    out.push_back("the log Bayes factor of " + effect.name + " is " + text(effect.log_bayes_factor) +
                  "; a name needs a positive one");
}

// Its value is at the end of the range that a model file allows.
void check_bounds(const FoundEffect& effect, std::vector<std::string>& out) {
  const model::Effect* library = model::find_effect(effect.name);
  if (library == nullptr) return;
  for (const FoundParameter& p : effect.parameters)
    for (const model::EffectParameter& known : library->parameters())
      if (p.name == known.name && !p.at_bound && known.modulo == 0 && p.value != known.none &&
          (p.value <= known.lower || p.value >= known.upper))
        out.push_back(effect.name + "." + p.name + " is " + text(p.value) +
                      ", at the end of its range, and is not marked");
}

void check_tried(const std::vector<TriedEffect>& tried, std::vector<std::string>& out) {
  for (const TriedEffect& one : tried)
    if (one.log_bayes_factor && !std::isfinite(*one.log_bayes_factor))
      out.push_back("the log Bayes factor of " + one.name + " is no number");
}

void check_predictions(const HeldOut& held_out, std::vector<std::string>& out) {
  std::vector<double> gains;
  for (const HeldOutRecording& one : held_out.recordings)
    if (const double gain = one.predicted_after.whole.log_density - one.predicted_before.whole.log_density;
        std::isfinite(gain))
      gains.push_back(gain);
  const auto count = static_cast<double>(gains.size());
  if (count < 2) return;
  double mean = 0, square = 0;
  for (const double gain : gains) mean += gain / count;
  for (const double gain : gains) square += (gain - mean) * (gain - mean);
  const double std_error = std::sqrt(square / (count - 1) / count);
  if (mean < -std_error)
    out.push_back(
        "the adopted model predicts left-out recordings worse than the refitted nominal model: "
        "log density per measurement " +
        text(mean) + " (standard error " + text(std_error) + ")");
}

}  // namespace

std::vector<std::string> violations(const Findings& findings) {
  std::vector<std::string> out;
  check_tried(findings.tried, out);
  check_tried(findings.beside, out);
  for (const ProposedForm& form : findings.proposals)
    if (!std::isfinite(form.amplitude) || !std::isfinite(form.shape))
      out.push_back("the equation " + form.equation + " has a value that is no number");
    else if (std::abs(form.amplitude) <= k95 * form.amplitude_sd)
      out.push_back("the interval of a in the equation " + form.equation + " includes none");
    else if (form.shape < form.shape_low || form.shape > form.shape_high)
      out.push_back("the value of s in the equation " + form.equation + " is outside its interval");
  if (findings.verdict == Verdict::inconclusive) {
    if (!findings.effects.empty() || !findings.discrepancies.empty())
      out.emplace_back("an inconclusive verdict names an effect or a discrepancy");
    if (findings.reasons.empty()) out.emplace_back("an inconclusive verdict states no reason");
    return out;
  }
  for (const FoundEffect& effect : findings.effects) {
    check_name(effect, out);
    check_bounds(effect, out);
  }
  if (findings.verdict == Verdict::effects_found && findings.effects.empty())
    out.emplace_back("effects were found, and none is named");
  if (findings.verdict == Verdict::nothing_missing && !(findings.effects.empty() && findings.discrepancies.empty()))
    out.emplace_back("nothing is missing, and something is named");
  if (findings.not_visited > inference::kMostNotFitted)
    out.push_back(text(100 * findings.not_visited) +
                  " % of the probability is in candidate models that were not fitted");
  if (adopts_a_model(findings.verdict)) check_predictions(findings.held_out, out);
  return out;
}

}  // namespace bevel::diagnosis
