// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/pictures.hpp>
#include <bevel/analysis/diagnose/report.hpp>
#include <bevel/model/effects/effect.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)

namespace {

// "0.055 rad"; "1 ± 0.13" where an effect vanishes at one.
std::string size_of(const DetectableSize& d, double size) {
  if (!std::isfinite(size)) return "no size in reach";
  const model::Effect* effect = model::find_effect(d.effect);
  double none = 0;
  if (effect != nullptr)
    for (const auto& p : effect->parameters())
      if (p.name == d.parameter && std::isfinite(p.none)) none = p.none;
  const std::string unit = unit_of(d.parameter);
  return (none == 0 ? "" : number(none) + " ± ") + number(size, 2) + (unit.empty() ? "" : " " + unit);
}

std::string words_of(const std::string& parameter) {
  const std::string words = in_words(parameter);
  return words.substr(0, words.find(" ("));
}

// Stages that take next to nothing are not worth their digits.
std::string seconds_of(double seconds) { return seconds < 0.05 ? "< 0.1" : measured(seconds, seconds < 1 ? 1 : 3); }

// The same motion often shows several effects: said once.
std::vector<std::string> experiments_of(const Findings& f) {
  std::vector<std::pair<std::string, std::vector<std::string>>> by_motion;
  for (const auto& d : f.detectable) {
    if (d.experiment.empty() || was_found(f, d.effect)) continue;
    auto at = std::find_if(by_motion.begin(), by_motion.end(), [&](const auto& m) { return m.first == d.experiment; });
    if (at == by_motion.end()) at = by_motion.insert(by_motion.end(), {d.experiment, {}});
    if (std::find(at->second.begin(), at->second.end(), d.effect) == at->second.end()) at->second.push_back(d.effect);
  }
  std::vector<std::string> lines;
  for (const auto& [motion, effects] : by_motion) {
    std::string line;
    for (const auto& effect : effects) line += (line.empty() ? "" : ", ") + effect;
    lines.push_back(line + ": " + motion);
  }
  return lines;
}

}  // namespace

void add_evidence(report::Page& page, const Findings& f) {
  if (f.tried.empty()) return;
  page.heading("Which explanations are likely");
  std::vector<std::vector<std::string>> shares;
  for (const auto& e : f.explanations) {
    std::string names;
    for (const auto& name : e.effects) names += (names.empty() ? "" : " + ") + name;
    shares.push_back(
        {names.empty() ? "no effect" : names, probability(e.probability), probability(e.with_discrepancy)});
  }
  page.table({"effects in the model", "probability", "of it with a discrepancy"}, shares,
             "Neither an effect nor a discrepancy of any consequence: " + probability(f.nothing_probability) +
                 ". Probabilities hold given that one of the fitted models is true. The models that were not fitted "
                 "would have an estimated share of " +
                 percent(f.not_visited) + ".");
  page.heading("Every effect that was tried");
  page.paragraph(
      "Each effect added to the needle alone. The bar is the natural logarithm of its Bayes factor: how much likelier "
      "the recordings are with it than without, over all sizes that it may have. The black mark is where it is "
      "likelier "
      "than not, its prior odds included.");
  const char* const caption =
      f.verdict == Verdict::nothing_missing ? "Effects alone, best first. None passes its mark."
      : f.verdict == Verdict::inconclusive
          ? "Effects alone, the largest log Bayes factor first. The recordings do not decide between them."
      : f.verdict == Verdict::effects_found
          ? "Effects alone, best first. Several may pass because they look alike; sets of effects are compared as a "
            "whole, above."
          : "Effects alone, best first. Many may pass, because anything that bends the path a little explains some of "
            "it; a discrepancy without a name explains more.";
  page.picture(ranking_picture(f, f.tried), caption);
  if (!f.beside.empty()) {
    const std::string beside = f.beside.front().beside;
    const auto shown = static_cast<std::ptrdiff_t>(std::min<std::size_t>(f.beside.size(), 8));
    page.picture(ranking_picture(f, {f.beside.begin(), f.beside.begin() + shown}),
                 "The best of the others, tried beside what was found" +
                     (beside.empty() ? std::string() : " (" + beside + ")") + ".");
  }
  std::vector<std::vector<std::string>> rows;
  for (const auto& t : f.tried) {
    std::string sizes;
    for (const auto& [name, value] : t.parameters)
      sizes += (sizes.empty() ? "" : ", ") + in_words(name) + " " + number(value);
    rows.push_back({t.name, log_factor(t.log_bayes_factor),
                    !t.log_bayes_factor ? "not computed"
                    : !t.fitted ? (t.with_discrepancy ? "linear estimate, with a discrepancy" : "linear estimate")
                                : (t.with_discrepancy ? "fitted, with a discrepancy" : "fitted"),
                    sizes});
  }
  page.folded("the figures", [&](report::Page& inside) {
    inside.table({"effect, alone", "log Bayes factor", "by", "size"}, rows);
  });
}

