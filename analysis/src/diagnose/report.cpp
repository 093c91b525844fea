// SPDX-License-Identifier: MIT
#include <bevel/analysis/diagnose/report.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/pictures.hpp>
#include <bevel/analysis/diagnose/verdict_json.hpp>
#include <bevel/diagnosis/mismatch/effect_source.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)

namespace {

std::vector<std::string> names_of(const std::vector<FoundEffect>& effects) {
  std::vector<std::string> names;
  for (const auto& effect : effects) names.push_back(effect.name);
  return names;
}

// "torsional_windup: lag at 100mm 0.823 ± 0.031 rad"
std::string sizes_of(const FoundEffect& effect) {
  std::string text = effect.name;
  std::string between = ": ";
  for (const auto& p : effect.parameters) {
    const std::string unit = unit_of(p.name);
    std::string words = in_words(p.name);
    words = words.substr(0, words.find(" ("));
    text += between + words + " " + with_error(p.value, p.std_error) + (unit.empty() ? "" : " " + unit);
    between = ", ";
  }
  return text;
}

std::string held_out_sentence(const Findings& f) {
  const HeldOut& h = f.held_out;
  if (f.two_groups)
    return "The second group's recordings, each predicted as a new insertion, are off by " +
           measured(h.before.rmse_mm) + " mm (rms per axis) by what both groups share, and with the change by " +
           measured(h.after.rmse_mm) + " mm; noise alone would be " + measured(h.noise_floor.rmse_mm) +
           " mm. chi2 per reading goes from " + measured(h.before.chi2_per_dof) + " to " +
           measured(h.after.chi2_per_dof) + " (1: as far off as the model says it may be).";
  const std::string with =
      f.discrepancies.empty() ? "with what was found" : "with the discrepancy below that describes the rest";
  return "On recordings that it was not fitted to, the model file as it stands is off by " +
         measured(h.as_it_stands.rmse_mm) + " mm (rms per axis), its needle refitted by " + measured(h.before.rmse_mm) +
         " mm, and " + with + " by " + measured(h.after.rmse_mm) + " mm; noise alone would be " +
         measured(h.noise_floor.rmse_mm) + " mm. chi2 per reading goes from " + measured(h.before.chi2_per_dof) +
         " to " + measured(h.after.chi2_per_dof) + " (1: as far off as the model says it may be).";
}

report::Tone tone_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::nothing_missing:
      return report::Tone::good;
    case Verdict::effects_found:
      return report::Tone::plain;
    case Verdict::unknown_effect:
    case Verdict::inconclusive:
      return report::Tone::warning;
  }
  return report::Tone::plain;
}

std::string meaning_of(const Discrepancy& d) { return std::string(info_of(d.curve.component).meaning); }

std::string span_of(const Location& w) {
  const std::string from = number(w.range[0]);
  const std::string to = number(w.range[1]);
  return in_words(w.covariate) + " " + from + (from == to ? "" : " to " + to);
}

std::string depths_of(const MovedAtDepth& moved) {
  const std::string from = number(moved.depth_mm[0]), to = number(moved.depth_mm[1]);
  return from == to ? to : from + " to " + to;
}

bool has_rivals(const Findings& f) {
  return std::any_of(f.effects.begin(), f.effects.end(), [](const auto& e) { return !e.ambiguous_with.empty(); });
}

