// SPDX-License-Identifier: MIT
#include "proof/page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <bevel/report/numbers.hpp>
#include <bevel/report/page.hpp>
#include "proof/page_figures.hpp"
#include "proof/trial.hpp"
#include "proof/trial_files.hpp"

namespace bevel::proof {
namespace {

std::string digits(double value, int count = 3) { return report::format_significant(value, count); }

std::string percent(double share) { return digits(100 * share, 3) + " %"; }

std::string counted(int count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

std::string words(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : " + ") + name;
  return text.empty() ? "nothing" : text;
}

Share at(const std::map<std::string, Share>& shares, const std::string& name) {
  const auto found = shares.find(name);
  return found == shares.end() ? Share{} : found->second;
}

void headline(report::Page& page, const Tally& t, const CampaignFacts& facts) {
  const Share visible = at(t.strict, "visible");
  const Interval w = wilson95(visible);
  const bool good = visible.of > 0 && visible.value() >= 0.9 && t.false_alarms.hits == 0;
  page.verdict(good ? report::Tone::good : report::Tone::warning,
               "Exactly the right physics in " + std::to_string(visible.hits) + " of " + std::to_string(visible.of) +
                   " trials in which all of it could be seen (" + percent(visible.value()) + ", 95 % interval " +
                   percent(w.low) + " to " + percent(w.high) + ")",
               counted(t.false_alarms.hits, "false alarm") + " in " + counted(t.false_alarms.of, "trial") +
                   " with nothing missing: the rate is below " + percent(clopper_pearson_upper95(t.false_alarms)) +
                   " (95 %, one-sided). " + std::to_string(t.unknown_called_unknown.hits) + " of " +
                   std::to_string(t.unknown_called_unknown.of) + " effects on no list were called unknown. " +
                   (facts.sealed ? "" : "The tool ran WITHOUT being sealed off from the truths."));
  page.paragraph(std::to_string(t.trials) + " trials, seed " + std::to_string(facts.seed) +
                 ". In each, eight recordings of a needle in tissue with nothing, one or two effects concealed, or one "
                 "that is on no list, by a simulator that shares no code with the tool under test. The truth was "
                 "sealed with SHA-256 before the tool ran" +
                 (facts.sealed ? " in namespaces from which only the logs could be read" : "") +
                 "; the verdicts were hashed before the truths were opened.");
}

void shares(report::Page& page, const Tally& t) {
  page.heading("Verdicts");
  std::vector<ShareLine> lines{{"exact set, all of it visible", at(t.strict, "visible"), 0.9},
                               {"the same, counting ambiguous ones", at(t.lenient, "visible"), -1},
                               {"one of two visible: it, or both", at(t.strict, "partly"), -1},
                               {"none visible: silence, or the name", at(t.strict, "invisible"), -1},
                               {"nothing concealed: silence", at(t.strict, "null"), 1.0},
                               {"all trials", at(t.strict, "all"), -1},
                               {"on no list: called unknown", t.unknown_called_unknown, 0.8},
                               {"the same, imitated by none listed", t.unknown_distinct, -1},
                               {"on no list: held-out density higher", t.unknown_likelier, 0.9},
                               {"on no list: held-out error smaller", t.unknown_nearer, 0.9},
                               {"truth within the 95 % intervals", t.covered, 0.95},
                               {"nearest plain form within them", t.covers_nearest, 0.95},
                               {"k, lambda1, lambda2 within theirs", t.needle_covered, 0.95},
                               {"place within 0.2 s or 3 mm", t.located, -1},
                               {"held-out chi-square within 10 % of 1", t.chi2_at_floor, -1}};
  page.picture(share_figure(lines),
               "Shares with 95 % Wilson intervals; red ticks are goals. The right answer names "
               "what could be seen; an effect of which less than 5 standard deviations remain "
               "beyond k, lambda1 and lambda2 may be named or not. Abstentions count as wrong. Ambiguous: the truth "
               "stands in ambiguous_with, or "
               "an effect on no list is imitated below the limit by the listed one that was named.");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, share] : t.strict_by_class) {
    const Interval w = wilson95(share);
    rows.push_back({name, std::to_string(share.hits), std::to_string(share.of), percent(share.value()),
                    percent(w.low) + " to " + percent(w.high)});
  }
  if (!rows.empty())
    page.table(
        {"concealed, all visible", "right", "of", "share", "95 %"}, rows,
        "Exact sets by class. The beam is a mechanical plant which no bicycle describes: counted as on no list.");
  page.paragraph("Mean probability given to the truth " + digits(t.mean_probability_of_truth) + "; abstentions " +
                 std::to_string(t.abstentions) + "; \"unknown\" where nothing unlisted was concealed " +
                 std::to_string(t.unknown_alarms.hits) + " of " + std::to_string(t.unknown_alarms.of) + ".");
}

