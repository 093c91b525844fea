// SPDX-License-Identifier: MIT
// The first of bevel-targets' targets, with the same needles and beliefs, by what runs live: estimator, controller and
// stepper driver over LCM in memory, simulated drives on a bus, and pictures rendered and tracked, two cameras of the
// demo's system file at 30 Hz whose pictures arrive 50 ms after they were taken. Simulated time: the same seed gives
// the same run.
//   study_rendered_targets [targets in each scenario] [scenario...]
// Prints a row for each scenario; exit status 0 if each has arrived, 1 if one has not, 2 where a scenario is none, or
// has more to it than a needle (cameras that are off, a target that moves, a path): its rig is not taken over.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <iostream>
#include <memory>
#include <numbers>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <bevel/diagnosis/parallel.hpp>
#include <bevel/nodes/camera_node.hpp>
#include <bevel/rig/camera/needle_renderer.hpp>
#include <bevel/rig/steering/scenarios.hpp>
#include "tests/loop/simulated_loop.hpp"

namespace bevel {
namespace {

constexpr std::uint64_t kSeed = 1;

// Frames that somebody else makes.
class HandedOver : public camera::FrameSource {
 public:
  void hand(camera::Frame frame) { frames_.push_back(std::move(frame)); }
  camera::FrameResult next(std::chrono::milliseconds) override {
    if (frames_.empty()) return camera::FrameTimeout{};
    camera::Frame frame = std::move(frames_.front());
    frames_.pop_front();
    return frame;
  }

 private:
  std::deque<camera::Frame> frames_;
};

// Renders what each camera of the file sees of a needle, and tracks it as bevel-camera does.
class RenderedCameras {
 public:
  explicit RenderedCameras(const nodes::SystemConfig& config, std::uint64_t seed) {
    std::vector<camera::CameraSetup> setups;
    for (const nodes::CameraViewConfig& c : config.cameras) {
      rig::SceneConfig scene;
      scene.size_px = {c.width_px, c.height_px};
      scene.needle_diameter_mm = c.tracker.needle_diameter_mm;
      scene.bevel_length_mm = c.tracker.bevel_length_mm;
      scene.noise_gray = config.rig.noise_gray;
      scene.blur_px = config.rig.blur_px;
      scene.seed = 2 * seed + static_cast<std::uint64_t>(c.camera);
      renderers_.emplace_back(scene, camera::PlanarView(c.view));
      setups.push_back({c.camera, std::make_shared<camera::PlanarView>(c.view), c.tracker, {}, 0});
    }
    auto source = std::make_unique<HandedOver>();
    source_ = source.get();
    pipeline_ = std::make_unique<camera::CameraPipeline>(std::move(source), setups);
  }

  std::optional<tip_measurement_t> see(const rig::Plant& plant, std::int64_t utime, int which,
                                       const std::optional<needle_state_t>& estimate) {
    std::vector<camera::Vector3> path;
    for (const Eigen::Vector3d& p : plant.shaft_mm()) path.push_back({p.x(), p.y(), p.z()});
    const auto vector = [](const Eigen::Vector3d& v) { return camera::Vector3{v.x(), v.y(), v.z()}; };
    const model::Pose tip = plant.tip();
    const auto i = static_cast<std::size_t>(which);
    rig::NeedleRenderer& renderer = renderers_.at(i);
    const double roll_rad = renderer.roll_seen_rad(vector(tip.p_mm), vector(tip.R.col(2)), vector(-tip.R.col(1)));
    source_->hand({utime, seq_.at(i)++, which, renderer.render(path, roll_rad).gray});
    if (estimate && estimate->health == 0)
      pipeline_->predict({estimate->position_mm[0], estimate->position_mm[1], estimate->position_mm[2]});
    const auto seen = pipeline_->next(std::chrono::milliseconds(0));
    const auto* observation = std::get_if<camera::TipObservation>(&seen);
    if (!observation) return {};
    ++frames;
    return nodes::to_tip(*observation, observation->seq);
  }
  int frames = 0;

