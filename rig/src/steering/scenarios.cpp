// SPDX-License-Identifier: MIT
#include <bevel/rig/steering/scenarios.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <type_traits>

namespace bevel::rig {
namespace {

constexpr double kNoise_mm = 0.2;
constexpr double kShareOfReach = 0.6;
constexpr double kWidest_mm = 30;
constexpr double kDegree_rad = std::numbers::pi / 180;
constexpr double kToldWindup_rad = 0.4;  // standard deviation of a wind-up that the filter estimates

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  double normal() { return std::normal_distribution<double>(0, 1)(random_); }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }

 private:
  std::mt19937_64 random_;
};

Cameras cameras(int count) {
  Cameras out;
  for (int camera = 0; camera < count; ++camera) {
    out.axes.push_back({camera, camera == 0 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX(), kNoise_mm});
    out.axes.push_back({camera, Eigen::Vector3d::UnitZ(), kNoise_mm});
  }
  return out;
}

Eigen::Vector3d draw_target(Draw& draw, double curvature_per_mm) {
  const double depth_mm = draw.uniform(80, 120);
  const double reach_mm = std::min(0.5 * curvature_per_mm * depth_mm * depth_mm, kWidest_mm / kShareOfReach);
  const double aside_mm = kShareOfReach * reach_mm * std::sqrt(draw.uniform(0, 1));
  const double angle = draw.uniform(0, 2 * std::numbers::pi);
  return {aside_mm * std::cos(angle), aside_mm * std::sin(angle), depth_mm};
}

model::NeedleParameters agar() {
  model::NeedleParameters needle;
  needle.lambda1_per_rad = 0.49;
  needle.lambda2 = 0.22;
  return needle;
}

// A sphere or a capsule beside the straight line to the target, or across it; a quarter of the way at least from either
// end.
controller::Obstacle draw_obstacle(Draw& draw, const Eigen::Vector3d& target_mm) {
  constexpr double kFarthest_mm = 8;  // from the line
  const auto across = [&draw](double length_mm) {
    const double angle = draw.uniform(0, 2 * std::numbers::pi);
    return Eigen::Vector3d(length_mm * std::cos(angle), length_mm * std::sin(angle), 0);
  };
  const Eigen::Vector3d centre_mm =
      draw.uniform(0.25, 0.75) * target_mm + across(kFarthest_mm * std::sqrt(draw.uniform(0, 1)));
  const Eigen::Vector3d half_mm = draw.uniform(0, 1) < 0.5 ? Eigen::Vector3d::Zero().eval() : across(15);
  return {centre_mm - half_mm, centre_mm + half_mm, draw.uniform(2, 5), 1.0};
}

// A way-point half way and a target beyond that the needle can go to one after the other: each at the end of an
// arc of half the needle's curvature, in a drawn direction, from where the one before it ends.
void draw_way(Draw& draw, const model::NeedleParameters& needle, Trial& trial) {
  model::Pose tip;
  for (Eigen::Vector3d* point_mm : {&trial.believed.way_points_mm.emplace_back(), &trial.target_mm}) {
    const double depth_mm = draw.uniform(40, 60);
    const double angle = draw.uniform(0, 2 * std::numbers::pi);
    model::Pose arc = tip;
    arc.R = tip.R * model::exp_so3({0, 0, angle});
    model::advance(arc, {depth_mm, 0, {0.5 * needle.curvature_per_mm, 0}}, model::slip_parameters(needle));
    *point_mm = arc.p_mm;
    tip = arc;
  }
}

// The same for one that is drawn back by 30 mm from the first of them.
void draw_before(Draw& draw, const model::NeedleParameters& needle, Trial& trial) {
  draw_way(draw, needle, trial);
  trial.believed.before = {trial.believed.way_points_mm.front(), 30};
  trial.believed.way_points_mm.clear();
}