// Is a verdict right as often as the tool says that it is?
void reliability(report::Page& page, const Tally& t) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < t.reliability.size(); ++i) {
    const ReliabilityBin& bin = t.reliability[i];
    if (bin.right.of == 0) continue;
    const Interval w = wilson95(bin.right);
    const double high = i + 1 < t.reliability.size() ? t.reliability[i + 1].low : 1.0;
    rows.push_back({digits(bin.low, 2) + " to " + digits(high, 2), digits(bin.mean), std::to_string(bin.right.hits),
                    std::to_string(bin.right.of), percent(bin.right.value()),
                    percent(w.low) + " to " + percent(w.high)});
  }
  if (rows.empty()) return;
  page.heading("Probabilities");
  page.table({"probability of what was said", "mean", "right", "of", "share", "95 %"}, rows,
             "Expected calibration error " + digits(t.expected_calibration_error, 2) +
                 ". The truth had a probability below 0.01 in " + std::to_string(t.truth_improbable.hits) + " of " +
                 std::to_string(t.truth_improbable.of) + ".");
}

void sensitivity(report::Page& page, const Tally& t) {
  report::Figure figure;
  figure.x_label = "visible size (standard deviations of the coloured noise)";
  figure.y_label = "share";
  figure.log_x = true;
  figure.y_range = {{0.0, 1.05}};
  figure.references.push_back({report::Reference::Axis::vertical, kVisible_sigmas, "visible from here"});
  std::vector<double> x, named, low, high, alarmed_x, alarmed;
  for (const SensitivityBin& bin : t.sensitivity) {
    const double middle = std::isfinite(bin.high_sigmas) ? std::sqrt(std::max(bin.low_sigmas, 1.0) * bin.high_sigmas)
                                                         : 1.7 * bin.low_sigmas;
    if (bin.named.of > 0) {
      const Interval w = wilson95(bin.named);
      x.push_back(middle);
      named.push_back(bin.named.value());
      low.push_back(w.low);
      high.push_back(w.high);
    }
    if (bin.alarmed.of > 0) {
      alarmed_x.push_back(middle);
      alarmed.push_back(bin.alarmed.value());
    }
  }
  if (x.empty()) return;
  page.heading("Sensitivity");
  figure.bars("its 95 % interval", x, low, high, report::Colour::blue)
      .line("effect named", x, named, report::Colour::blue);
  figure.points("", x, named, report::Colour::blue);
  if (!alarmed_x.empty()) figure.dashed("anything said", alarmed_x, alarmed, report::Colour::orange);
  page.figure(figure, "Effects named, against how much of them could be seen at all. Binned; the bars are Wilson's.");
}

void confusion(report::Page& page, const Tally& t) {
  if (t.confusion.empty()) return;
  page.heading("What was taken for what");
  const auto none = t.confusion.find("none");
  int unseen = 0, silent = 0;
  if (none != t.confusion.end())
    for (const auto& [named, count] : none->second) {
      unseen += count;
      if (named == "none") silent += count;
    }
  page.picture(confusion_figure(t.confusion),
               "Each effect that could be seen against what was named for it. Blue is right. Row \"none\": trials in "
               "which nothing could be seen, with nothing concealed (" +
                   std::to_string(t.false_alarms.of) + " trials, " + counted(t.false_alarms.hits, "false alarm") +
                   ") or too little of it; of " + std::to_string(unseen) + " entries " + std::to_string(silent) +
                   " are silence, the others were named without being there or without being visible. Row \"" +
                   std::string(kBeyond) +
                   "\": named beside what was there. Column \"none\": missed. Depth of colour: share of the row.");
}