 private:
  std::vector<rig::NeedleRenderer> renderers_;
  std::unique_ptr<camera::CameraPipeline> pipeline_;
  HandedOver* source_ = nullptr;  // the pipeline's
  std::array<std::int64_t, 2> seq_{};
};

// The demo's file, its needle and what is believed of it in the trial's place.
nodes::SystemConfig system_of(const rig::Trial& trial) {
  nodes::SystemConfig config = nodes::load_system_config(std::string(BEVEL_SOURCE_DIR "/config/") +
                                                         (trial.needle.beam ? "beam" : "demo") + ".toml");
  config.estimator.prior = trial.believed.estimator.prior;
  config.estimator.nuisance = trial.believed.estimator.nuisance;
  config.needle = config.estimator.prior.needle;
  config.controller.shaft = trial.believed.controller.shaft;
  config.controller.limits = trial.believed.controller.limits;
  config.rig.truth = trial.needle.bicycle;
  config.rig.beam = trial.needle.beam;
  config.rig.roll_error_rad = trial.needle.roll_rad;
  return config;
}

struct Outcome {
  double miss_mm = 0, estimate_error_mm = 0, turned_rad = 0, inserted_mm = 0, duration_s = 0;
  int frames = 0;
  std::string why_not;
};

Outcome one(const rig::Scenario& scenario, std::uint64_t seed) {
  const rig::Trial trial = scenario.draw(seed);
  const nodes::SystemConfig config = system_of(trial);
  test::SimulatedLoop loop(seed, config);
  RenderedCameras cameras(config, seed);
  loop.see = [&](const Eigen::Vector3d&, std::int64_t utime, int which) {
    return cameras.see(loop.rig->plant(), utime, which, loop.needle_state);
  };
  Outcome out;
  out.why_not = loop.steer_to(trial.target_mm);
  if (!out.why_not.empty()) return out;
  const std::int64_t from_ms = loop.ms;
  double before_rad = loop.rig->drive(1).position_unit();
  loop.each_ms = [&] {
    const double at_rad = loop.rig->drive(1).position_unit();
    out.turned_rad += std::abs(at_rad - before_rad);
    before_rad = at_rad;
  };
  loop.run(120, [&] { return loop.state() != controller::State::steering; });
  out.duration_s = 1e-3 * static_cast<double>(loop.ms - from_ms);
  loop.run(0.5);
  if (loop.state() != controller::State::hold)
    out.why_not = std::string(controller::to_string(loop.reason())) + " (" + loop.said("bevel-estimator").reason +
                  ", " + std::to_string(std::lround(loop.rig->drive(0).position_unit())) + " mm in)";
  out.miss_mm = (loop.tip() - trial.target_mm).norm();
  if (loop.needle_state)
    out.estimate_error_mm = (Eigen::Map<const Eigen::Vector3d>(loop.needle_state->position_mm) - loop.tip()).norm();
  out.inserted_mm = loop.rig->drive(0).position_unit();
  out.frames = cameras.frames;
  return out;
}

// Returns how many have not arrived.
int print(const std::string& name, std::vector<Outcome> all) {
  const auto arrived_end =
      std::ranges::stable_partition(all, [](const Outcome& o) { return o.why_not.empty(); }).begin();
  std::vector<double> miss_mm;
  double mean_mm = 0, squares_mm2 = 0, error_mm = 0, turned_rad = 0, inserted_mm = 0, duration_s = 0;
  for (auto o = all.begin(); o != arrived_end; ++o) {
    miss_mm.push_back(o->miss_mm);
    mean_mm += o->miss_mm, squares_mm2 += o->miss_mm * o->miss_mm, error_mm += o->estimate_error_mm;
    turned_rad += o->turned_rad, inserted_mm += o->inserted_mm, duration_s += o->duration_s;
  }
  const auto missing = static_cast<int>(all.size() - miss_mm.size());
  std::printf("| %s | %zu | ", name.c_str(), all.size());
  if (!miss_mm.empty()) {
    const auto n = static_cast<double>(miss_mm.size());
    std::ranges::sort(miss_mm);
    const auto at = [&](double share) { return miss_mm[static_cast<std::size_t>(std::lround(share * (n - 1)))]; };
    mean_mm /= n;
    const double sd_mm = std::sqrt(std::max(0.0, squares_mm2 - n * mean_mm * mean_mm) / std::max(n - 1, 1.0));
    std::printf("%.2f | %.2f +- %.2f | %.2f | %.2f | %.1f | %.1f | %.2f | %.2f |", at(0.5), mean_mm, sd_mm, at(0.95),
                miss_mm.back(), 100 * n / static_cast<double>(all.size()),
                turned_rad / (2 * std::numbers::pi) / inserted_mm * 100, inserted_mm / duration_s, error_mm / n);
  }
  for (auto o = arrived_end; o != all.end(); ++o) std::printf(" %s;", o->why_not.c_str());
  std::printf("\n");
  std::fflush(stdout);
  return missing;
}

// Those of these names; none, and what is said of it, where one cannot be taken over.
std::vector<rig::Scenario> taken_over(const std::vector<std::string>& names) {
  std::vector<rig::Scenario> taken;
  const auto& all = rig::scenarios();
  for (const std::string& name : names) {
    const auto scenario = std::ranges::find(all, name, &rig::Scenario::name);
    if (scenario != all.end() && rig::is_of_needle_alone(*scenario)) {
      taken.push_back(*scenario);
      continue;
    }
    std::cerr << "scenario '" << name << "' "
              << (scenario == all.end() ? "is none" : "has more to it than a needle, which would be left out")
              << "; allowed: ";
    const char* separator = "";
    for (const rig::Scenario& one : all)
      if (rig::is_of_needle_alone(one)) std::cerr << std::exchange(separator, ", ") << one.name;
    std::cerr << "\n";
    return {};
  }
  return taken;
}

int run(int targets, const std::vector<rig::Scenario>& scenarios) {
  cv::setNumThreads(1);
  std::printf(
      "seed %llu; mm, of those that arrived\n\n| scenario | targets | median | mean +- sd | 95 %% | worst | "
      "arrived, %% | turns per 100 mm | feed, mm/s | estimate to tip |\n| --- | --- | --- | --- | --- | --- | "
      "--- | --- | --- | --- |\n",
      static_cast<unsigned long long>(kSeed));
  const std::clock_t from = std::clock();
  std::vector<Outcome> everything;
  int missing = 0;
  for (const rig::Scenario& scenario : scenarios) {
    std::vector<Outcome> outcomes(static_cast<std::size_t>(targets));
    parallel_for(outcomes.size(), 2, [&](std::size_t i) { outcomes[i] = one(scenario, 1'000'003 * kSeed + i); });
    missing += print(scenario.name, outcomes);
    std::ranges::copy(outcomes, std::back_inserter(everything));
  }
  print("all of them", everything);
  int frames = 0;
  for (const Outcome& o : everything) frames += o.frames;
  std::printf("\n%d pictures, %.0f s of processor time\n", frames,
              static_cast<double>(std::clock() - from) / CLOCKS_PER_SEC);
  return missing == 0 ? 0 : 1;
}

}  // namespace
}  // namespace bevel

int main(int argc, char** argv) {
  const int targets = argc > 1 ? std::atoi(argv[1]) : 10;
  std::vector<std::string> names(argv + std::min(argc, 2), argv + argc);
  if (names.empty()) names = {"kinematic", "kinematic-30", "beam-100-1", "beam-50-1", "beam-20-0.5"};
  if (targets < 1) return 2;
  const auto scenarios = bevel::taken_over(names);
  return scenarios.empty() ? 2 : bevel::run(targets, scenarios);
}