struct Kinematic {
  double parameters_off = 0;  // uniform, relative, of k, lambda1, lambda2
  double roll_sd_rad = 0;
  int cameras = 2;
  double outlier_share = 0;
  double windup_at_100mm_rad = 0;
  bool windup_known = false;  // in the model file
  double drift_mm = 0;        // of the target in 20 s, in a drawn direction across
  double breathing_mm = 0;    // of the target, amplitude at 0.25 Hz along x, phase drawn
  bool gated = false;
  bool obstacle = false;
  bool way_point = false;
  bool retract = false;
  double camera_turned_rad = 0;     // of both, about a drawn axis across the needle
  double told_slope_sd_rad = 0;     // by how much insertions' entry slopes differ; 0: the default
  double camera_late_s = 0;         // of both
  estimator::NuisancePrior told{};  // states of the filter
  bool by_flips = false;
};
Trial kinematic(const Kinematic& kind, std::uint64_t seed) {
  Draw draw(seed);
  Trial trial;
  const model::NeedleParameters believed = agar();
  model::NeedleParameters truth = believed;
  truth.curvature_per_mm *= 1 + kind.parameters_off * draw.uniform(-1, 1);
  truth.lambda1_per_rad *= 1 + kind.parameters_off * draw.uniform(-1, 1);
  truth.lambda2 *= 1 + kind.parameters_off * draw.uniform(-1, 1);
  const double roll_rad = kind.roll_sd_rad * draw.normal();
  estimator::Prior& prior = trial.believed.estimator.prior;
  prior.needle = believed;
  trial.believed.estimator.through_channel = true;
  prior.curvature_sd_per_mm = std::max(prior.curvature_sd_per_mm, 0.3 * believed.curvature_per_mm);
  if (kind.roll_sd_rad > 0) prior.roll_sd_rad = kind.roll_sd_rad;
  std::vector<model::ActiveEffect> effects;
  if (kind.windup_at_100mm_rad > 0) {
    model::ActiveEffect windup{.effect = model::find_effect("torsional_windup"), .parameters = {}};
    windup.parameters[0] = kind.windup_at_100mm_rad;
    effects.push_back(windup);
    if (kind.windup_known) trial.believed.estimator.effects = trial.believed.undone = effects;
  }
  if (kind.camera_late_s > 0) {
    model::ActiveEffect latency{.effect = model::find_effect("camera_latency"), .parameters = {}};
    latency.parameters[0] = kind.camera_late_s;
    effects.push_back(latency);
  }
  trial.target_mm = draw_target(draw, std::min(truth.curvature_per_mm, believed.curvature_per_mm));
  const double angle = draw.uniform(0, 2 * std::numbers::pi);
  const Eigen::Vector3d target = trial.target_mm;
  if (kind.drift_mm > 0)
    trial.rig.target_mm = [=](double time_s) -> Eigen::Vector3d {
      return target + kind.drift_mm * time_s / 20 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    };
  if (kind.breathing_mm > 0)
    trial.rig.target_mm = [=](double time_s) -> Eigen::Vector3d {
      return target +
             kind.breathing_mm * std::sin(2 * std::numbers::pi * 0.25 * time_s + angle) * Eigen::Vector3d::UnitX();
    };
  if (kind.obstacle) trial.believed.controller.obstacles = {draw_obstacle(draw, target)};
  if (kind.way_point) draw_way(draw, believed, trial);
  if (kind.retract) draw_before(draw, believed, trial);
  trial.believed.controller.follow.gate_breathing = kind.gated;
  trial.rig.cameras = cameras(kind.cameras);
  trial.rig.cameras.outlier_share = kind.outlier_share;
  trial.rig.cameras.turned_rad = kind.camera_turned_rad * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
  trial.believed.estimator.nuisance = kind.told;
  if (kind.told_slope_sd_rad > 0) trial.believed.estimator.entry_slope_sd_rad = kind.told_slope_sd_rad;
  trial.needle = {.bicycle = truth, .effects = effects, .roll_rad = roll_rad};
  trial.rig.make_plant = [needle = trial.needle] {
    return std::make_unique<rig::KinematicPlant>(needle.bicycle, needle.effects, needle.roll_rad, model::OwnValues{},
                                                 rig::Cut::kept);
  };
  return trial;
}