// A few that are off by hundreds of standard errors would be all that a mean tells of the others.
std::string middle_of(std::vector<double> z) {
  std::ranges::sort(z);
  const auto quantile = [&](double share) {
    const double at = share * static_cast<double>(z.size() - 1);
    const auto below = static_cast<std::size_t>(at);
    const double above = below + 1 < z.size() ? z[below + 1] : z[below];
    return digits(z[below] + (at - static_cast<double>(below)) * (above - z[below]), 2);
  };
  return "median " + quantile(0.5) + ", half of them from " + quantile(0.25) + " to " + quantile(0.75) +
         ", the farthest off by " + std::to_string(std::lround(std::max(std::abs(z.front()), std::abs(z.back())))) +
         " standard errors";
}

void parameters(report::Page& page, const Tally& t) {
  if (t.z.empty()) return;
  page.heading("Parameters");
  constexpr int kBins = 24;
  constexpr double kReach = 6.0;
  std::vector<double> x, count, bell;
  const double width = 2 * kReach / kBins;
  for (int i = 0; i < kBins; ++i) {
    const double from = -kReach + width * i;
    const auto inside = std::ranges::count_if(t.z, [&](double z) {
      const double clipped = std::clamp(z, -kReach, kReach - 1e-9);
      return from <= clipped && clipped < from + width;
    });
    const double middle = from + 0.5 * width;
    x.push_back(middle);
    count.push_back(static_cast<double>(inside));
    bell.push_back(static_cast<double>(t.z.size()) * width * std::exp(-0.5 * middle * middle) /
                   std::sqrt(2 * std::numbers::pi));
  }
  std::vector<double> edges, heights;
  for (std::size_t i = 0; i < x.size(); ++i) {
    edges.insert(edges.end(), {x[i] - 0.5 * width, x[i] + 0.5 * width});
    heights.insert(heights.end(), {count[i], count[i]});
  }
  report::Figure figure;
  figure.x_label = "(value - truth) / std_error";
  figure.y_label = "parameters";
  figure.y_range = {{0.0, 1.1 * std::max(*std::ranges::max_element(count), *std::ranges::max_element(bell))}};
  figure.band("", edges, std::vector<double>(edges.size(), 0.0), heights, report::Colour::blue);
  figure.line("parameters named rightly", edges, heights, report::Colour::blue)
      .dashed("standard normal", x, bell, report::Colour::orange);
  page.figure(figure,
              "Errors of the parameters of effects named rightly, in their own standard errors. The outermost "
              "columns hold everything beyond.");
  const Interval w = wilson95(t.covered);
  page.paragraph(std::to_string(t.z.size()) + " parameters: " + middle_of(t.z) +
                 " (right are 0, -0.67 and 0.67); the 95 % intervals hold the truth in " + percent(t.covered.value()) +
                 " (" + percent(w.low) + " to " + percent(w.high) + ").");
  if (t.z_nearest.empty()) return;
  const Interval n = wilson95(t.covers_nearest);
  page.paragraph(
      "The plant's forms are not the plain ones, so what a plain form comes to on it, even without noise, is not quite "
      "what was drawn. Against that nearest value: mean " +
      digits(t.z_nearest_mean) + ", spread " + digits(t.z_nearest_spread) + ", held in " +
      percent(t.covers_nearest.value()) + " (" + percent(n.low) + " to " + percent(n.high) +
      "). The first figure tells how far to trust a number as physics, the second whether the intervals are those of "
      "the noise.");
}

