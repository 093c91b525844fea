// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/pictures.hpp>
#include <bevel/diagnosis/inference/search.hpp>
#include <bevel/model/effects/effect.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)
using namespace bevel::report;     // NOLINT(google-build-using-namespace)

namespace {

constexpr double kNames = 184;  // room for names on the left
constexpr double kNameSize = 12.5;
constexpr const char* kLikelyInk = "var(--likely)";

Lettering name_lettering(bool bold = false) {
  return {.anchor = Lettering::Anchor::end, .size = kNameSize, .bold = bold};
}

bool was_found(const Findings& findings, const std::string& name) {
  return std::any_of(findings.effects.begin(), findings.effects.end(),
                     [&](const auto& e) { return is_kind_of(name, e); });
}

// Where an effect is likelier than not, as the search has it.
const double kMark = -inference::SearchRules{}.log_prior_odds_effect;

// Below one the logarithm says nothing: a bar that short is none.
double shown(const std::optional<double>& gain) { return gain ? std::max(*gain, 1.0) : 1.0; }

}  // namespace

std::string ranking_picture(const Findings& findings, std::vector<TriedEffect> tried) {
  if (tried.empty()) return "";
  constexpr double kRow = 22;
  double most = 100;
  for (const auto& t : tried) most = std::max(most, shown(t.log_bayes_factor));
  const Axis gain{1, std::pow(10.0, std::ceil(std::log10(most * 1.05))), "log Bayes factor (on a logarithmic scale)",
                  true};
  const double height = kRow * static_cast<double>(tried.size());
  Drawing drawing(832, 34 + height + 40);
  draw_keys(drawing, {kNames, 14},
            {{kAfterInk, "found"},
             {kLikelyInk,
              findings.verdict == Verdict::unknown_effect ? "likely, not enough" : "likely, another explains more"},
             {ink::kFaint, "not likely"},
             {ink::kText, "mark: likelier than not"}});
  const Box box{kNames, 30, 580, height};
  Axis upward{0, 1, ""};
  upward.ruled = false;
  const Panel panel(drawing, box, gain, upward);
  for (std::size_t i = 0; i < tried.size(); ++i) {
    const TriedEffect& t = tried[i];
    const double top = box.top + kRow * static_cast<double>(i);
    const bool found = was_found(findings, t.name);
    const double right = panel.at(shown(t.log_bayes_factor), 0).x;
    drawing.rectangle({box.left, top + 4, std::max(right - box.left, 1.0), kRow - 8},
                      found        ? kAfterInk
                      : t.likelier ? kLikelyInk
                                   : ink::kFaint,
                      1, t.name + ": log Bayes factor " + log_factor(t.log_bayes_factor));
    const double mark = panel.at(kMark, 0).x;
    drawing.line({mark, top + 2}, {mark, top + kRow - 2}, {.colour = ink::kText, .width = 2});
    drawing.text({box.left - 8, top + 16}, t.name, name_lettering(found));
    drawing.text({box.right() + 10, top + 16}, log_factor(t.log_bayes_factor), {.size = 11, .colour = ink::kSoft});
  }
  return drawing.svg();
}

