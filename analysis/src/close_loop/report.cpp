// SPDX-License-Identifier: MIT
#include <bevel/analysis/close_loop/report.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/report/page.hpp>

namespace bevel::analysis {
namespace {

using json = nlohmann::ordered_json;
using Row = std::vector<std::string>;

std::string text(const char* format, auto... values) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

std::string in_band(const ChiSquareMean& mean) {
  return mean.degrees == 0 ? "-" : text("%.3f%s", mean.mean(), mean.in_band() ? "" : " *");
}

std::string with_interval(const WithInterval& v) { return text("%.3f [%.3f, %.3f]", v.value, v.low, v.high); }

// One row a quantity, one column a model.
std::vector<Row> rows_of(const ClosedLoop& loop) {
  std::vector<Row> rows;
  const auto add = [&](const std::string& figure, const std::string& name, auto&& value) {
    Row row = {figure, name};
    for (std::size_t s = 0; s < kStages; ++s) row.push_back(value(s));
    rows.push_back(row);
  };
  add("rig", "RMSE (mm)", [&](std::size_t s) { return text("%.3f", loop.rig[s].rmse_mm); });
  add("", "largest (mm)", [&](std::size_t s) { return text("%.3f", loop.rig[s].max_mm); });
  add("", "chi2 per reading", [&](std::size_t s) { return text("%.3f", loop.rig[s].chi2_per_reading); });
  const std::array settings = {std::pair{"estimator, needle known", &loop.estimator.known},
                               std::pair{"estimator, needle free", &loop.estimator.free}};
  for (const auto& [name, figures] : settings) {
    const auto& stages = *figures;
    add(name, "NIS per axis", [&](std::size_t s) { return in_band(stages[s].nis); });
    for (std::size_t axis = 0; axis < 3; ++axis)
      add("", std::string("NIS ") + "xyz"[axis], [&](std::size_t s) { return in_band(stages[s].axis[axis]); });
    add("", "coloured series", [&](std::size_t s) { return text("%d of %d", stages[s].coloured, stages[s].series); });
    add("", "gate rejects", [&](std::size_t s) {
      return text("%lld of %lld", static_cast<long long>(stages[s].rejected),
                  static_cast<long long>(stages[s].measurements));
    });
  }
  const std::array steered = {std::pair{"controller", &loop.targeting.live},
                              std::pair{"controller, forgiving filter", &loop.targeting.forgiving}};
  for (const auto& [name, figures] : steered) {
    const auto& stages = *figures;
    add(name, "mean miss (mm)", [&](std::size_t s) { return with_interval(stages[s].mean_mm); });
    add("", "largest miss (mm)", [&](std::size_t s) { return with_interval(stages[s].largest_mm); });
    add("", "ended early",
        [&](std::size_t s) { return text("%d of %zu", stages[s].stopped, stages[s].miss_mm.size()); });
    add("", "turns per 100 mm", [&](std::size_t s) { return text("%.1f", stages[s].turns_per_100mm); });
  }
  return rows;
}

std::string seeds_of(const ClosedLoop& loop) {
  std::string seeds;
  for (const auto seed : loop.targeting.seeds) seeds += (seeds.empty() ? "" : ", ") + std::to_string(seed);
  return seeds;
}

std::string targets_of(const ClosedLoop& loop) {
  std::string targets;
  for (const auto& t : loop.targeting.targets_mm)
    targets += text("%s(%.1f, %.1f, %.1f)", targets.empty() ? "" : ", ", t.x(), t.y(), t.z());
  return targets;
}

// What the rows mean, and under what the figures were got.
std::vector<std::string> notes(const ClosedLoop& loop) {
  const auto& nis = loop.estimator.known[kAugmented].nis;
  const auto& axis =
      *std::max_element(loop.estimator.known[kAugmented].axis.begin(), loop.estimator.known[kAugmented].axis.end(),
                        [](const auto& a, const auto& b) { return a.degrees < b.degrees; });
  std::vector<std::string> all;
  all.push_back("rig: base motion in, camera readings out, nothing corrected; " +
                std::to_string(loop.rig[kAugmented].readings) + " readings, " + std::to_string(loop.findings.outliers) +
                " messages left out as outliers, noise of the diagnosis (" +
                text("AR(1) %.2f", loop.findings.noise.ar1) + ").");
  all.push_back(text(
      "estimator: known entry, no process noise; NIS 95 %% band %.3f to %.3f (one axis %.3f to %.3f), * "
      "outside; coloured: Ljung-Box p < 1 %%, chance allows %d.",
      nis.lowest(), nis.highest(), axis.lowest(), axis.highest(), loop.estimator.known[kAugmented].coloured_by_chance));
  all.push_back(
      "needle known: k and lambda as well known beforehand as the fit over all recordings knows them; needle "
      "free: each recording chooses its own.");
  all.push_back(std::to_string(loop.targeting.live[0].miss_mm.size()) + " insertions with each model: " +
                std::to_string(loop.targeting.targets_mm.size()) + " targets, seeds " + seeds_of(loop) +
                "; 95 % bootstrap intervals (that of the largest reaches no higher than the largest seen).");
  all.push_back(
      text("forgiving filter: its process noise times %.0f, as one would set it whose filter rejects what it "
           "sees.",
           kForgiveness));
  all.push_back("targets (mm): " + targets_of(loop) + ".");
  return all;
}

const Row kHeader = {"figure", "", kStageNames[kAsItCame], kStageNames[kRefitted], kStageNames[kAugmented]};

json as_json(const WithInterval& v) { return {{"value", v.value}, {"ci95", {v.low, v.high}}}; }
json as_json(const ChiSquareMean& m) {
  return {{"mean", m.mean()}, {"band95", {m.lowest(), m.highest()}}, {"count", m.degrees}};
}
json as_json(const RigFigure& f) {
  json recordings = json::object();
  for (const auto& r : f.recordings)
    recordings[r.log] = {{"rmse_mm", r.rmse_mm}, {"chi2_per_reading", r.chi2_per_reading}};
  return {{"rmse_mm", f.rmse_mm},
          {"max_mm", f.max_mm},
          {"chi2_per_reading", f.chi2_per_reading},
          {"readings", f.readings},
          {"recordings", recordings}};
}
json as_json(const EstimatorFigure& f) {
  return {{"nis", as_json(f.nis)},
          {"nis_x", as_json(f.axis[0])},
          {"nis_y", as_json(f.axis[1])},
          {"nis_z", as_json(f.axis[2])},
          {"coloured", f.coloured},
          {"series", f.series},
          {"coloured_by_chance", f.coloured_by_chance},
          {"gate_rejects", f.rejected},
          {"measurements", f.measurements},
          {"resets", f.resets},
          {"consistent", f.consistent()}};
}
json as_json(const TargetingFigure& f) {
  return {{"insertions", f.miss_mm.size()},
          {"mean_mm", as_json(f.mean_mm)},
          {"largest_mm", as_json(f.largest_mm)},
          {"ended_early", f.stopped},
          {"why", f.why},
          {"turns_per_100mm", f.turns_per_100mm},
          {"miss_mm", f.miss_mm}};
}

}  // namespace

std::string table_text(const ClosedLoop& loop) {
  std::vector<Row> rows = rows_of(loop);
  rows.insert(rows.begin(), kHeader);
  std::array<std::size_t, 5> widths{};
  for (const Row& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  std::string out = loop.case_name + ": found " + found_in_words(loop) + "\n\n";
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += row[i] + std::string(widths[i] + 2 - row[i].size(), ' ');
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  out += "\n";
  for (const auto& sentence : conclusions(loop)) out += sentence + "\n";
  out += "\n";
  for (const auto& note : notes(loop)) out += "- " + note + "\n";
  return out;
}

std::string to_json(const ClosedLoop& loop) {
  json j;
  j["case"] = loop.case_name;
  j["verdict"] = diagnosis::name_of(loop.findings.verdict);
  j["found"] = json::array();
  for (const auto& entry : loop.models[kAugmented].effects)
    j["found"].push_back({{"name", entry.name}, {"parameters", entry.parameters}});
  for (std::size_t s = 0; s < kStages; ++s) {
    j["rig"][kStageNames[s]] = as_json(loop.rig[s]);
    j["estimator"]["needle known"][kStageNames[s]] = as_json(loop.estimator.known[s]);
    j["estimator"]["needle free"][kStageNames[s]] = as_json(loop.estimator.free[s]);
    j["controller"]["live"][kStageNames[s]] = as_json(loop.targeting.live[s]);
    j["controller"]["forgiving filter"][kStageNames[s]] = as_json(loop.targeting.forgiving[s]);
  }
  json& controller = j["controller"];
  controller["fall_of_mean_mm"] = {{"live", as_json(loop.targeting.gain_mm)},
                                   {"forgiving filter", as_json(loop.targeting.gain_forgiving_mm)}};
  if (loop.targeting.axes_matter)
    controller["fall_of_mean_mm"]["controller told"] = as_json(loop.targeting.gain_by_axes_mm);
  if (loop.targeting.axes_matter) controller["live, controller not told"] = as_json(loop.targeting.axes_not_undone);
  controller["seeds"] = loop.targeting.seeds;
  for (const auto& t : loop.targeting.targets_mm) controller["targets_mm"].push_back({t.x(), t.y(), t.z()});
  j["conclusions"] = conclusions(loop);
  return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string page_html(const ClosedLoop& loop) {
  const auto& rig = loop.rig;
  const auto& nis = loop.estimator.known;
  const auto& miss = loop.targeting.live;
  report::Page page("The loop closed: " + loop.case_name);
  const bool better = loop.targeting.gain_mm.low > 0;
  page.verdict(
      better ? report::Tone::good : report::Tone::plain, "Found: " + found_in_words(loop), loop.findings.sentence,
      {{"rig against recordings", text("%.2f to %.2f mm", rig[kRefitted].rmse_mm, rig[kAugmented].rmse_mm),
        text("chi2 per reading %.2f to %.2f", rig[kRefitted].chi2_per_reading, rig[kAugmented].chi2_per_reading)},
       {"estimator's NIS", text("%.2f to %.2f", nis[kRefitted].nis.mean(), nis[kAugmented].nis.mean()),
        text("coloured series %d to %d of %d", nis[kRefitted].coloured, nis[kAugmented].coloured,
             nis[kAugmented].series)},
       {"mean targeting error", text("%.2f to %.2f mm", miss[kRefitted].mean_mm.value, miss[kAugmented].mean_mm.value),
        miss[kRefitted].stopped > 0 ? text("ended before the target: %d to %d of %zu", miss[kRefitted].stopped,
                                           miss[kAugmented].stopped, miss[kAugmented].miss_mm.size())
                                    : text("fall %.3f mm, 95 %% %.3f to %.3f", loop.targeting.gain_mm.value,
                                           loop.targeting.gain_mm.low, loop.targeting.gain_mm.high)}});
  page.list(conclusions(loop));
  page.heading("The simulated rig");
  page.figure(rig_picture(loop), "Each recording's motion through plant and cameras, against what was measured.");
  page.heading("The estimator");
  page.figure(estimator_picture(loop),
              "Innovations with the needle known as the fit knows it, the camera's correlation taken out: 1 where the "
              "model leaves nothing out.");
  page.heading("The controller");
  page.figure(
      targeting_picture(loop),
      "How many of the insertions came to rest within a distance of the target, with the model as it was and as "
      "it is in estimator and controller; the rig is the augmented model.");
  page.heading("All figures");
  page.table(kHeader, rows_of(loop));
  page.list(notes(loop));
  return page.html();
}

}  // namespace bevel::analysis
