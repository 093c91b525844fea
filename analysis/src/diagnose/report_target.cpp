// SPDX-License-Identifier: MIT
#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/report.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)

namespace {

void add_parts(report::Page& page, const Findings& f) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& effect : f.effects)
    rows.push_back({effect.name, probability(effect.probability), measured(effect.moved_at_depth_mm, 2)});
  for (const auto& one : f.discrepancies)
    rows.push_back({"discrepancy: " + std::string(info_of(one.curve.component).meaning),
                    probability(f.discrepancy_probability), measured(one.moved_at_depth_mm, 2)});
  page.table({"part", "probability", "moves the tip by (mm)"}, rows,
             "Where the cameras see the tip at the deepest reading of each recording: the model that was found without "
             "this one part, all else as found, against the whole of it, by the recordings' own motion; root mean "
             "square over recordings. Parts may work against each other, so they need not add up.");
}

void add_steered(report::Page& page, const Findings& f) {
  if (!f.not_steered.empty()) page.paragraph("Not steered to a target in simulation: " + f.not_steered + ".");
  if (!f.steered) return;
  const SteeredToTargets& s = *f.steered;
  const auto row = [&](const char* believed, const SteeredFigures& figures) {
    std::string stopped;
    for (const auto& one : figures.stopped)
      stopped += (stopped.empty() ? "" : "; ") + std::to_string(one.count) + ": " + stopped_in_words(one);
    return std::vector<std::string>{believed, measured(figures.median_mm, 2), measured(figures.worst_mm, 2),
                                    std::to_string(figures.arrived) + " of " + std::to_string(s.targets),
                                    stopped.empty() ? "-" : stopped};
  };
  page.table({"estimator and controller believe", "median miss (mm)", "worst (mm)", "arrived", "stopped by"},
             {row("the model file as it stands", s.as_it_stands), row("the model that was found", s.found)},
             "Steered in simulated time to targets drawn " + span_mm(s) + " deep (seed " + std::to_string(s.seed) +
                 "), the rig being the model that was found, with the noise of these recordings: from the true tip to "
                 "the target, where the needle came to rest, of those that arrived.");
  if (!s.not_known_live.empty())
    page.paragraph(
        "Part of the rig, but unknown to either software before an insertion, because it differs from one "
        "to the next: " +
        listed(s.not_known_live) + ".");
}

}  // namespace

void add_at_target(report::Page& page, const Findings& f) {
  if (f.effects.empty() && f.discrepancies.empty()) return;
  page.heading("At the target");
  add_parts(page, f);
  add_steered(page, f);
}

}  // namespace bevel::analysis