// The numbers of the verdict's box: how far off the model is, what that is at the target, and how sure the finding is.
std::vector<report::Fact> figures_of_verdict(const Findings& f) {
  std::vector<report::Fact> facts;
  const HeldOut& h = f.held_out;
  const bool one_model = !adopts_a_model(f.verdict);
  const auto add_error = [&](const char* label, const FitFigures& figures, const std::string& note) {
    facts.push_back({label, measured(figures.rmse_mm) + " mm", note});
  };
  const auto as_sure = [](const FitFigures& figures) { return "chi2 per reading " + measured(figures.chi2_per_dof); };
  if (!f.two_groups) add_error("error as it stands", h.as_it_stands, "model file as given; rms per axis, held out");
  const auto largest = [](const FitFigures& figures) { return "; largest " + measured(figures.max_mm) + " mm"; };
  add_error(f.two_groups ? "by what both groups share" : "its needle refitted", h.before,
            as_sure(h.before) + (one_model ? largest(h.before) : ""));
  if (!one_model)
    add_error(f.two_groups              ? "with the change"
              : f.discrepancies.empty() ? "with what was found"
                                        : "with the discrepancy",
              h.after, as_sure(h.after) + largest(h.after));
  add_error("noise alone", h.noise_floor, "the least that can be left");
  if (const auto moved = moved_at_depth(f); moved && !f.two_groups)
    facts.push_back({"tip at the target's depth moved by",
                     measured(one_model ? moved->from_file_mm : moved->from_refitted_mm, 2) + " mm",
                     (one_model ? "by refitting the needle"
                                : measured(moved->from_file_mm, 2) + " mm from where the model file has it") +
                         std::string("; rms, ") + depths_of(*moved) + " mm deep"});
  if (f.steered) {
    const SteeredToTargets& s = *f.steered;
    const auto miss = [](const SteeredFigures& figures) {
      return figures.arrived == 0 ? std::string("none") : measured(figures.median_mm, 2);
    };
    const bool all = s.as_it_stands.arrived == s.targets && s.found.arrived == s.targets;
    facts.push_back({"steered to a target, off by", miss(s.as_it_stands) + " → " + miss(s.found) + " mm",
                     "as it stands, and with what was found; median of " + std::to_string(s.targets) +
                         (all ? ""
                              : ", of which " + std::to_string(s.as_it_stands.arrived) + " and " +
                                    std::to_string(s.found.arrived) + " arrived")});
  }
  for (const auto& effect : f.effects)
    facts.push_back(
        {effect.name, probability(effect.probability),
         (effect.ambiguous_with.empty() ? "probability; no rival; "
                                        : "probability; or " + listed(effect.ambiguous_with, " or ") + "; ") +
             moved_in_words(effect.moved_at_depth_mm)});
  for (const Discrepancy& one : f.discrepancies)
    facts.push_back({"unknown part", meaning_of(one), "against " + in_words(model::name_of(one.curve.covariate))});
  facts.push_back(
      {"readings", std::to_string(f.readings),
       "in " + std::to_string(f.traces.size()) + " recordings; " + std::to_string(f.outliers) + " outliers"});
  return facts;
}

}  // namespace

void add_verdict(report::Page& page, const Findings& f) {
  std::string consequences;
  for (const auto& effect : f.effects) consequences += sizes_of(effect) + ". ";
  if (f.verdict == Verdict::nothing_missing && f.two_groups)
    consequences += "The second group's recordings are predicted by what both share to " +
                    measured(f.held_out.before.rmse_mm) + " mm (rms per axis), of which noise alone is " +
                    measured(f.held_out.noise_floor.rmse_mm) +
                    " mm. Nothing above the sizes listed under \"What these recordings could have shown\".";
  else if (f.verdict == Verdict::nothing_missing)
    consequences += "With its needle refitted, the model is off by " + measured(f.held_out.before.rmse_mm) +
                    " mm (rms per axis) on recordings that it was not fitted to, of which noise alone is " +
                    measured(f.held_out.noise_floor.rmse_mm) + " mm; chi2 per reading " +
                    measured(f.held_out.before.chi2_per_dof) +
                    " (1: as far off as the model says it may be). Nothing above the sizes listed under \"What these "
                    "recordings could have shown\".";
  else if (f.verdict == Verdict::inconclusive)
    consequences += "model.toml holds the nominal model, refitted. No physics was added to it.";
  else
    consequences += held_out_sentence(f);
  page.verdict(tone_of(f.verdict), headline_of(f.verdict, f.two_groups) + ". " + f.sentence, consequences,
               figures_of_verdict(f));
}

