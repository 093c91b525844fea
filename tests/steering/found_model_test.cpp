// Invariant 8 of a verdict: a rig that is the found model is not steered worse by it than by the nominal model.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <cstdlib>
#include <numbers>
#include <random>

#include "controller/reason.hpp"
#include "diagnosis/parallel.hpp"
#include "io/live_effects.hpp"
#include "rig/plant/plant.hpp"
#include "tools/steering/model_rig.hpp"

namespace bevel::steering {
namespace {

constexpr std::uint64_t kSeed = 20'261'129;

model::NeedleParameters needle() {
  model::NeedleParameters n;
  n.curvature_per_mm = 0.0056, n.wheelbase_mm = 26, n.lambda1_per_rad = 0.27, n.lambda2 = 0.16;
  return n;
}

Cameras cameras() {
  const double sd_mm = 0.2;
  return {.axes = {{0, Eigen::Vector3d::UnitY(), sd_mm},
                   {0, Eigen::Vector3d::UnitZ(), sd_mm},
                   {1, Eigen::Vector3d::UnitX(), sd_mm},
                   {1, Eigen::Vector3d::UnitZ(), sd_mm}}};
}

std::vector<Eigen::Vector3d> targets_mm(int count) {
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Eigen::Vector3d> all;
  while (std::ssize(all) < count) {
    const double z_mm = std::lerp(70.0, 85.0, share(random));
    const double aside_mm = kShareOfFarthestAside * farthest_aside_mm(needle(), z_mm) * std::sqrt(share(random));
    const double angle_rad = 2 * std::numbers::pi * share(random);
    all.emplace_back(aside_mm * std::cos(angle_rad), aside_mm * std::sin(angle_rad), z_mm);
  }
  return all;
}

struct Paired {
  int nominal_there = 0, found_there = 0, pairs = 0;
  double nominal_mm = 0, found_mm = 0;   // mean miss over the pairs
  double worse_mm = 0, std_error_mm = 0;  // found less nominal
  double nominal_error_mm = 0, found_error_mm = 0;
  std::map<std::string,int> reasons;
};

Paired compare(const io::EffectEntry& effect, int count, const std::string& ablation = "") {
  const io::ModelFile found{needle(), {effect}}, nominal{needle(), {}};
  std::array<Believed, 2> believed{believed_of(nominal), believed_of(found)};
  if (ablation == "estimator only") believed[1].undone.clear();
  if (ablation == "controller only") believed[1].estimator.effects.clear();
  const auto targets = targets_mm(count);
  std::array<std::vector<Insertion>, 2> all;
  for (auto& one : all) one.resize(targets.size());
  parallel_for(2 * targets.size(), 2, [&](std::size_t job) {
    const std::size_t b = job % 2, i = job / 2;
    const SteeredRig rig{.make_plant =
                             [&] {
                               return std::make_unique<rig::KinematicPlant>(
                                   found.needle, for_one_insertion(found, 17, kSeed + i));
                             },
                         .cameras = cameras()};
    all[b][i] = steer(rig, believed[b], targets[i], kSeed + i, ablation == "told");
  });
  Paired out;
  std::vector<double> worse_mm;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const Insertion &n = all[0][i], &f = all[1][i];
    out.nominal_there += n.at_depth, out.found_there += f.at_depth;
    if (!n.at_depth) ++out.reasons[std::string("nominal: ")+controller::to_string(n.reason)];
    if (!f.at_depth) ++out.reasons[std::string("found: ")+controller::to_string(f.reason)];
    if (!n.at_depth || !f.at_depth) continue;
    worse_mm.push_back(f.miss_mm - n.miss_mm);
    out.nominal_mm += n.miss_mm, out.found_mm += f.miss_mm;
    out.nominal_error_mm += n.estimate_error_mm, out.found_error_mm += f.estimate_error_mm;
  }
  const auto n = static_cast<double>(worse_mm.size());
  out.pairs = static_cast<int>(worse_mm.size());
  out.nominal_mm /= n, out.found_mm /= n, out.nominal_error_mm /= n, out.found_error_mm /= n;
  for (const double w : worse_mm) out.worse_mm += w / n;
  double squares = 0;
  for (const double w : worse_mm) squares += (w - out.worse_mm) * (w - out.worse_mm);
  out.std_error_mm = std::sqrt(squares / (n - 1) / n);
  return out;
}

TEST(FoundModel, SteersNoWorseThanTheNominalModelOnTheRigThatItIs) {
  const char* named = std::getenv("N");
  const int count = named ? std::atoi(named) : 24;
  const char* ablation = std::getenv("ABLATION");
  const char* only = std::getenv("ONLY");
  for (const io::EffectEntry& effect : std::vector<io::EffectEntry>{
           {"stick_slip", {{"jump_mm", 0.87}}},
           {"stick_slip", {{"jump_mm", 2}}},
           {"puncture", {{"depth_mm", 50}, {"indentation_mm", 3}}},
           {"insertion_scale", {{"ratio", 0.92}}},
           {"rotation_backlash", {{"width_rad", 0.4}}},
           {"torsional_windup", {{"lag_at_100mm_rad", 0.6}}},
           {"insertion_backlash", {{"width_mm", 1.0}}},
           {"rate_dependence", {{"exponent", 0.2}}},
           {"layer", {{"depth_mm", 40}, {"curvature_ratio", 0.7}}},
           {"depth_dependence", {{"per_100mm", 0.5}}},
           {"drilling", {{"coefficient_mm_per_rad", 1.5}}},
           {"flip_transient", {{"length_mm", 8}}},
           {"relaxation", {{"amplitude_mm", 1}, {"tau_s", 5}}},
           {"lateral_bias", {{"x_per_mm", 0.001}, {"y_per_mm", 0.0005}}},
           {"slip_direction", {}},
           {"cutting_angle", {{"angle_rad", 0.04}}},
           {"tip_swing", {{"radius_mm", 0.7}, {"relax_mm", 6}}},
           {"bevel_offset", {{"roll_rad", 0.3}}},
           {"entry_angle", {{"about_x_rad", 0.04}, {"about_y_rad", -0.03}}},
           {"entry_point", {{"x_mm", 0.8}, {"y_mm", -0.6}}},
           {"camera_latency", {{"latency_s", 0.1}}},
           {"camera_scale", {{"ratio", 1.03}}},
           {"camera_rotation", {{"about_x_rad", 0.03}}},
           {"refraction", {{"coefficient", 0.02}, {"centre_mm", 40}}},
       }) {
    if (only && effect.name != only) continue;
    const Paired p = compare(effect, count, ablation ? ablation : "");
    std::printf("%-20s there %d %d of %d; miss %.3f -> %.3f mm, worse by %.3f +- %.3f (z %.1f); estimate error %.3f -> %.3f",
                effect.name.c_str(), p.nominal_there, p.found_there, count, p.nominal_mm, p.found_mm, p.worse_mm,
                p.std_error_mm, p.worse_mm / p.std_error_mm, p.nominal_error_mm, p.found_error_mm);
    for (auto& [r, c] : p.reasons) std::printf("; %d %s", c, r.c_str());
    std::printf("\n");
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace bevel::steering
