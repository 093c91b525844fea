// SPDX-License-Identifier: MIT
#include <bevel/analysis/diagnose/steered.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/steering/model_rig.hpp>
#include <bevel/controller/arc_law.hpp>
#include <bevel/diagnosis/parallel.hpp>
#include <bevel/diagnosis/statistics/median.hpp>
#include <bevel/diagnosis/statistics/quantiles.hpp>
#include <bevel/error.hpp>
#include <bevel/io/live_effects.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace): the tool speaks of nothing else

namespace {

constexpr std::uint64_t kSeed = 20'260'102;
constexpr double kShallowest_mm = 30;     // a target nearer leaves no way to steer on
constexpr double kShallowestShare = 0.9;  // of the recordings' depth

bool moves_the_tip(const Findings& f) {
  const auto moves = [](const auto& part) { return !(part.moved_at_depth_mm <= 0); };  // NaN: more than can be said
  return std::ranges::any_of(f.effects, moves) || std::ranges::any_of(f.discrepancies, moves);
}

// Why nobody could steer by this, in a clause; "" if nothing is in the way.
std::string obstacle_to_steering(const RecordedCase& recorded, const Findings& f, const io::ModelFile& in_use,
                                 double depth_mm) {
  const auto k = [](double value) { return number(value) + " 1/mm"; };
  if (!recorded.has_clock) return "the recordings have no clock";
  if (f.needle.value.curvature_per_mm <= k95 * f.needle.curvature_sd_per_mm)
    return "k " + with_error(f.needle.value.curvature_per_mm, f.needle.curvature_sd_per_mm) +
           " 1/mm is not above zero with 95 %";
  if (in_use.needle.curvature_per_mm <= 0)
    return "k of the model file, " + k(in_use.needle.curvature_per_mm) + ", is not above zero";
  if (depth_mm < kShallowest_mm)
    return "the recordings reach " + number(depth_mm) + " mm, and " + number(kShallowest_mm) + " are needed";
  return "";
}

// Uniform over a disc of what both needles reach at the shallowest, and over the depths: at one depth alone, a tip that
// moves in jumps would meet all targets between the same two.
std::vector<Eigen::Vector3d> draw_targets(int count, const std::array<double, 2>& depth_mm,
                                          const model::NeedleParameters& one, const model::NeedleParameters& other) {
  constexpr int kTries = 20;  // for each
  constexpr double kTolerance_mm = 1;
  const double widest_mm =
      kShareOfFarthestAside * std::min(farthest_aside_mm(one, depth_mm[0]), farthest_aside_mm(other, depth_mm[0]));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Eigen::Vector3d> targets;
  for (int tried = 0; tried < kTries * count && std::ssize(targets) < count; ++tried) {
    const double aside_mm = widest_mm * std::sqrt(share(random));
    const double angle_rad = 2 * std::numbers::pi * share(random);
    const double z_mm = std::lerp(depth_mm[0], depth_mm[1], share(random));
    const Eigen::Vector3d target_mm(aside_mm * std::cos(angle_rad), aside_mm * std::sin(angle_rad), z_mm);
    const auto is_reached = [&](const model::NeedleParameters& needle) {
      return controller::arc_miss_mm(controller::arc_geometry({}, needle, {}, target_mm)) <= kTolerance_mm;
    };
    if (is_reached(one) && is_reached(other)) targets.push_back(target_mm);
  }
  return targets;
}

SteeredFigures figures_of(const std::vector<rig::Insertion>& insertions) {
  std::vector<double> miss_mm;
  std::map<std::string, SteeredFigures::Stopped> reasons;
  for (const auto& one : insertions) {
    if (one.at_depth) {
      miss_mm.push_back(one.miss_mm);
      continue;
    }
    const rig::StopCause& cause = *one.stopped;
    SteeredFigures::Stopped& all = reasons[cause.reason];
    if (all.count++ == 0)
      all = {cause.reason, 1, {cause.value, cause.value}, cause.limit, cause.unit, {cause.depth_mm, cause.depth_mm}};
    all.value = {std::min(all.value[0], cause.value), std::max(all.value[1], cause.value)};
    all.depth_mm = {std::min(all.depth_mm[0], cause.depth_mm), std::max(all.depth_mm[1], cause.depth_mm)};
  }
  SteeredFigures out{.arrived = miss_mm.size()};
  out.median_mm = out.worst_mm = std::numeric_limits<double>::quiet_NaN();
  if (!miss_mm.empty()) out.median_mm = median(miss_mm), out.worst_mm = std::ranges::max(miss_mm);
  for (auto& [reason, stopped] : reasons) out.stopped.push_back(std::move(stopped));
  std::ranges::stable_sort(out.stopped, std::ranges::greater{}, &SteeredFigures::Stopped::count);
  if (!out.stopped.empty()) out.stopped_by = out.stopped.front().reason;
  return out;
}

PairedMiss compare(const std::vector<rig::Insertion>& as_it_stands, const std::vector<rig::Insertion>& found) {
  std::vector<double> farther_mm;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (as_it_stands[i].at_depth && found[i].at_depth) farther_mm.push_back(found[i].miss_mm - as_it_stands[i].miss_mm);
  PairedMiss out{.targets = farther_mm.size()};
  const auto n = static_cast<double>(farther_mm.size());
  for (const double one : farther_mm) out.farther_mm += one / n;
  double squares = 0;
  for (const double one : farther_mm) squares += (one - out.farther_mm) * (one - out.farther_mm);
  out.std_error_mm = n > 1 ? std::sqrt(squares / (n * (n - 1))) : std::numeric_limits<double>::quiet_NaN();
  return out;
}

SteeredToTargets steer(const RecordedCase& recorded, const io::ModelFile& in_use, const io::ModelFile& found,
                       const inference::Noise& noise, const std::array<double, 2>& depth_mm,
                       const std::vector<Eigen::Vector3d>& targets_mm, int threads) {
  SteeredToTargets out{.targets = targets_mm.size(), .seed = kSeed, .depth_mm = depth_mm};
  const rig::Cameras cameras = cameras_of(recorded, noise);
  const std::array<rig::Believed, 2> believed = {believed_of(in_use), believed_of(found)};
  const double duration_s = depth_mm[1] / controller::SteeringLimits{}.insertion_rate_mm_s;
  std::array<std::vector<rig::Insertion>, 2> insertions;
  for (auto& all : insertions) all.resize(out.targets);
  parallel_for(2 * out.targets, threads, [&](std::size_t job) {
    const std::size_t belief = job % 2, target = job / 2;
    const std::uint64_t seed = kSeed + target;
    const rig::SteeredRig rig{.make_plant =
                                  [&] {
                                    return std::make_unique<rig::KinematicPlant>(
                                        found.needle, for_one_insertion(found, duration_s, seed));
                                  },
                              .cameras = cameras};
    insertions[belief][target] = rig::steer(rig, believed[belief], targets_mm[target], seed);
  });
  out.as_it_stands = figures_of(insertions[0]);
  out.found = figures_of(insertions[1]);
  out.paired = compare(insertions[0], insertions[1]);
  for (const auto& entry : found.effects)
    if (!io::unknown_beforehand(entry).empty()) out.not_known_live.push_back(entry.name);
  return out;
}

}  // namespace

void steer_to_targets(const RecordedCase& recorded, const io::ModelFile& in_use, const io::ModelFile& found,
                      const SteeringOptions& options, Findings& f) {
  const auto moved = moved_at_depth(f);
  if (options.targets < 1 || f.two_groups || !moved || !moves_the_tip(f)) return;
  const double deepest_mm = std::min(moved->depth_mm[1], kDeepestTarget_mm);
  f.not_steered = obstacle_to_steering(recorded, f, in_use, deepest_mm);
  if (!f.not_steered.empty()) return;
  const std::array<double, 2> depth_mm{kShallowestShare * deepest_mm, deepest_mm};
  const auto targets_mm = draw_targets(options.targets, depth_mm, in_use.needle, found.needle);
  if (targets_mm.empty()) {
    f.not_steered = "no target " + number(deepest_mm) + " mm deep is within the needle's reach";
    return;
  }
  try {
    f.steered = steer(recorded, in_use, found, f.noise, depth_mm, targets_mm, options.threads);
  } catch (const Error& e) {  // a model that estimator or controller refuses is no reason to lose the rest
    f.not_steered = e.what();
  }
}

}  // namespace bevel::analysis