namespace {

// As a new insertion and continued, on the same readings.
void add_two_ways(report::Page& page, const Findings& f) {
  const HeldOut& h = f.held_out;
  std::vector<std::pair<std::string, const InsertionPredicted*>> models;
  if (!adopts_a_model(f.verdict)) {
    models = {{"needle refitted", &h.predicted_before}};
  } else {
    models = {{"before", &h.predicted_before}, {"after", &h.predicted_after}};
  }
  std::vector<std::vector<std::string>> rows, channels;
  for (const auto& [model, p] : models)
    for (const auto& [way, figures] : {std::pair("new insertion, all readings", &p->whole),
                                       std::pair("new insertion, beyond the first third", &p->beyond),
                                       std::pair("continued, beyond the first third", &p->continued)})
      rows.push_back(
          {model, way, measured(figures->rmse_mm), percent(figures->share_in_95), number(figures->log_density, 3)});
  for (std::size_t c = 0; c < f.channels.size(); ++c)
    for (const auto& [model, p] : models) {
      std::vector<std::string> row{f.channels[c], model};
      for (const PredictionFigures* figures : {&p->whole, &p->beyond, &p->continued})
        row.push_back(c < figures->channels.size() ? measured(figures->channels[c].rmse) + " " + f.units[c] + " (" +
                                                         percent(figures->channels[c].share_in_95) + ")"
                                                   : "-");
      channels.push_back(std::move(row));
    }
  page.subheading("As a new insertion, and continued");
  page.paragraph(
      "A new insertion is known only by how much insertions differ; of one that goes on, its first third has said what "
      "it has of its own. Between the two lies what a few readings at the start are worth.");
  page.table({"model", "predicted as", "rms (mm)", "within 95 %", "log density per reading"}, rows,
             "Of all readings the share within their 95 % intervals. Before: the needle alone, by its own noise and "
             "variation.");
  page.table({"channel", "model", "new", "new, beyond the first third", "continued"}, channels,
             "By channel: root mean square error, and the share of its readings within their 95 % intervals.");
}

}  // namespace

void add_held_out(report::Page& page, const Findings& f) {
  if (f.held_out.recordings.empty()) return;
  page.heading("Recordings predicted");
  page.paragraph(
      "Each recording in turn is put aside; by the others the sets that were looked at are weighed and their "
      "parameters "
      "fitted, and the one put aside is predicted as a new insertion. An effect of the wrong name fits what it has "
      "seen and gets the rest wrong.");
  page.picture(held_out_picture(f),
               !adopts_a_model(f.verdict)
                   ? "Each recording predicted from the others. On the right they should lie near the line, "
                     "none far off."
                   : "Each recording predicted from the others, before and after. Blue should lie left of orange, and "
                     "on the right picture near the line.");
  add_two_ways(page, f);
}

void add_reach(report::Page& page, const Findings& f) {
  if (f.detectable.empty() && f.confusion_names.empty()) return;
  page.heading("What these recordings could have shown");
  if (!f.detectable.empty()) {
    page.paragraph(
        "The smallest size of each effect that would have been seen: an absence is ruled out only above it. "
        "\"Absorbed\" is the share of an effect's mark on the path that a slightly different needle, or insertions "
        "that "
        "differ, would leave as well; what they absorb nobody can see.");
    std::vector<std::vector<std::string>> rows;
    for (const auto& d : f.detectable)
      rows.push_back({d.effect, words_of(d.parameter), size_of(d, d.size), size_of(d, d.typical), percent(d.absorbed)});
    page.table({"effect", "parameter", "seen from", "typical", "absorbed"}, rows);
    const auto experiments = experiments_of(f);
    if (!experiments.empty())
      page.paragraph("Effects that these recordings could not show at their usual size, and motions that would:")
          .list(experiments);
  }
  const std::string picture = confusion_picture(f);
  if (picture.empty()) return;
  page.subheading("Which effects look alike here");
  page.picture(picture,
               "How alike two effects look in these recordings once the needle and the variation between insertions "
               "have absorbed what they can: 0 altogether different, 1 the same. Above 0.95 only their forms and "
               "their usual sizes tell them apart; a rival at odds of less than 20 to 1 is named beside what was "
               "found. The first column is what is absorbed.");
}