namespace {

void draw_pairs(Drawing& drawing, const Box& box, const HeldOut& held_out, double FitFigures::*figure,
                const std::string& label, bool names, bool one_model) {
  std::vector<double> values{0};
  for (const auto& r : held_out.recordings) values.insert(values.end(), {r.before.*figure, r.after.*figure});
  double most = 0;
  double least = INFINITY;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (std::isfinite(values[i]) && values[i] > 0) {
      most = std::max(most, values[i]);
      least = std::min(least, values[i]);
    }
  Axis across = axis_around(values, label);
  across.low = 0;
  // Recordings that differ by decades are told apart on a logarithm only.
  if (most > 30 * least) across = {least / 1.5, most * 1.5, label + ", logarithmic", true};
  Axis upward{0, 1, ""};
  upward.ruled = false;
  const Panel panel(drawing, box, across, upward);
  const double row = box.height / static_cast<double>(held_out.recordings.size());
  for (std::size_t i = 0; i < held_out.recordings.size(); ++i) {
    const auto& r = held_out.recordings[i];
    const double y = box.top + (static_cast<double>(i) + 0.5) * row;
    const Point before{panel.at(r.before.*figure, 0).x, y};
    const Point after{panel.at(r.after.*figure, 0).x, y};
    if (!one_model)
      drawing.line(before, after, {.colour = ink::kFaint, .width = 2.5})
          .mark(before, 5, kBeforeInk, r.log + ", before: " + measured(r.before.*figure));
    drawing.mark(after, 5, kAfterInk, r.log + (one_model ? ": " : ", after: ") + measured(r.after.*figure));
    if (names) drawing.text({box.left - 10, y + 4}, r.log, name_lettering());
  }
  if (figure != &FitFigures::chi2_per_dof) return;
  const double one = panel.at(1, 0).x;
  drawing.line({one, box.top}, {one, box.bottom()}, {.colour = ink::kGreen, .width = 1.2, .dashes = "4,3"});
  const bool on_the_left = one > box.left + box.width / 2;  // where there is room
  drawing.text(
      {one + (on_the_left ? 4 : -4), box.top - 5}, "as sure as it may be",
      {.anchor = on_the_left ? Lettering::Anchor::end : Lettering::Anchor::start, .size = 11, .colour = ink::kGreen});
}

}  // namespace

std::string held_out_picture(const Findings& findings) {
  const HeldOut& held_out = findings.held_out;
  const bool one_model = !adopts_a_model(findings.verdict);  // before is after
  if (held_out.recordings.empty()) return "";
  const double height = 24 * static_cast<double>(held_out.recordings.size());
  double names = 60;
  for (const auto& r : held_out.recordings) names = std::max(names, width_of(r.log, kNameSize) + 16);
  names = std::min(names, 240.0);
  Drawing drawing(832, 44 + height + 38);
  std::vector<Key> keys;
  if (!one_model) keys.push_back({kBeforeInk, "before: needle refitted without this recording"});
  keys.push_back({kAfterInk, one_model ? "needle refitted without this recording"
                                       : "after: with what was found, from the others"});
  draw_keys(drawing, {names, 14}, keys);
  const double width = (832 - names - 60) / 2;
  draw_pairs(drawing, {names, 44, width, height}, held_out, &FitFigures::rmse_mm, "rms error (mm)", true, one_model);
  draw_pairs(drawing, {names + width + 40, 44, width, height}, held_out, &FitFigures::chi2_per_dof, "chi2 per reading",
             false, one_model);
  return drawing.svg();
}

namespace {

struct IntervalRow {
  std::string effect;  // "" under the same
  std::string name;
  FoundParameter parameter;
  double none = NAN;
};

std::vector<IntervalRow> interval_rows(const Findings& findings) {
  std::vector<IntervalRow> rows;
  for (const auto& effect : findings.effects) {
    const model::Effect* known = model::find_effect(effect.name);
    const auto none_of = [&](const std::string& name) {
      if (known != nullptr)
        for (const auto& p : known->parameters())
          if (p.name == name && p.scope == model::Scope::rig) return p.none;
      return std::nan("");
    };
    bool first = true;
    const auto add = [&](const FoundParameter& p, const std::string& log) {
      rows.push_back(
          {first ? effect.name : "", in_words(p.name) + (log.empty() ? "" : ", " + log), p, none_of(p.name)});
      first = false;
    };
    for (const auto& p : effect.parameters) add(p, "");
    for (const auto& r : effect.recordings)
      for (const auto& p : r.parameters) add(p, r.log);
  }
  return rows;
}

}  // namespace