void add_what_to_do(report::Page& page, const Findings& f) {
  std::vector<std::string> todo;
  for (const auto& effect : f.effects)
    if (!effect.meaning.empty()) todo.push_back(effect.name + " means: " + effect.meaning + ".");
  if (f.two_groups) {
    todo.emplace_back(
        f.verdict == Verdict::inconclusive ? "Do not act on a change yet: record the next experiment below with both "
                                             "groups, and run bevel-diagnose again."
        : f.verdict == Verdict::nothing_missing
            ? "Read the table of detectable sizes before you rule a change out: a smaller one may well be there."
            : "model.toml is the model in use with what changed; the rest of it is as it was.");
    page.heading("What to do").list(todo);
    return;
  }
  switch (f.verdict) {
    case Verdict::nothing_missing:
      todo.emplace_back("Keep the physics of the model. Its needle refitted to these recordings is in model.toml.");
      todo.emplace_back(
          "Read the table of detectable sizes before you rule anything out: an effect below its size there may well be "
          "present.");
      break;
    case Verdict::effects_found:
      if (f.steered && is_refused(steering_with(*f.steered)))
        todo.emplace_back(
            "Put model.toml in place of the model in use for simulation and prediction, not for steering; or repair "
            "the "
            "rig and record again.");
      else
        todo.emplace_back(
            "Put model.toml in place of the model in use (simulator, estimator and bevel-predict read it), or repair "
            "the "
            "rig and record again.");
      if (f.steered) {
        std::string advice = steering_advice(*f.steered);
        advice.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(advice.front())));
        todo.push_back("In simulation (\"At the target\"): " + advice + ".");
      }
      if (has_rivals(f))
        todo.emplace_back(
            "Before you name the cause, record the next experiment below: these recordings cannot tell the named "
            "effect from its rivals, though either model predicts equally well.");
      break;
    case Verdict::inconclusive:
      todo.emplace_back(
          "Do not change the model yet. Record the next experiment below, and run bevel-diagnose again with the new "
          "recordings added.");
      break;
    case Verdict::unknown_effect:
      todo.emplace_back(
          "Do not trust the model where the pictures below mark it: something acts there that is not on the list of "
          "effects.");
      todo.emplace_back("model.toml carries the needle as fitted beside the discrepancy" +
                        std::string(f.effects.empty() ? "" : ", the known part, " + listed(names_of(f.effects)) + ",") +
                        " and the discrepancy itself, which has no name.");
      todo.emplace_back(
          "Look for a cause that depends on what the discrepancy is drawn against; docs/adding-an-effect.md tells how "
          "to "
          "put an equation for it to the test.");
      break;
  }
  page.heading("What to do").list(todo);
}

void add_parameters(report::Page& page, const Findings& f) {
  page.heading("Parameters");
  const std::string picture = interval_picture(f);
  if (!picture.empty())
    page.picture(picture,
                 "What was found, with 95 % intervals over all explanations that hold the effect, with and without a "
                 "discrepancy beside it. An interval that reaches the diamond would be no evidence of an effect.");
  if (f.two_groups) {
    page.paragraph(
        "The needle itself is not measured between two groups: what all recordings get wrong alike, against depth, is "
        "fitted along with it and takes its place.");
    return;
  }
  const auto fitted = [](const NeedleEstimate& n) {
    return std::array{with_error(n.value.curvature_per_mm, n.curvature_sd_per_mm),
                      with_error(n.value.lambda1_per_rad, n.lambda1_sd_per_rad),
                      with_error(n.value.lambda2, n.lambda2_sd), number(n.value.wheelbase_mm, 4)};
  };
  const std::array<double, 4> given{f.model_file.curvature_per_mm, f.model_file.lambda1_per_rad, f.model_file.lambda2,
                                    f.model_file.wheelbase_mm};
  constexpr const char* kNames[] = {"k (1/mm)", "lambda1 (1/rad)", "lambda2", "wheelbase (mm), not fitted"};
  const bool one_model = !adopts_a_model(f.verdict);
  std::vector<std::string> header{"needle", "model file", one_model ? "refitted" : "refitted alone"};
  if (!one_model) header.emplace_back(f.discrepancies.empty() ? "with what was found" : "beside the discrepancy");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < given.size(); ++i) {
    rows.push_back({kNames[i], number(given[i], 4), fitted(f.base)[i]});
    if (!one_model) rows.back().push_back(fitted(f.needle)[i]);
  }
  page.table(
      header, rows,
      f.needle.slip_determined
          ? "Value ± standard error. A wrong k, lambda1 or lambda2 is no missing physics: they are refitted "
            "before anything is named."
          : "Value ± standard error. The shaft does not turn in these recordings, so lambda1 and lambda2 are not "
            "determined: they keep the values of the model file.");
}

