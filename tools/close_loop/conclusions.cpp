#include <cstdio>

#include "tools/close_loop/report.hpp"
#include "tools/diagnose/figures.hpp"

namespace bevel::close_loop {
namespace {

using diagnose::measured;

std::string rig_sentence(const ClosedLoop& loop) {
  const auto &before = loop.rig[kRefitted], &after = loop.rig[kAugmented];
  const std::string change = measured(before.rmse_mm) + " to " + measured(after.rmse_mm) +
                             " mm rms, chi2 per reading " + measured(before.chi2_per_reading) + " to " +
                             measured(after.chi2_per_reading);
  if (after.chi2_per_reading < before.chi2_per_reading)
    return "The simulated rig comes nearer to the recordings: " + change + " (1 is the camera's noise alone).";
  return "The simulated rig does not come nearer to the recordings: " + change + ".";
}

std::string estimator_sentence(const ClosedLoop& loop) {
  const auto &before = loop.estimator.known[kRefitted], &after = loop.estimator.known[kAugmented];
  const auto coloured = [](const EstimatorFigure& f) {
    return std::to_string(f.coloured) + " of " + std::to_string(f.series);
  };
  std::string text = "Innovations with the needle known as the fit knows it: NIS " + measured(before.nis.mean()) +
                     " to " + measured(after.nis.mean()) + ", coloured series " + coloured(before) + " to " +
                     coloured(after) + "; ";
  text += after.consistent() ? "they are now what a complete model leaves."
                             : "they are not yet what a complete model leaves (NIS in its band, no more than " +
                                   std::to_string(after.coloured_by_chance) + " coloured).";
  const auto &free_before = loop.estimator.free[kRefitted], &free_after = loop.estimator.free[kAugmented];
  if (free_before.consistent() && free_after.consistent() && !before.consistent())
    text +=
        " Where each recording may choose its own k and lambda the filter hides what is missing: it passes with "
        "either model.";
  return text;
}

std::string targeting_sentence(const ClosedLoop& loop) {
  const TargetingFigures& t = loop.targeting;
  char change[160];
  std::snprintf(change, sizeof change,
                "mean miss %.3f to %.3f mm, fall %.3f mm [%.3f, %.3f] over the same %zu insertions",
                t.stages[kRefitted].mean_mm.value, t.stages[kAugmented].mean_mm.value, t.gain_mm.value, t.gain_mm.low,
                t.gain_mm.high, t.stages[kRefitted].miss_mm.size());
  if (t.gain_mm.low > 0) return std::string("Targeting improves: ") + change + ".";
  if (t.gain_mm.high < 0) return std::string("Targeting gets worse: ") + change + ".";
  return std::string("Targeting does not improve by more than chance: ") + change +
         ". The tip is seen while it is steered, and what the model leaves out is corrected as it shows.";
}

std::string unknown_beforehand(const io::EffectEntry& entry) {
  std::string names;
  for (const auto& p : model::find_effect(entry.name)->parameters())
    if (p.scope == model::Scope::recording) names += (names.empty() ? "" : ", ") + std::string(p.name);
  return "Targeting cannot improve by " + entry.name + ": its " + names +
         " differs from recording to recording and is not known before the next insertion, so the live estimator and "
         "the controller do without it. The rig has it, drawn anew for each insertion.";
}

}  // namespace

std::string found_in_words(const ClosedLoop& loop) {
  std::string text;
  for (const auto& entry : loop.models[kAugmented].effects) {
    std::string values;
    for (const auto& [name, value] : entry.parameters)
      values += (values.empty() ? "" : ", ") + name + " " + diagnose::number(value);
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
  all.push_back(estimator_sentence(loop));
  if (!effects.empty()) all.push_back(targeting_sentence(loop));
  for (const auto& entry : effects)
    if (!is_known_beforehand(entry)) all.push_back(unknown_beforehand(entry));
  const TargetingFigures& t = loop.targeting;
  if (t.axes_matter) {
    char text[256];
    std::snprintf(text, sizeof text,
                  "The controller turns the base through the dead band ahead of the tip; with the effect in the "
                  "estimator alone the mean miss is %.3f mm [%.3f, %.3f].",
                  t.axes_not_undone.mean_mm.value, t.axes_not_undone.mean_mm.low, t.axes_not_undone.mean_mm.high);
    all.emplace_back(text);
  }
  for (std::size_t s = 0; s < kStages; ++s)
    if (const auto& figure = t.stages[s]; figure.stopped > 0)
      all.push_back("With the model " + std::string(kStageNames[s]) + ", " + std::to_string(figure.stopped) + " of " +
                    std::to_string(figure.miss_mm.size()) + " insertions ended before the target (" + figure.why +
                    "); they count with their distance to it.");
  all.push_back(
      "The steered rig is the augmented model itself, the best known; what neither knows of the real one is not in the "
      "targeting figure.");
  return all;
}

}  // namespace bevel::close_loop