std::string interval_picture(const Findings& findings) {
  const auto rows = interval_rows(findings);
  if (rows.empty()) return "";
  constexpr double kRow = 46;
  constexpr double kLeft = 330;
  constexpr double kWide = 300;
  Drawing drawing(832, 24 + kRow * static_cast<double>(rows.size()));
  drawing.text({kLeft, 12}, "each row on its own scale; a grey diamond: no effect", {.size = 11, .colour = ink::kSoft});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto& [effect, name, p, none] = rows[i];
    const double y = 40 + kRow * static_cast<double>(i);
    if (i > 0 && !effect.empty()) drawing.line({0, y - 17}, {832, y - 17}, {.colour = ink::kGrid});
    drawing.text({0, y + 4}, effect, {.size = kNameSize, .bold = true});
    drawing.text({kLeft - 14, y + 4}, name, name_lettering());
    std::vector<double> ends{p.value, p.ci95[0], p.ci95[1]};
    if (std::isfinite(none)) ends.push_back(none);
    const Axis axis = axis_around(ends, "");
    const auto x_of = [&](double v) {
      return kLeft + kWide * std::clamp((v - axis.low) / (axis.high - axis.low), 0.0, 1.0);
    };
    drawing.line({kLeft, y + 10}, {kLeft + kWide, y + 10}, {.colour = ink::kFaint});
    for (const double v : ticks(axis, 4)) {
      drawing.line({x_of(v), y + 8}, {x_of(v), y + 12}, {.colour = ink::kFaint});
      drawing.text({x_of(v), y + 22}, number(v, 4),
                   {.anchor = Lettering::Anchor::middle, .size = 10, .colour = ink::kSoft});
    }
    if (std::isfinite(none))
      drawing.area({{x_of(none) - 5, y}, {x_of(none), y - 6}, {x_of(none) + 5, y}, {x_of(none), y + 6}}, ink::kFaint);
    const double low = std::isfinite(p.ci95[0]) ? p.ci95[0] : axis.low;
    const double high = std::isfinite(p.ci95[1]) ? p.ci95[1] : axis.high;
    drawing.line({x_of(low), y}, {x_of(high), y}, {.colour = kAfterInk, .width = 3, .opacity = 0.55});
    for (const double end : {low, high})
      drawing.line({x_of(end), y - 5}, {x_of(end), y + 5}, {.colour = kAfterInk, .width = 1.5});
    drawing.dots({{x_of(p.value), y}}, 4.5, kAfterInk);
    drawing.text({kLeft + kWide + 16, y}, with_error(p.value, p.std_error) + (p.at_bound ? "  at its bound" : ""));
    drawing.text({kLeft + kWide + 16, y + 15}, "95 %: " + interval(p.ci95), {.size = 11, .colour = ink::kSoft});
  }
  return drawing.svg();
}

std::vector<Figure> discrepancy_panels(const std::vector<Discrepancy>& discrepancies) {
  std::vector<Figure> panels;
  for (const Discrepancy& d : discrepancies) {
    const model::DiscrepancyCurve& c = d.curve;
    std::vector<double> low, high;
    for (std::size_t k = 0; k < c.at.size(); ++k) {
      const double error = k < c.std_errors.size() && std::isfinite(c.std_errors[k]) ? 2 * c.std_errors[k] : 0;
      low.push_back(c.values[k] - error);
      high.push_back(c.values[k] + error);
    }
    Figure panel;
    panel.title = std::string(info_of(c.component).meaning);
    panel.x_label = in_words(model::name_of(c.covariate));
    panel.y_label = std::string(unit_of(c.component, c.covariate));
    panel.height_px = 170;
    panel.references.push_back({Reference::Axis::horizontal, 0, ""});
    panel.band("two standard errors", c.at, low, high, kAfter).line("discrepancy", c.at, c.values, kAfter);
    panel.points("", c.at, c.values, kAfter);
    panels.push_back(std::move(panel));
  }
  return panels;
}

}  // namespace bevel::analysis