void add_variation(report::Page& page, const Findings& f) {
  if (f.variation.empty()) return;
  page.subheading("How much insertions differ");
  std::vector<std::vector<std::string>> rows;
  for (const auto& v : f.variation) {
    const bool relative = v.unit == "relative";
    const double scale = relative ? 100 : 1;
    const std::string unit = relative ? " %" : " " + v.unit;
    std::string name = v.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    rows.push_back({name, number(scale * v.sd, 2) + unit,
                    number(scale * v.low, 2) + " to " + number(scale * v.high, 2) +
                        (v.at_end ? ", the end of the values tried" : ""),
                    probability(v.none)});
  }
  page.table({"between insertions", "standard deviation", "95 %", "probability of none"}, rows,
             "Of the values that were tried. A recording more makes the needle no surer than this allows.");
  const std::string picture = insertion_picture(f);
  if (!picture.empty())
    page.picture(picture,
                 "What each insertion has of its own, beside what all share: its curvature as a share of the "
                 "needle's, the heading about x and y and the bevel's roll at the entry, and where it entered; by "
                 "hand, how it bends away with depth. An "
                 "insertion far outside the band is one to look at.");
}

void add_location(report::Page& page, const Findings& f) {
  if (f.where.empty()) return;
  page.heading("Onset of the missing physics");
  page.paragraph(
      "The time at which the missing physics begins to act, as a 95 % interval: from the innovations of the nominal "
      "model, which predicts the later measurements from the tip's position and direction at each time. Look there "
      "first: what did the actuators do, and what came before it?");
  std::vector<std::vector<std::string>> rows;
  for (const auto& w : f.where)
    rows.push_back({w.log, w.channel, time_span(f, w), w.covariate.empty() ? "-" : span_of(w), percent(w.share)});
  page.table({"recording", "channel", time_label(f), "there", "share of the mismatch"}, rows);
  const auto panels = located_panels(f, 2);
  if (!panels.empty())
    page.figures(panels, static_cast<int>(panels.size() / 3),
                 "The onsets, shaded, in their recordings: what was measured less what was predicted, and below "
                 "it the motion of the actuators.");
}

void add_unknown_part(report::Page& page, const Findings& f) {
  if (f.discrepancies.empty()) return;
  page.heading("The unknown part, described");
  page.paragraph(
      "No effect on the list explains this. The discrepancy says by how much a quantity of the motion would have to be "
      "off, and against what it varies, for the model to fit: zero is the model as it is. It is a description, not a "
      "cause." +
      std::string(f.discrepancies.size() > 1 ? " One curve does not do: these add up." : ""));
  page.figures(discrepancy_panels(f.discrepancies), 2, "The discrepancy with a band of two standard errors.");
  std::vector<std::vector<std::string>> rows;
  for (const auto& c : f.discrepancies) {
    double largest = 0;
    for (const double v : c.curve.values) largest = std::abs(v) > std::abs(largest) ? v : largest;
    rows.push_back({meaning_of(c), in_words(model::name_of(c.curve.covariate)),
                    number(largest) + " " + std::string(unit_of(c.curve.component, c.curve.covariate)),
                    log_factor(c.log_bayes_factor), number(c.visible_size, 2)});
  }
  page.table({"what is off", "against", "largest", "log Bayes factor", "visible size (standard deviations of noise)"},
             rows);
  if (f.proposals.empty()) return;
  std::vector<std::vector<std::string>> forms;
  for (const auto& p : f.proposals) {
    const std::string unit(unit_of(p.component, p.covariate));
    forms.push_back({meaning_of(f.discrepancies.at(p.discrepancy)), std::string(info_of(p.component).meaning),
                     in_words(model::name_of(p.covariate)), p.equation,
                     with_error(p.amplitude, p.amplitude_sd) + " " + unit,
                     number(p.shape) + " (" + number(p.shape_low) + " to " + number(p.shape_high) + ")",
                     log_factor(p.log_bayes_factor)});
  }
  page.subheading("Equations that would do");
  page.table({"instead of the curve in", "what is off by", "x", "equation", "a", "s (95 %)",
              "log Bayes factor against all curves"},
             forms,
             "Simple forms of one covariate, each beside the needle, what was named and the other curves. Above zero, "
             "the equation is "
             "worth more than the freedom of a curve. A proposal to be tried as an effect, not a cause.");
  if (const ProposedForm* form = proposed_form(f))
    page.paragraph(std::string(kProposedEffectFile) + " beside this page is " + form->equation + " as an effect, " +
                   effect_source(*form).name + ", ready to be added to the library (docs/adding-an-effect.md).");
}