struct Beam {
  double modulus_kPa = 0, force_N = 0;  // 0: drawn, 2 to 100 kPa, 0.2 to 1 N
  double windup_at_100mm_rad = 0;
  double told_windup_rad = 0;  // standard deviation; 0: not a state of the filter
  double relaxing_fraction = 0;
  bool obstacle = false;
  bool way_point = false;
  bool retract = false;
  bool layered = false;  // a second layer begins 30 to 60 mm deep; its modulus and force are drawn
  static constexpr bool by_flips = false, gated = false;
};
// The software is told a curvature and a bending length, each off by up to 30 %, and a bicycle's slip of none.
Trial beam(const Beam& kind, std::uint64_t seed) {
  Draw draw(seed);
  Trial trial;
  model::BeamPlantConfig config;
  config.foundation_modulus_kPa = kind.modulus_kPa > 0 ? kind.modulus_kPa : draw.log_uniform(2, 100);
  config.bevel_force_N = kind.force_N > 0 ? kind.force_N : draw.uniform(0.2, 1);
  config.windup_at_100mm_rad = kind.windup_at_100mm_rad;
  config.relaxing_fraction = kind.relaxing_fraction;
  config.relaxation_time_s = 3;
  config.max_depth_mm = 150;
  if (kind.layered) {
    config.layer_from_mm = draw.uniform(30, 60);
    config.layer_modulus_kPa = draw.log_uniform(2, 100);
    config.layer_force_N = draw.uniform(0.2, 1);
  }
  const model::NeedleParameters deep = rig::bicycle_of(config);
  const double bending_mm = std::pow(4 * config.bending_stiffness_N_mm2 / (1e-3 * config.foundation_modulus_kPa), 0.25);
  estimator::Prior& prior = trial.believed.estimator.prior;
  prior.needle = deep;
  trial.believed.estimator.through_channel = true;
  prior.needle.curvature_per_mm *= draw.uniform(0.7, 1.3);
  prior.curvature_sd_per_mm = 0.2 * prior.needle.curvature_per_mm;
  prior.lambda1_sd_per_rad = prior.lambda2_sd = 0;
  prior.bending_mm = bending_mm * draw.uniform(0.7, 1.3);
  prior.bending_sd_mm = 0.2 * prior.bending_mm;
  prior.guide_mm = config.guide_gap_mm;
  trial.believed.estimator.nuisance.windup_sd_rad = kind.told_windup_rad;
  trial.believed.controller.shaft = {prior.bending_mm, prior.guide_mm};
  trial.target_mm = draw_target(draw, deep.curvature_per_mm);
  if (kind.obstacle) trial.believed.controller.obstacles = {draw_obstacle(draw, trial.target_mm)};
  if (kind.way_point) draw_way(draw, deep, trial);
  if (kind.retract) draw_before(draw, deep, trial);
  trial.rig.cameras = cameras(2);
  trial.needle = {.bicycle = deep, .beam = config};
  trial.rig.make_plant = [config] { return std::make_unique<rig::BeamNeedle>(config); };
  return trial;
}

// As shipped: what a system file leaves out is by default, and its [needle] has k deep in this tissue, off by up to 30
// %.
struct Shipped {
  double modulus_kPa = 0, force_N = 0;  // 0: the filter's own model
  static constexpr bool obstacle = false, way_point = false, retract = false, by_flips = false, gated = false;
};
Trial shipped(const Shipped& kind, std::uint64_t seed) {
  Draw draw(seed);
  Trial trial;
  model::NeedleParameters truth = agar();
  if (kind.modulus_kPa > 0) {
    model::BeamPlantConfig config;
    config.foundation_modulus_kPa = kind.modulus_kPa;
    config.bevel_force_N = kind.force_N;
    config.max_depth_mm = 150;
    truth = rig::bicycle_of(config);
    trial.needle = {.bicycle = truth, .beam = config};
    trial.rig.make_plant = [config] { return std::make_unique<rig::BeamNeedle>(config); };
  } else {
    trial.needle = {.bicycle = truth};
    trial.rig.make_plant = [truth] {
      return std::make_unique<rig::KinematicPlant>(truth, std::vector<model::ActiveEffect>{}, 0, model::OwnValues{},
                                                   rig::Cut::kept);
    };
  }
  estimator::Prior& prior = trial.believed.estimator.prior;
  prior.needle = agar();
  prior.needle.curvature_per_mm = truth.curvature_per_mm * draw.uniform(0.7, 1.3);
  assume_unknown_shaft(prior);
  trial.believed.estimator.through_channel = true;
  trial.believed.controller.shaft = {prior.bending_mm, prior.guide_mm};
  trial.target_mm = draw_target(draw, std::min(truth.curvature_per_mm, prior.needle.curvature_per_mm));
  trial.rig.cameras = cameras(2);
  return trial;
}