namespace {
constexpr double kConvincing = 10;  // chi2
constexpr double kFeasible = 20;    // recordings of one motion
}  // namespace

void add_next_experiment(report::Page& page, const Findings& f) {
  page.heading("The next experiment");
  if (!is_experiment_needed(f) || !f.next_experiment) {
    page.paragraph(is_experiment_needed(f)
                       ? "No motion that was simulated separates the explanations that these recordings leave open."
                       : "None needed: the verdict has a probability of " + probability(f.probability) + ".");
    return;
  }
  const auto& next = *f.next_experiment;
  page.paragraph("Of the safe motions that were simulated, this one tells " + next.separates[0] + " from " +
                 next.separates[1] + " best, each refitted to explain the other away.");
  page.code(next.script);
  const double recordings = std::ceil(kConvincing / next.expected_gain);
  page.paragraph("One recording of it should separate them by " + number(next.expected_gain, 2) +
                 " in chi2 (10 is convincing, 25 settles it)" +
                 (recordings <= 1           ? "."
                  : recordings <= kFeasible ? ", so it takes " + number(recordings, 2) + " of them."
                                            : ", so none of these motions tells them apart in earnest."));
}

namespace {

std::string near_entry(const Findings& f, std::size_t channel) {
  if (channel >= f.scatter.size() || !(f.scatter[channel].length_mm > 0)) return "the same";
  return number(f.scatter[channel].sd_at_entry(), 2) + " times as much, for some " +
         number(f.scatter[channel].length_mm, 2) + " mm";
}

}  // namespace

void add_noise_and_checks(report::Page& page, const Findings& f) {
  page.heading("Noise and checks");
  const bool near = std::ranges::any_of(f.scatter, [](const auto& one) { return one.length_mm > 0; });
  std::vector<std::string> head{"channel", "standard deviation (mm)"};
  if (near) head = {"channel", "standard deviation (mm; rad)", "near the entry"};
  std::vector<std::vector<std::string>> rows;
  for (std::size_t c = 0; c < f.channels.size() && c < f.noise.sigma.size(); ++c) {
    rows.push_back({f.channels[c], measured(f.noise.sigma[c])});
    if (near) rows.back().push_back(near_entry(f, c));
  }
  page.paragraph(
      "Noise of one reading, fitted beside what was found. Successive readings, " + number(1 / f.noise.frame_s, 3) +
      " a second, correlate by " + number(f.noise.ar1, 2) +
      (f.noise.ar2 != 0 ? " (and those two apart, given the one between, by " + number(f.noise.ar2, 2) + ")" : "") +
      (f.noise.tails.degrees > 0
           ? "; its tails are heavy, those of Student's t with " + number(f.noise.tails.degrees) + " degrees of freedom"
           : "") +
      "; " + percent(f.noise.outlier_share) + " of them are outliers.");
  page.table(head, rows);
  const auto& c = f.checks;
  page.table({"check of the final model", "found", "passed if"},
             {{"chi2 per measurement, by the noise around a smoothing curve through the residuals",
               measured(c.chi2_per_dof, 4), interval(c.band)},
              {"correlation left in the residuals (Ljung-Box p)",
               c.ljung_box_p < 0.001 ? "< 0.001" : number(c.ljung_box_p, 2), "above 0.01"}},
             what_is_left(c));
  if (!f.remarks.empty()) page.subheading("Remarks").list(f.remarks);
}

void add_making(report::Page& page, const Findings& f, const Provenance& made_of) {
  page.heading("How this was made");
  std::vector<std::vector<std::string>> files{{"model in use", made_of.model.name, made_of.model.sha256}};
  for (const auto& file : made_of.recordings) files.push_back({"recording", file.name, file.sha256});
  page.table(
      {"", "file", "SHA-256"}, files,
      "By bevel-diagnose " + made_of.version +
          ". The same files and version give the same verdict, to the last bit: nothing is drawn at random but the "
          "targets and noise of steered insertions, by a fixed seed.");
  std::vector<std::vector<std::string>> rows;
  double total = 0;
  for (const auto& t : f.times) {
    rows.push_back({t.stage, seconds_of(t.seconds)});
    total += t.seconds;
  }
  rows.push_back({"all", seconds_of(total)});
  page.table({"stage", "seconds"}, rows);
}

}  // namespace bevel::analysis
