// SPDX-License-Identifier: MIT
#include <bevel/analysis/steering/targets.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <ostream>
#include <utility>

#include <bevel/cli/progress_line.hpp>
#include <bevel/diagnosis/parallel.hpp>
#include <bevel/error.hpp>
#include <bevel/io/result_file.hpp>
#include <bevel/rig/steering/scenarios.hpp>

namespace bevel::analysis {

using namespace rig;  // NOLINT(google-build-using-namespace): scenarios and simulated insertions

namespace {

struct LawTried {
  const char* name;
  controller::Law law;
  bool told_the_tip = false;  // what an estimate without error would bring
  std::optional<BaselineLaw> baseline{};
  bool compared = true;  // with the controller's own
};
constexpr std::array<LawTried, 6> kLaws{
    {{.name = "arcs", .law = controller::Law::arcs, .compared = false},
     {.name = "told the tip", .law = controller::Law::arcs, .told_the_tip = true},
     {.name = "spin", .law = controller::Law::spin},
     {.name = "duty cycle", .law = controller::Law::spin, .baseline = BaselineLaw::duty_cycle},
     {.name = "bang-bang", .law = controller::Law::spin, .baseline = BaselineLaw::bang_bang},
     {.name = "flip", .law = controller::Law::flip}}};

// Errors are of the insertions that came to rest at the depth of their target, near it or not.
struct Figures {
  int targets = 0, at_depth = 0, refused = 0;
  // The controller's report compared with the true tip. A needle that was stopped on the way because the target had
  // left the reachable set is a reported miss.
  int arrived = 0, missed_as_reported = 0, missed_unreported = 0;
  int reported_in_vain = 0;  // of the reported misses: the true tip is within the tolerance
  double median_mm = 0, mean_mm = 0, sd_mm = 0, at_95_mm = 0, worst_mm = 0;
  double turns_per_100mm = 0, feed_mm_s = 0, estimate_error_mm = 0, pose_nees_per_axis = 0;
  std::vector<double> turned_frame_said_mm{};  // of insertion, of all targets
  double way_point_miss_mm = 0;                // the worst, of those that arrived
  // The same of those that were drawn back: of the tip off the way in, of the estimate, and of the target before.
  double off_the_path_mm = 0, drawn_back_error_mm = 0, before_miss_mm = 0;
  int touched = 0;                                              // an obstacle, of all targets
  double nearest_mm = std::numeric_limits<double>::infinity();  // to one
  std::map<std::string, int> stopped;                           // by reason
};

Figures figures_of(const std::vector<Insertion>& all) {
  Figures f;
  std::vector<double> miss_mm;
  double turned_rad = 0, inserted_mm = 0, duration_s = 0;
  for (const Insertion& one : all) {
    ++f.targets;
    if (one.turned_frame_said_mm > 0) f.turned_frame_said_mm.push_back(one.turned_frame_said_mm);
    if (one.nearest_mm < 0) ++f.touched;
    f.nearest_mm = std::min(f.nearest_mm, one.nearest_mm);
    if (!one.at_depth) {
      using controller::Reason;
      if (one.inserted_mm > 0 && one.reason == Reason::target_unreachable) ++f.missed_as_reported;
      if (one.inserted_mm == 0 && (one.reason == Reason::target_unreachable || one.reason == Reason::path_blocked ||
                                   one.reason == Reason::way_point_unreachable))
        ++f.refused;
      else
        ++f.stopped[one.stopped ? one.stopped->reason : to_string(one.reason)];
      continue;
    }
    ++f.at_depth;
    if (const controller::Miss& reported = one.reported; reported.tolerance_mm > 0) {
      const bool is_near = one.miss_mm <= reported.tolerance_mm;
      ++(!reported.is_within() ? f.missed_as_reported : is_near ? f.arrived : f.missed_unreported);
      if (!reported.is_within() && is_near) ++f.reported_in_vain;
    }
    f.way_point_miss_mm = std::max(f.way_point_miss_mm, one.way_point_miss_mm);
    f.off_the_path_mm = std::max(f.off_the_path_mm, one.off_the_path_mm);
    f.drawn_back_error_mm = std::max(f.drawn_back_error_mm, one.drawn_back_error_mm);
    f.before_miss_mm = std::max(f.before_miss_mm, one.before_miss_mm);
    miss_mm.push_back(one.miss_mm);
    turned_rad += one.turned_rad, inserted_mm += one.inserted_mm, duration_s += one.duration_s;
    f.estimate_error_mm += one.estimate_error_mm, f.pose_nees_per_axis += one.pose_nees / 6;
  }
  std::ranges::sort(f.turned_frame_said_mm);
  if (miss_mm.empty()) return f;
  const auto n = static_cast<double>(miss_mm.size());
  std::ranges::sort(miss_mm);
  const auto at = [&](double share) { return miss_mm[static_cast<std::size_t>(std::lround(share * (n - 1)))]; };
  f.median_mm = at(0.5), f.at_95_mm = at(0.95), f.worst_mm = miss_mm.back();
  for (const double m : miss_mm) f.mean_mm += m / n;
  for (const double m : miss_mm) f.sd_mm += (m - f.mean_mm) * (m - f.mean_mm);
  f.sd_mm = std::sqrt(f.sd_mm / std::max(n - 1, 1.0));
  f.turns_per_100mm = turned_rad / (2 * std::numbers::pi) / inserted_mm * 100;
  f.feed_mm_s = inserted_mm / duration_s;
  f.estimate_error_mm /= n, f.pose_nees_per_axis /= n;
  return f;
}

std::string row_of(const std::string& scenario, const char* law, const Figures& f) {
  std::array<char, 320> text{};
  // The laws that the controller's are compared with report nothing.
  const std::string outcomes = f.arrived + f.missed_as_reported + f.missed_unreported == 0 && f.at_depth > 0
                                   ? " |  | "
                                   : std::to_string(f.arrived) + " | " + std::to_string(f.missed_as_reported) + " | " +
                                         std::to_string(f.missed_unreported);
  std::snprintf(text.data(), text.size(),
                "| %s | %s | %d | %.2f | %.2f +- %.2f | %.2f | %.2f | %.1f | %s | %d | %.1f | %.2f | %.2f | %.2f |",
                scenario.c_str(), law, f.targets, f.median_mm, f.mean_mm, f.sd_mm, f.at_95_mm, f.worst_mm,
                100.0 * f.at_depth / std::max(f.targets, 1), outcomes.c_str(), f.refused, f.turns_per_100mm,
                f.feed_mm_s, f.estimate_error_mm, f.pose_nees_per_axis);
  std::string row = text.data();
  if (f.at_depth == 0)
    row = "| " + scenario + " | " + law + " | " + std::to_string(f.targets) + " | | | | | 0.0 | " + outcomes + " | " +
          std::to_string(f.refused) + " | | | | |";
  else if (f.at_depth == 1)  // one value has no standard deviation
    row.replace(row.find(" +- "), row.find(" | ", row.find(" +- ")) - row.find(" +- "), "");
  if (f.reported_in_vain > 0)
    row += " " + std::to_string(f.reported_in_vain) + " of the reported misses within the tolerance;";
  for (const auto& [reason, count] : f.stopped) row += " " + std::to_string(count) + " " + reason + ";";
  if (const auto& said_mm = f.turned_frame_said_mm; !said_mm.empty()) {
    std::snprintf(text.data(), text.size(), " frame said to be turned: %zu, half of them by %.0f mm, all by %.0f;",
                  said_mm.size(), said_mm[said_mm.size() / 2], said_mm.back());
    row += text.data();
  }
  if (f.way_point_miss_mm > 0) {
    std::snprintf(text.data(), text.size(), " way-point missed by at most %.2f;", f.way_point_miss_mm);
    row += text.data();
  }
  if (f.off_the_path_mm > 0) {
    std::snprintf(text.data(), text.size(),
                  " drawn back: off the way in by at most %.2f, estimate off by at most %.2f, target before missed by "
                  "at most %.2f;",
                  f.off_the_path_mm, f.drawn_back_error_mm, f.before_miss_mm);
    row += text.data();
  }
  if (std::isfinite(f.nearest_mm)) {
    std::snprintf(text.data(), text.size(), " obstacle touched: %d, nearest %.2f;", f.touched, f.nearest_mm);
    row += text.data();
  }
  return row + " |";
}

nlohmann::json json_of(const Scenario& scenario, const char* law, const Figures& f) {
  return {{"scenario", scenario.name},
          {"what", scenario.what},
          {"law", law},
          {"targets", f.targets},
          {"at_depth", f.at_depth},
          {"arrived", f.arrived},
          {"missed_as_reported", f.missed_as_reported},
          {"missed_unreported", f.missed_unreported},
          {"reported_in_vain", f.reported_in_vain},
          {"refused", f.refused},
          {"stopped", f.stopped},
          {"turned_frame_said_mm", f.turned_frame_said_mm},
          {"touched", f.touched},
          {"way_point_miss_mm", f.way_point_miss_mm},
          {"off_the_path_mm", f.off_the_path_mm},
          {"drawn_back_error_mm", f.drawn_back_error_mm},
          {"before_miss_mm", f.before_miss_mm},
          {"nearest_mm", std::isfinite(f.nearest_mm) ? nlohmann::json(f.nearest_mm) : nlohmann::json()},
          {"median_mm", f.median_mm},
          {"mean_mm", f.mean_mm},
          {"sd_mm", f.sd_mm},
          {"at_95_mm", f.at_95_mm},
          {"worst_mm", f.worst_mm},
          {"turns_per_100mm", f.turns_per_100mm},
          {"feed_mm_s", f.feed_mm_s},
          {"estimate_error_mm", f.estimate_error_mm},
          {"pose_nees_per_axis", f.pose_nees_per_axis}};
}

std::vector<const Scenario*> wanted_scenarios(const std::string& name) {
  std::vector<const Scenario*> wanted;
  std::string names = "all";
  for (const Scenario& scenario : scenarios()) {
    names += ", " + scenario.name;
    if (name.empty() ? scenario.in_table : name == "all" || name == scenario.name) wanted.push_back(&scenario);
  }
  if (wanted.empty()) throw ConfigurationError("no scenario '" + name + "'; there are: " + names);
  return wanted;
}

std::vector<LawTried> wanted_laws(const std::string& name) {
  std::vector<LawTried> wanted;
  std::string names;
  for (const LawTried& law : kLaws) {
    names += (names.empty() ? "" : ", ") + std::string(law.name);
    if (name.empty() ? law.law != controller::Law::flip : name == law.name) wanted.push_back(law);
  }
  if (wanted.empty()) throw ConfigurationError("no law '" + name + "'; there are: " + names);
  return wanted;
}

bool is_tried(const Scenario& scenario, const LawTried& law) {
  if (law.told_the_tip && !scenario.with_floor) return false;
  if (law.baseline && (scenario.goes_back || scenario.gated)) return false;
  if (scenario.by_flips) return law.law == controller::Law::arcs;
  return !scenario.along_path || law.law == controller::Law::arcs;
}

struct Row {
  const Scenario* scenario;
  LawTried law;
  int targets;
};

std::vector<Row> rows_of(const TargetsOptions& options) {
  std::vector<Row> rows;
  const std::vector<LawTried> laws = wanted_laws(options.law);
  for (const Scenario* scenario : wanted_scenarios(options.scenario))
    for (const LawTried& law : laws)
      if (is_tried(*scenario, law))
        rows.push_back({scenario, law, law.compared ? std::min(options.targets, options.compared) : options.targets});
  return rows;
}

Insertion one_insertion(const Row& row, const TargetsOptions& options, std::uint64_t seed) {
  Trial trial = row.scenario->draw(seed);
  trial.believed.controller.law = row.scenario->by_flips ? controller::Law::flip : row.law.law;
  trial.believed.baseline = row.law.baseline;
  if (options.tube_share >= 0) trial.believed.controller.gains.tube_share = options.tube_share;
  return steer(trial.rig, trial.believed, trial.target_mm, seed, row.law.told_the_tip);
}

}  // namespace

int run_targets(const TargetsOptions& options, std::ostream& out) {
  const std::vector<Row> rows = rows_of(options);
  if (rows.empty())
    throw ConfigurationError("--law \"" + options.law + "\" is not tried in --scenario " + options.scenario);
  if (!options.json.empty()) io::require_writable(options.json);  // before hours of work
  out << "seed " << options.seed
      << "; errors in mm, of the insertions that came to rest at the depth of their target\n\n"
      << "| scenario | law | targets | median | mean +- sd | 95 % | worst | at depth, % | arrived | missed as reported "
         "| "
         "missed and not reported | refused before | turns per 100 mm | feed, mm/s | estimate to tip | pose NEES / 6 | "
         "stopped |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | "
         "--- |\n";
  nlohmann::json all = nlohmann::json::array();
  std::size_t insertions_all = 0;
  for (const Row& row : rows) insertions_all += static_cast<std::size_t>(row.targets);
  cli::ProgressLine progress(cli::ProgressLine::as_stderr_is());
  progress.begin("insertions", insertions_all, static_cast<std::size_t>(options.threads));
  const std::clock_t from = std::clock();
  for (const Row& row : rows) {
    std::vector<Insertion> insertions(static_cast<std::size_t>(row.targets));
    parallel_for(insertions.size(), options.threads, [&](std::size_t i) {
      insertions[i] = one_insertion(row, options, 1'000'003 * options.seed + i);
      progress.one_done();
    });
    const char* law = row.scenario->by_flips && !row.law.told_the_tip ? "flip" : row.law.name;
    const Figures figures = figures_of(insertions);
    progress.make_room();
    out << row_of(row.scenario->name, law, figures) << std::endl;
    all.push_back(json_of(*row.scenario, law, figures));
  }
  progress.end();
  const double processor_s = static_cast<double>(std::clock() - from) / CLOCKS_PER_SEC;
  out << "\n" << insertions_all << " insertions, " << std::lround(processor_s) << " s of processor time\n\n";
  const Scenario* before = nullptr;
  for (const Row& row : rows)
    if (std::exchange(before, row.scenario) != row.scenario)
      out << "- " << row.scenario->name << ": " << row.scenario->what << "\n";
  if (!options.json.empty())
    io::write_result_file(options.json, nlohmann::json{{"seed", options.seed}, {"rows", all}}.dump(1) + "\n");
  return 0;
}

}  // namespace bevel::analysis