enum class Row { table, floor, apart };  // of the table; with what the true tip would bring; by its name alone
template <class Kind>
Scenario scenario(Row row, const char* name, const char* what, const Kind& kind,
                  Trial (*draw)(const Kind&, std::uint64_t)) {
  Scenario out{name, what, [=](std::uint64_t seed) { return draw(kind, seed); }};
  out.along_path = kind.obstacle || kind.way_point;
  out.goes_back = kind.retract;
  out.gated = kind.gated;
  out.in_table = row != Row::apart;
  out.with_floor = row == Row::floor || std::is_same_v<Kind, Beam>;
  out.by_flips = kind.by_flips;
  return out;
}

}  // namespace

bool is_of_needle_alone(const Scenario& scenario) {
  if (scenario.along_path || scenario.goes_back || scenario.gated || scenario.by_flips) return false;
  const Trial trial = scenario.draw(1);  // what differs from seed to seed is by how much
  const Cameras& eyes = trial.rig.cameras;
  return trial.needle.effects.empty() && !trial.rig.target_mm && eyes.axes.size() == cameras(2).axes.size() &&
         eyes.outlier_share == 0 && eyes.turned_rad.isZero();
}

const std::vector<Scenario>& scenarios() {
  static const std::vector<Scenario> all{
      scenario<Kinematic>(Row::table, "kinematic", "the filter's own model, parameters as told", {}, kinematic),
      scenario<Kinematic>(Row::table, "kinematic-30", "k, lambda1, lambda2 off by up to 30 %", {.parameters_off = 0.3},
                          kinematic),
      scenario<Beam>(Row::floor, "beam-100-0.3", "beam, 100 kPa, 0.3 N", {100, 0.3}, beam),
      scenario<Beam>(Row::floor, "beam-100-1", "beam, 100 kPa, 1 N", {100, 1}, beam),
      scenario<Beam>(Row::floor, "beam-50-1", "beam, 50 kPa, 1 N", {50, 1}, beam),
      scenario<Beam>(Row::floor, "beam-20-0.5", "beam, 20 kPa, 0.5 N", {20, 0.5}, beam),
      scenario<Beam>(Row::apart, "beam-any", "beam, 2 to 100 kPa, 0.2 to 1 N", {}, beam),
      scenario<Shipped>(Row::table, "default", "as shipped, the filter's own model, k off by up to 30 %", {}, shipped),
      scenario<Shipped>(Row::table, "default-50-1", "as shipped, beam, 50 kPa, 1 N, k off by up to 30 %", {50, 1},
                        shipped),
      scenario<Shipped>(Row::table, "default-20-0.5", "as shipped, beam, 20 kPa, 0.5 N, k off by up to 30 %", {20, 0.5},
                        shipped),
      scenario<Beam>(Row::table, "beam-layered",
                     "beam, two layers of 2 to 100 kPa and 0.2 to 1 N, the second from 30 to 60 mm on",
                     {.layered = true}, beam),
      scenario<Beam>(Row::apart, "beam-relaxing", "beam, 20 kPa, 0.5 N, of which 30 % relax in 3 s",
                     {.modulus_kPa = 20, .force_N = 0.5, .relaxing_fraction = 0.3}, beam),
      scenario<Beam>(Row::floor, "beam-windup", "beam, 100 kPa, 1 N, wind-up of 0.5 rad at 100 mm, unknown",
                     {.modulus_kPa = 100, .force_N = 1, .windup_at_100mm_rad = 0.5}, beam),
      scenario<Beam>(
          Row::apart, "beam-windup-state", "the same, wind-up as a state of the filter, 0 +- 0.4 rad beforehand",
          {.modulus_kPa = 100, .force_N = 1, .windup_at_100mm_rad = 0.5, .told_windup_rad = kToldWindup_rad}, beam),
      scenario<Kinematic>(Row::floor, "windup", "wind-up of 0.5 rad at 100 mm, unknown", {.windup_at_100mm_rad = 0.5},
                          kinematic),
      scenario<Kinematic>(Row::apart, "windup-state", "the same, as a state of the filter, 0 +- 0.4 rad beforehand",
                          {.windup_at_100mm_rad = 0.5, .told = {.windup_sd_rad = kToldWindup_rad}}, kinematic),
      scenario<Kinematic>(Row::apart, "windup-known", "the same, in the model file",
                          {.windup_at_100mm_rad = 0.5, .windup_known = true}, kinematic),
      scenario<Kinematic>(Row::table, "moving", "a target that moves by 5 mm in 20 s, told of at 17 Hz",
                          {.drift_mm = 5}, kinematic),
      scenario<Kinematic>(Row::floor, "breathing", "a target that breathes by +-3 mm at 0.25 Hz, told of at 17 Hz",
                          {.breathing_mm = 3}, kinematic),
      scenario<Kinematic>(Row::table, "breathing-gated", "the same, arriving where it turns round",
                          {.breathing_mm = 3, .gated = true}, kinematic),
      scenario<Kinematic>(Row::table, "roll", "the bevel's roll at the start off by 0.5 rad (standard deviation)",
                          {.roll_sd_rad = 0.5}, kinematic),
      scenario<Kinematic>(Row::floor, "one-camera", "one camera, along x", {.cameras = 1}, kinematic),
      scenario<Kinematic>(Row::floor, "one-camera-flips", "the same, by half turns at rest alone",
                          {.cameras = 1, .by_flips = true}, kinematic),
      scenario<Kinematic>(Row::table, "camera-turned",
                          "both cameras' frame turned by 2 degrees about an axis across the needle",
                          {.camera_turned_rad = 2 * kDegree_rad}, kinematic),
      scenario<Kinematic>(Row::apart, "camera-turned-good-guide",
                          "the same, told that insertions' own slopes differ by 0.2 degrees",
                          {.camera_turned_rad = 2 * kDegree_rad, .told_slope_sd_rad = 0.2 * kDegree_rad}, kinematic),
      scenario<Kinematic>(Row::apart, "good-guide",
                          "the frame as it should be, told that insertions' own slopes differ by 0.2 degrees",
                          {.told_slope_sd_rad = 0.2 * kDegree_rad}, kinematic),
      scenario<Kinematic>(Row::apart, "camera-turned-5", "both cameras' frame turned by 5 degrees",
                          {.camera_turned_rad = 5 * kDegree_rad}, kinematic),
      scenario<Kinematic>(Row::apart, "late", "both cameras' stamps late by 50 ms, unknown", {.camera_late_s = 0.05},
                          kinematic),
      scenario<Kinematic>(Row::apart, "late-state",
                          "the same, latencies as states of the filter, 0 +- 50 ms beforehand",
                          {.camera_late_s = 0.05, .told = {.latency_sd_s = 0.05}}, kinematic),
      scenario<Kinematic>(Row::apart, "windup-in-vain", "the model's needle, wind-up as a state, 0 +- 0.4 rad",
                          {.told = {.windup_sd_rad = kToldWindup_rad}}, kinematic),
      scenario<Kinematic>(Row::apart, "late-in-vain", "the model's needle, latencies as states, 0 +- 50 ms",
                          {.told = {.latency_sd_s = 0.05}}, kinematic),
      scenario<Beam>(Row::apart, "beam-any-windup-in-vain",
                     "beam, 2 to 100 kPa, 0.2 to 1 N, wind-up as a state, 0 +- 0.4 rad",
                     {.told_windup_rad = kToldWindup_rad}, beam),
      scenario<Kinematic>(Row::table, "obstacle",
                          "a sphere or capsule of 2 to 5 mm radius within 8 mm of the line to the target",
                          {.obstacle = true}, kinematic),
      scenario<Beam>(Row::apart, "obstacle-beam", "the same, beam, 50 kPa, 1 N",
                     {.modulus_kPa = 50, .force_N = 1, .obstacle = true}, beam),
      scenario<Kinematic>(
          Row::apart, "way-point",
          "a way-point of 1 mm tolerance half way, which it reaches by one arc and the target by another",
          {.way_point = true}, kinematic),
      scenario<Beam>(Row::apart, "way-point-beam", "the same, beam, 50 kPa, 1 N",
                     {.modulus_kPa = 50, .force_N = 1, .way_point = true}, beam),
      scenario<Kinematic>(Row::apart, "retract",
                          "at a target 40 to 60 mm deep drawn back by 30 mm, then to another 40 to 60 mm on",
                          {.retract = true}, kinematic),
      scenario<Kinematic>(Row::apart, "retract-30", "the same, k, lambda1, lambda2 off by up to 30 %",
                          {.parameters_off = 0.3, .retract = true}, kinematic),
      scenario<Beam>(Row::apart, "retract-beam", "the same, beam, 50 kPa, 1 N",
                     {.modulus_kPa = 50, .force_N = 1, .retract = true}, beam),
      scenario<Kinematic>(Row::table, "outliers", "a tenth of the messages off by 3 to 10 mm", {.outlier_share = 0.1},
                          kinematic),
  };
  return all;
}

}  // namespace bevel::rig
