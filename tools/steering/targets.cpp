#include "tools/steering/targets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <ostream>
#include <stdexcept>

#include "diagnosis/parallel.hpp"
#include "tools/common/progress_line.hpp"
#include "tools/steering/scenarios.hpp"

namespace bevel::steering {
namespace {

struct LawTried {
  const char* name;
  controller::Law law;
  bool told_the_tip = false;  // what an estimate without error would bring: asked where the tip swings
};
constexpr std::array<LawTried, 4> kLaws{{{"arcs", controller::Law::arcs},
                                         {"arcs, told the tip", controller::Law::arcs, true},
                                         {"flip", controller::Law::flip},
                                         {"spin", controller::Law::spin}}};

// Of those that came to rest at the target's depth.
struct Figures {
  int targets = 0, arrived = 0, refused = 0;
  double median_mm = 0, mean_mm = 0, sd_mm = 0, at_95_mm = 0, worst_mm = 0;
  double turns_per_100mm = 0, feed_mm_s = 0, estimate_error_mm = 0, pose_nees_per_axis = 0;
  int turned_frame_said = 0;                                    // of all targets
  double way_point_miss_mm = 0;                                 // the worst, of those that arrived
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
    if (one.turned_frame_said_mm > 0) ++f.turned_frame_said;
    if (one.nearest_mm < 0) ++f.touched;
    f.nearest_mm = std::min(f.nearest_mm, one.nearest_mm);
    if (!one.arrived) {
      using controller::Reason;
      if (one.inserted_mm == 0 && (one.reason == Reason::target_unreachable || one.reason == Reason::path_blocked ||
                                   one.reason == Reason::way_point_unreachable))
        ++f.refused;
      else
        ++f.stopped[one.reason == controller::Reason::none ? "not there in time" : to_string(one.reason)];
      continue;
    }
    ++f.arrived;
    f.way_point_miss_mm = std::max(f.way_point_miss_mm, one.way_point_miss_mm);
    f.off_the_path_mm = std::max(f.off_the_path_mm, one.off_the_path_mm);
    f.drawn_back_error_mm = std::max(f.drawn_back_error_mm, one.drawn_back_error_mm);
    f.before_miss_mm = std::max(f.before_miss_mm, one.before_miss_mm);
    miss_mm.push_back(one.miss_mm);
    turned_rad += one.turned_rad, inserted_mm += one.inserted_mm, duration_s += one.duration_s;
    f.estimate_error_mm += one.estimate_error_mm, f.pose_nees_per_axis += one.pose_nees / 6;
  }
  if (miss_mm.empty()) return f;
  const auto n = static_cast<double>(miss_mm.size());
  std::ranges::sort(miss_mm);
  const auto at = [&](double share) { return miss_mm[static_cast<std::size_t>(share * (n - 1) + 0.5)]; };
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
  std::array<char, 256> text{};
  std::snprintf(
      text.data(), text.size(),
      "| %s | %s | %.2f | %.2f +- %.2f | %.2f | %.2f | %.1f | %d | %.1f | %.2f | %.2f | %.2f |", scenario.c_str(), law,
      f.median_mm, f.mean_mm, f.sd_mm, f.at_95_mm, f.worst_mm, 100.0 * f.arrived / std::max(f.targets, 1), f.refused,
      f.turns_per_100mm, f.feed_mm_s, f.estimate_error_mm, f.pose_nees_per_axis);
  std::string row = text.data();
  for (const auto& [reason, count] : f.stopped) row += " " + std::to_string(count) + " " + reason + ";";
  if (f.turned_frame_said > 0) row += " frame said to be turned: " + std::to_string(f.turned_frame_said) + ";";
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
          {"arrived", f.arrived},
          {"refused", f.refused},
          {"stopped", f.stopped},
          {"turned_frame_said", f.turned_frame_said},
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

}  // namespace

int run_targets(const TargetsOptions& options, std::ostream& out) {
  std::vector<const Scenario*> wanted;
  std::string names;
  for (const Scenario& scenario : scenarios()) {
    names += (names.empty() ? "" : ", ") + scenario.name;
    if (options.scenario.empty() || options.scenario == scenario.name) wanted.push_back(&scenario);
  }
  if (wanted.empty()) throw std::runtime_error("no scenario '" + options.scenario + "'; there are: " + names);
  std::ofstream file;
  if (!options.json.empty()) {
    file.open(options.json);
    if (!file) throw std::runtime_error(options.json + ": cannot be written");
  }
  out << options.targets << " targets each, seed " << options.seed << "; mm, of those that arrived\n\n"
      << "| scenario | law | median | mean +- sd | 95 % | worst | arrived, % | refused before | turns per 100 mm | "
         "feed, mm/s | estimate to tip | pose NEES / 6 | stopped |\n| --- | --- | --- | --- | --- | --- | --- | --- "
         "| --- | --- | --- | --- | --- |\n";
  nlohmann::json all = nlohmann::json::array();
  const auto is_tried = [](const Scenario& scenario, const LawTried& law) {
    if (law.told_the_tip && !scenario.swings) return false;
    return !scenario.along_path || law.law == controller::Law::arcs;
  };
  std::size_t rows = 0;
  for (const Scenario* scenario : wanted)
    for (const LawTried& law : kLaws) rows += is_tried(*scenario, law) ? 1 : 0;
  tools::ProgressLine progress(tools::ProgressLine::as_stderr_is());
  progress.begin("insertions", rows * static_cast<std::size_t>(options.targets),
                 static_cast<std::size_t>(options.threads));
  for (const Scenario* scenario : wanted)
    for (const LawTried& law : kLaws) {
      if (!is_tried(*scenario, law)) continue;
      std::vector<Insertion> insertions(static_cast<std::size_t>(options.targets));
      parallel_for(insertions.size(), options.threads, [&](std::size_t i) {
        const std::uint64_t seed = 1'000'003 * options.seed + i;
        Trial trial = scenario->draw(seed);
        trial.believed.controller.law = law.law;
        if (options.tube_share >= 0) trial.believed.controller.gains.tube_share = options.tube_share;
        insertions[i] = steer(trial.rig, trial.believed, trial.target_mm, seed, law.told_the_tip);
        progress.one_done();
      });
      const Figures figures = figures_of(insertions);
      progress.make_room();
      out << row_of(scenario->name, law.name, figures) << std::endl;
      all.push_back(json_of(*scenario, law.name, figures));
    }
  progress.end();
  out << "\n";
  for (const Scenario* scenario : wanted) out << "- " << scenario->name << ": " << scenario->what << "\n";
  if (file.is_open()) file << nlohmann::json{{"seed", options.seed}, {"rows", all}}.dump(1) << "\n";
  return 0;
}

}  // namespace bevel::steering
