// SPDX-License-Identifier: MIT
#include <bevel/analysis/close_loop/targeting_figure.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <random>

#include <bevel/analysis/steering/model_rig.hpp>
#include <bevel/controller/arc_law.hpp>
#include <bevel/diagnosis/parallel.hpp>
#include <bevel/error.hpp>

namespace bevel::analysis {
namespace {

constexpr int kDirections = 6;
constexpr std::array<double, 2> kDepthShares = {0.7, 1.0};
constexpr std::uint64_t kBootstrapSeed = 20'260'101;

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}
double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

template <class Statistic>
WithInterval bootstrap(const std::vector<double>& values, int draws, Statistic statistic) {
  std::mt19937_64 random(kBootstrapSeed);
  std::uniform_int_distribution<std::size_t> any(0, values.size() - 1);
  std::vector<double> drawn(values.size()), of_draws;
  for (int d = 0; d < draws; ++d) {
    for (double& v : drawn) v = values[any(random)];
    of_draws.push_back(statistic(drawn));
  }
  std::sort(of_draws.begin(), of_draws.end());
  const auto at = [&](double share) {
    return of_draws[static_cast<std::size_t>(share * static_cast<double>(of_draws.size() - 1))];
  };
  return {statistic(values), at(0.025), at(0.975)};
}

WithInterval mean_difference(const TargetingFigure& before, const TargetingFigure& after, int draws) {
  std::vector<double> falls;
  for (std::size_t i = 0; i < before.miss_mm.size(); ++i) falls.push_back(before.miss_mm[i] - after.miss_mm[i]);
  return bootstrap(falls, draws, mean);
}

rig::Believed believed(const io::ModelFile& model, double forgiveness) {
  rig::Believed out = believed_of(model);
  auto& process = out.estimator.process;
  for (double* noise : {&process.position_mm, &process.tilt_rad, &process.roll_rad, &process.roll_per_sqrt_rad,
                        &process.curvature_per_mm, &process.lambda1_per_rad, &process.lambda2})
    *noise *= forgiveness;
  return out;
}

TargetingFigure summarised(const std::vector<rig::Insertion>& insertions, double inserted_mm, int draws) {
  TargetingFigure figure;
  std::map<std::string, int> reasons;
  double turned_rad = 0;
  for (const rig::Insertion& one : insertions) {
    figure.miss_mm.push_back(one.miss_mm);
    turned_rad += one.turned_rad;
    if (one.at_depth) continue;
    ++figure.stopped;
    ++reasons[one.stopped ? one.stopped->reason : controller::to_string(one.reason)];
  }
  int most = 0;
  for (const auto& [reason, count] : reasons)
    if (count > most) most = count, figure.why = reason;
  figure.turns_per_100mm = turned_rad / (2 * std::numbers::pi) / inserted_mm * 100;
  figure.mean_mm = bootstrap(figure.miss_mm, draws, mean);
  figure.largest_mm = bootstrap(figure.miss_mm, draws, largest);
  return figure;
}

}  // namespace

std::vector<Eigen::Vector3d> choose_targets(const model::NeedleParameters& needle, double deepest_mm) {
  std::vector<Eigen::Vector3d> targets;
  for (const double share : kDepthShares) {
    const double depth_mm = share * std::min(deepest_mm, kDeepestTarget_mm);
    const double radius_mm = kShareOfFarthestAside * farthest_aside_mm(needle, depth_mm);
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.25) / kDirections;
      const Eigen::Vector3d target(radius_mm * std::cos(angle), radius_mm * std::sin(angle), depth_mm);
      if (controller::arc_miss_mm(controller::arc_geometry({}, needle, {}, target)) <= 1) targets.push_back(target);
    }
  }
  if (targets.empty())
    throw DomainError("no target within reach of the needle down to " + std::to_string(deepest_mm) +
                      " mm: the recordings are too shallow to steer as far as they go");
  return targets;
}

TargetingFigures steer_all(const Models& models, const diagnosis::RecordedCase& recorded, const inference::Noise& noise,
                           const TargetingOptions& options) {
  const rig::Cameras cameras = cameras_of(recorded, noise);
  double deepest_mm = 0;
  for (const auto& recording : recorded.recordings)
    for (const auto& node : recording.motion.nodes)
      deepest_mm = std::max(deepest_mm, node.insertion_mm - recording.motion.nodes.front().insertion_mm);

  const io::ModelFile& truth = models[kAugmented];
  TargetingFigures figures;
  figures.targets_mm = choose_targets(truth.needle, deepest_mm);
  for (int s = 1; s <= options.seeds; ++s) figures.seeds.push_back(static_cast<std::uint64_t>(s));

  std::vector<rig::Believed> beliefs;
  for (const double forgiveness : {1.0, kForgiveness})
    for (const io::ModelFile& model : models) beliefs.push_back(believed(model, forgiveness));
  figures.axes_matter = controller::AxisModel(beliefs[kAugmented].undone).turns_late();
  if (figures.axes_matter) {
    beliefs.push_back(beliefs[kAugmented]);
    beliefs.back().undone.clear();
  }

  const std::size_t count = figures.targets_mm.size() * figures.seeds.size();
  std::vector<std::vector<rig::Insertion>> insertions(beliefs.size(), std::vector<rig::Insertion>(count));
  const double nominal_s = deepest_mm / controller::SteeringLimits{}.insertion_rate_mm_s;
  if (options.progress != nullptr)
    options.progress->begin("insertions", beliefs.size() * count, static_cast<std::size_t>(options.threads));
  parallel_for(beliefs.size() * count, options.threads, [&](std::size_t job) {
    const std::size_t belief = job / count, i = job % count, target = i / figures.seeds.size();
    const std::uint64_t seed = 1000 * figures.seeds[i % figures.seeds.size()] + target;
    const auto own = model::draw(truth.variation.value_or(model::Variation{}), seed);
    const rig::SteeredRig rig{.make_plant =
                                  [&] {
                                    return std::make_unique<rig::KinematicPlant>(
                                        truth.needle, for_one_insertion(truth, nominal_s, seed), 0, own);
                                  },
                              .cameras = cameras};
    insertions[belief][i] = rig::steer(rig, beliefs[belief], figures.targets_mm[target], seed);
    if (options.progress != nullptr) options.progress->one_done();
  });
  if (options.progress != nullptr) options.progress->end();
  double inserted_mm = 0;
  for (const auto& target : figures.targets_mm) inserted_mm += target.z() * static_cast<double>(figures.seeds.size());
  const auto summary = [&](std::size_t belief) {
    return summarised(insertions[belief], inserted_mm, options.bootstrap_draws);
  };
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    figures.live[stage] = summary(stage);
    figures.forgiving[stage] = summary(kStages + stage);
  }
  if (figures.axes_matter) {
    figures.axes_not_undone = summary(2 * kStages);
    figures.gain_by_axes_mm =
        mean_difference(figures.axes_not_undone, figures.live[kAugmented], options.bootstrap_draws);
  }
  figures.gain_mm = mean_difference(figures.live[kRefitted], figures.live[kAugmented], options.bootstrap_draws);
  figures.gain_forgiving_mm =
      mean_difference(figures.forgiving[kRefitted], figures.forgiving[kAugmented], options.bootstrap_draws);
  return figures;
}

}  // namespace bevel::analysis
