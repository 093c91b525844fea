// SPDX-License-Identifier: MIT
#include <cstdio>

#include <bevel/analysis/close_loop/report.hpp>
#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/io/live_effects.hpp>

namespace bevel::analysis {
namespace {

std::string rig_sentence(const ClosedLoop& loop) {
  const auto &before = loop.rig[kRefitted], &after = loop.rig[kAugmented];
  const std::string change = measured(before.rmse_mm) + " to " + measured(after.rmse_mm) +
                             " mm rms, chi2 per reading " + measured(before.chi2_per_reading) + " to " +
                             measured(after.chi2_per_reading);
  if (after.chi2_per_reading < before.chi2_per_reading)
    return "The simulated rig comes nearer to the recordings: " + change + " (1 is the camera's noise alone).";
  return "The simulated rig does not come nearer to the recordings: " + change + ".";
}

std::string estimator_sentence(const std::array<EstimatorFigure, kStages>& stages, const std::string& setting) {
  const auto &before = stages[kRefitted], &after = stages[kAugmented];
  const auto coloured = [](const EstimatorFigure& f) {
    return std::to_string(f.coloured) + " of " + std::to_string(f.series);
  };
  const std::string change = "NIS " + measured(before.nis.mean()) + " to " + measured(after.nis.mean()) +
                             ", coloured series " + coloured(before) + " to " + coloured(after);
  std::string text = "The estimator, " + setting + ": " + change + ". ";
  if (before.consistent() && after.consistent())
    return text +
           "It passes with either model: one recording at a time is a weaker test than the fit over all of them.";
  if (after.consistent()) return text + "Its innovations are now what a complete model leaves.";
  return text + "That is not what a complete model leaves: NIS " + measured(after.nis.lowest()) + " to " +
         measured(after.nis.highest()) + " and at most " + std::to_string(after.coloured_by_chance) + " coloured.";
}

std::string targeting_sentence(const std::array<TargetingFigure, kStages>& stages, const WithInterval& gain_mm,
                               const std::string& filter) {
  char change[200];
  std::snprintf(change, sizeof change,
                "mean miss %.3f to %.3f mm, a fall of %.3f mm [%.3f, %.3f] over the same %zu insertions",
                stages[kRefitted].mean_mm.value, stages[kAugmented].mean_mm.value, gain_mm.value, gain_mm.low,
                gain_mm.high, stages[kRefitted].miss_mm.size());
  if (gain_mm.low > 0) return "Targeting improves with " + filter + ": " + change + ".";
  if (gain_mm.high < 0) return "Targeting gets worse with " + filter + ": " + change + ".";
  return "Targeting does not improve by more than chance with " + filter + ": " + change +
         ". The tip is seen while it is steered, so that what the model leaves out is corrected as it shows.";
}

std::string axes_sentence(const TargetingFigures& t) {
  char text[320];
  std::snprintf(text, sizeof text,
                "The controller turns the base through the dead band ahead of the tip. Were only the estimator told, "
                "the mean miss would be %.3f mm, %s: a difference of %.3f mm [%.3f, %.3f].",
                t.axes_not_undone.mean_mm.value,
                t.gain_by_axes_mm.low > 0    ? "more"
                : t.gain_by_axes_mm.high < 0 ? "less"
                                             : "the same but for chance",
                t.gain_by_axes_mm.value, t.gain_by_axes_mm.low, t.gain_by_axes_mm.high);
  return text;
}

std::string no_gain_sentence(const io::EffectEntry& entry, const std::string& unknown) {
  return "Targeting cannot improve by " + entry.name + ": its " + unknown +
         " differs from recording to recording and is not known before the next insertion, so the live estimator and "
         "the controller do without it. The rig has it, drawn anew for each insertion.";
}

}  // namespace

std::string found_in_words(const ClosedLoop& loop) {
  std::string text;
  for (const auto& entry : loop.models[kAugmented].effects) {
    std::string values;
    for (const auto& [name, value] : entry.parameters)
      values += (values.empty() ? "" : ", ") + name + " " + number(value);
    text += (text.empty() ? "" : "; ") + entry.name + (values.empty() ? "" : " (" + values + ")");
  }
  return text.empty() ? "nothing" : text;
}

std::vector<std::string> conclusions(const ClosedLoop& loop) {
  std::vector<std::string> all;
  const auto& effects = loop.models[kAugmented].effects;
  if (loop.findings.verdict == diagnosis::Verdict::unknown_effect)
    all.push_back(
        "Something is missing that is on no list: the augmented model holds only what could be named, and the figures "
        "show what remains.");
  if (effects.empty()) {
    all.push_back("No effect was named: the augmented model is the refitted one, and nothing is expected to change.");
  }
  all.push_back(rig_sentence(loop));
  all.push_back(estimator_sentence(loop.estimator.known, "with the needle known as the fit knows it"));
  all.push_back(estimator_sentence(loop.estimator.free, "choosing a needle for each recording"));
  const TargetingFigures& t = loop.targeting;
  if (!effects.empty()) {
    all.push_back(targeting_sentence(t.live, t.gain_mm, "the filter as it runs live"));
    all.push_back(targeting_sentence(t.forgiving, t.gain_forgiving_mm, "a forgiving filter"));
  }
  for (const auto& entry : effects)
    if (const std::string unknown = io::unknown_beforehand(entry); !unknown.empty())
      all.push_back(no_gain_sentence(entry, unknown));
  if (t.axes_matter) all.push_back(axes_sentence(t));
  for (const bool forgiving : {false, true})
    for (std::size_t s = 0; s < kStages; ++s)
      if (const auto& figure = forgiving ? t.forgiving[s] : t.live[s]; figure.stopped > 0)
        all.push_back("With the model " + std::string(kStageNames[s]) +
                      (forgiving ? " and a forgiving filter, " : ", ") + std::to_string(figure.stopped) + " of " +
                      std::to_string(figure.miss_mm.size()) + " insertions ended before the target (" + figure.why +
                      "); they count with their distance to it.");
  all.push_back(
      "The steered rig is the augmented model itself, the best known; what neither knows of the real one is not in the "
      "targeting figure.");
  return all;
}

}  // namespace bevel::analysis