void needles(report::Page& page, const Tally& t) {
  if (t.z_needle.empty()) return;
  page.heading("The needle");
  const Interval w = wilson95(t.needle_covered);
  page.paragraph("k, lambda1 and lambda2 where all that was concealed is named rightly, or nothing was, " +
                 std::to_string(t.z_needle.size()) + " values: errors in their own standard errors have the mean " +
                 digits(t.z_needle_mean) + " and the spread " + digits(t.z_needle_spread) + "; " +
                 percent(t.needle_covered.value()) + " (" + percent(w.low) + " to " + percent(w.high) +
                 ") are within 1.96.");
}

void fits(report::Page& page, const Tally& t, const std::vector<TrialScore>& scores) {
  std::vector<double> x, before, after_x, after;
  for (const TrialScore& s : scores) {
    const double place = std::max(s.visible_sigmas, 0.5);
    if (s.chi2_before && *s.chi2_before > 0) {
      x.push_back(place);
      before.push_back(*s.chi2_before);
    }
    if (s.chi2_after && *s.chi2_after > 0) {
      after_x.push_back(place);
      after.push_back(*s.chi2_after);
    }
  }
  if (after.empty() || x.empty()) return;
  page.heading("Held-out fit");
  report::Figure figure;
  figure.x_label = "visible size of what was concealed (standard deviations; nulls at 0.5)";
  figure.y_label = "held-out chi-square per measurement";
  figure.log_x = figure.log_y = true;
  figure.references.push_back({report::Reference::Axis::horizontal, 1.0, "noise floor"});
  figure.points("before", x, before, report::Colour::orange).points("after", after_x, after, report::Colour::blue);
  page.figure(figure, "As the tool reports it, leaving out one recording at a time. Median before " +
                          digits(median(t.chi2_before)) + ", after " + digits(median(t.chi2_after)) + ".");
}

void failures(report::Page& page, const std::vector<TrialScore>& scores) {
  std::vector<std::vector<std::string>> wrong;
  std::vector<std::vector<std::string>> all;
  for (const TrialScore& s : scores) {
    std::vector<std::string> row{trial_name(s.trial),
                                 words(s.concealed) + (s.plant == "beam" ? " (plant)" : ""),
                                 digits(s.visible_sigmas),
                                 words(s.expected),
                                 s.abstained ? "abstained: " + s.abstention : words(s.named),
                                 s.strict    ? "right"
                                 : s.lenient ? "ambiguous"
                                             : "wrong",
                                 digits(s.seconds)};
    if (!s.strict) wrong.push_back(row);
    all.push_back(std::move(row));
  }
  const std::vector<std::string> header{"trial", "concealed", "visible", "right answer", "verdict", "", "s"};
  page.heading("Failures");
  if (wrong.empty())
    page.paragraph("None.");
  else
    page.table(header, wrong);
  page.heading("Every trial");
  page.table(header, all, "Visible: standard deviations beyond k, lambda1 and lambda2, of all that was concealed.");
}

}  // namespace

std::string results_page(const CampaignFacts& facts, const Tally& t, const std::vector<TrialScore>& scores) {
  report::Page page("Blind trial of the mismatch tool");
  headline(page, t, facts);
  shares(page, t);
  reliability(page, t);
  sensitivity(page, t);
  confusion(page, t);
  parameters(page, t);
  needles(page, t);
  fits(page, t, scores);
  if (!t.seconds.empty()) {
    page.heading("Time");
    page.paragraph("Median " + digits(median(t.seconds)) + " s a trial, longest " + digits(t.seconds.back()) +
                   " s, wall clock, with as many trials at a time as the run was given.");
  }
  failures(page, scores);
  page.heading("What binds this page");
  page.code("tool under test   sha256 " + facts.tool_sha256 + "\ncommitments.json  sha256 " + facts.commitments_sha256 +
            "\nverdicts.json     sha256 " + facts.verdicts_sha256);
  page.paragraph(
      "commitments.json was written before the tool first ran, verdicts.json before a truth was opened. To "
      "check: SHA-256 of salt and truth, as text, one after the other, both in sealed/.");
  return page.html();
}

}  // namespace bevel::proof