void add_residuals(report::Page& page, const Findings& f) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t c = 0; c < f.channels.size(); ++c) {
    double sum = 0;
    for (const auto& trace : f.traces)
      if (c < trace.white_before.size())
        for (const double v : trace.white_before[c])
          if (std::isfinite(v)) sum += v * v;
    order.emplace_back(-sum, c);
  }
  std::sort(order.begin(), order.end());
  const bool one_model = !adopts_a_model(f.verdict);
  const std::string reading = one_model
                                  ? " The line should lie at zero in every panel, within what its band lets it waver."
                                  : " Where the orange line leaves zero and the blue one does not, what was found "
                                    "explains it.";
  const auto add = [&](report::Page& to, std::size_t c) {
    const auto panels = residual_panels(f, c);
    if (panels.empty()) return;
    to.figures(panels, 3,
               "Channel " + f.channels[c] +
                   ", measured less predicted, all recordings; outliers left out. Dots: readings; line: median; band: "
                   "half of the readings; shaded: where it goes wrong." +
                   reading);
  };
  if (order.empty() || f.traces.empty()) return;
  page.heading(one_model ? "What is left over" : "What is left over, before and after");
  page.paragraph(
      "Residuals against up to seven quantities; point at a reading in one panel to see it in all. Missing physics "
      "shows as a line that leaves zero in an orderly way against "
      "one of them; noise has no order. With a complete model the blue line stays at zero in every panel.");
  add(page, order.front().second);
  if (order.size() > 1) add(page, order[1].second);
  if (order.size() > 2)
    page.folded("the other channels", [&](report::Page& inside) {
      for (std::size_t i = 2; i < order.size(); ++i) add(inside, order[i].second);
    });
}

void add_recordings(report::Page& page, const Findings& f) {
  constexpr std::size_t kShown = 2;
  const auto order = worst_first(f);
  std::vector<std::vector<report::Figure>> all;
  for (const std::size_t t : order) all.push_back(recording_panels(f, t));
  std::erase_if(all, [](const auto& panels) { return panels.empty(); });
  if (all.empty()) return;
  std::size_t at = 0;
  const auto add = [&](report::Page& to, std::size_t until) {
    for (; at < std::min(until, all.size()); ++at)
      to.figures(all[at], 1,
                 all[at].front().link.substr(std::string_view("time of ").size()) +
                     (f.stop_s > 0 ? ", stop by stop." : ", over time."));
  };
  page.heading("Recording by recording");
  page.paragraph(
      "What was measured less what was predicted, worst first, and what the base did at that time. The panels of a "
      "recording are linked: pointing at one shows the instant in all, and dragging across one shows its stretch of "
      "time in all.");
  add(page, kShown);
  if (at < all.size()) page.folded("the other recordings", [&](report::Page& inside) { add(inside, all.size()); });
}

void add_paths(report::Page& page, const Findings& f) {
  constexpr std::size_t kShown = 3;
  const auto order = worst_first(f);
  const auto middle = order.begin() + static_cast<std::ptrdiff_t>(std::min(kShown, order.size()));
  const auto panels = path_panels(f, {order.begin(), middle});
  if (panels.empty()) return;
  page.heading("Paths, measured and predicted");
  page.space(path_in_space(f, order.front()),
             "The path in space of the recording that the refitted needle alone gets "
             "worst.");
  page.figures(panels, 2,
               "The recordings that the refitted needle alone gets worst, seen from two sides: x over z on the left, y "
               "over z on the right. Lateral axes are stretched. Before: the needle refitted; after: with what was "
               "found. The blue line should run through the grey dots.");
  const auto others = path_panels(f, {middle, order.end()});
  if (!others.empty())
    page.folded("the other recordings",
                [&](report::Page& inside) { inside.figures(others, 2, "The other recordings."); });
}

std::string report_html(const Findings& findings, const Provenance& made_of) {
  report::Page page(findings.two_groups ? "What changed" : "What the model leaves out");
  add_verdict(page, findings);
  add_what_to_do(page, findings);
  add_parameters(page, findings);
  add_variation(page, findings);
  add_at_target(page, findings);
  add_location(page, findings);
  add_unknown_part(page, findings);
  add_residuals(page, findings);
  add_recordings(page, findings);
  add_paths(page, findings);
  add_evidence(page, findings);
  add_held_out(page, findings);
  add_reach(page, findings);
  add_next_experiment(page, findings);
  add_noise_and_checks(page, findings);
  add_making(page, findings, made_of);
  return page.html();
}

}  // namespace bevel::analysis
