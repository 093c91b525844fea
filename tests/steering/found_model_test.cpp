// SPDX-License-Identifier: MIT
// Invariant 8 of a verdict: a rig that is the found model is not steered worse by it than by the nominal model.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include <bevel/analysis/steering/model_rig.hpp>
#include <bevel/controller/reason.hpp>
#include <bevel/diagnosis/parallel.hpp>

namespace bevel::rig {

using namespace analysis;  // NOLINT(google-build-using-namespace): rigs and figures of a model file

namespace {

constexpr std::uint64_t kSeed = 20'261'129;
constexpr int kTargets = 24;
// Paired standard errors by which a model may steer worse by chance: one of 740 comparisons, of 24 here.
constexpr double kDeviations = 3;

model::NeedleParameters needle() {
  model::NeedleParameters n;
  n.curvature_per_mm = 0.0056, n.wheelbase_mm = 26, n.lambda1_per_rad = 0.27, n.lambda2 = 0.16;
  return n;
}

// Two cameras, 0.2 mm of white noise on each axis.
Cameras cameras() {
  const double sd_mm = 0.2;
  return {.axes = {{0, Eigen::Vector3d::UnitY(), sd_mm},
                   {0, Eigen::Vector3d::UnitZ(), sd_mm},
                   {1, Eigen::Vector3d::UnitX(), sd_mm},
                   {1, Eigen::Vector3d::UnitZ(), sd_mm}}};
}

// 70 to 85 mm deep: a whole number of jumps of any length lies between them.
std::vector<Eigen::Vector3d> draw_targets() {
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Eigen::Vector3d> all;
  for (int i = 0; i < kTargets; ++i) {
    const double z_mm = std::lerp(70.0, 85.0, share(random));
    const double aside_mm = kShareOfFarthestAside * farthest_aside_mm(needle(), z_mm) * std::sqrt(share(random));
    const double angle_rad = 2 * std::numbers::pi * share(random);
    all.emplace_back(aside_mm * std::cos(angle_rad), aside_mm * std::sin(angle_rad), z_mm);
  }
  return all;
}

std::vector<Insertion> steer_all(const io::ModelFile& rig_model, const io::ModelFile& believed_model) {
  const auto targets_mm = draw_targets();
  const Believed believed = believed_of(believed_model);
  const double duration_s = 85 / controller::SteeringLimits{}.insertion_rate_mm_s;
  std::vector<Insertion> all(targets_mm.size());
  parallel_for(targets_mm.size(), 2, [&](std::size_t i) {
    const SteeredRig rig{.make_plant =
                             [&] {
                               return std::make_unique<rig::KinematicPlant>(
                                   rig_model.needle, for_one_insertion(rig_model, duration_s, kSeed + i));
                             },
                         .cameras = cameras()};
    all[i] = steer(rig, believed, targets_mm[i], kSeed + i);
  });
  return all;
}

struct Paired {
  int nominal_arrived = 0, found_arrived = 0, pairs = 0;
  double nominal_mm = 0, found_mm = 0, worse_mm = 0, std_error_mm = 0;  // means over the pairs
};

Paired compare(const std::vector<Insertion>& nominal, const std::vector<Insertion>& found) {
  Paired out;
  std::vector<double> worse_mm;
  for (std::size_t i = 0; i < found.size(); ++i) {
    out.nominal_arrived += nominal[i].at_depth, out.found_arrived += found[i].at_depth;
    if (!nominal[i].at_depth || !found[i].at_depth) continue;
    worse_mm.push_back(found[i].miss_mm - nominal[i].miss_mm);
    out.nominal_mm += nominal[i].miss_mm, out.found_mm += found[i].miss_mm;
  }
  out.pairs = static_cast<int>(worse_mm.size());
  if (out.pairs < 2) return out;
  const double n = out.pairs;
  out.nominal_mm /= n, out.found_mm /= n;
  for (const double w : worse_mm) out.worse_mm += w / n;
  for (const double w : worse_mm) out.std_error_mm += (w - out.worse_mm) * (w - out.worse_mm) / (n * (n - 1));
  out.std_error_mm = std::sqrt(out.std_error_mm);
  return out;
}

TEST(FoundModel, SteersNoWorseThanTheNominalModelOnTheRigThatItIs) {
  const std::vector<io::EffectEntry> effects{
      {"stick_slip", {{"jump_mm", 0.87}}},
      {"stick_slip", {{"jump_mm", 0.5}}},
      {"puncture", {{"depth_mm", 50}, {"indentation_mm", 3}}},
      {"puncture", {{"depth_mm", 75}, {"indentation_mm", 1.5}}},
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
      {"refraction", {{"coefficient", 0.02}, {"centre_mm", 40}}},
  };
  std::printf("seed %ju, %d targets; arrived and mean miss: nominal model -> found model\n",
              static_cast<std::uintmax_t>(kSeed), kTargets);
  for (const io::EffectEntry& effect : effects) {
    const io::ModelFile found{needle(), {effect}}, nominal{needle(), {}};
    const auto by_found = steer_all(found, found);
    const Paired p = compare(steer_all(found, nominal), by_found);
    std::printf("%-18s %2d -> %2d; %.3f -> %.3f mm, worse by %.3f +- %.3f mm over %d pairs\n", effect.name.c_str(),
                p.nominal_arrived, p.found_arrived, p.nominal_mm, p.found_mm, p.worse_mm, p.std_error_mm, p.pairs);
    for (const Insertion& one : by_found)
      if (one.stopped)
        std::printf("    stopped: %s, %.3g, limit %.3g %s, at %.1f mm\n", one.stopped->reason.c_str(),
                    one.stopped->value, one.stopped->limit, one.stopped->unit.c_str(), one.stopped->depth_mm);
    EXPECT_GE(p.found_arrived, p.nominal_arrived) << effect.name;
    EXPECT_LE(p.worse_mm, kDeviations * p.std_error_mm) << effect.name;
  }
}

// A tip that jumps by 0.87 mm rests at most half of that from its target. It was stopped behind the target: 0.39 mm.
TEST(FoundModel, BringsATipThatJumpsToTheRestNearestToTheTarget) {
  constexpr double kJump_mm = 0.87, kLateral_mm = 0.15;
  const io::ModelFile found{needle(), {{"stick_slip", {{"jump_mm", kJump_mm}}}}};
  for (const Insertion& one : steer_all(found, found)) {
    EXPECT_TRUE(one.at_depth);
    EXPECT_LT(one.miss_mm, 0.5 * kJump_mm + kLateral_mm);
  }
}

// Closed form for a circle of curvature k: 1/k - sqrt(1/k^2 - d^2) to the side at the depth d, and 1/k where it turns
// back.
TEST(ModelRig, ANeedleThatTurnsBackIsFarthestAsideThere) {
  model::NeedleParameters bicycle;
  bicycle.curvature_per_mm = 0.0159, bicycle.wheelbase_mm = 20, bicycle.lambda1_per_rad = 0, bicycle.lambda2 = 0;
  const double radius_mm = 1 / bicycle.curvature_per_mm;
  constexpr double kStep_mm = 1;
  EXPECT_NEAR(farthest_aside_mm(bicycle, 40), radius_mm - std::sqrt(radius_mm * radius_mm - 40 * 40), kStep_mm);
  EXPECT_NEAR(farthest_aside_mm(bicycle, 98), radius_mm, kStep_mm);
}

TEST(SteeredInsertion, AnInsertionThatAnUnhealthyEstimateEndsHasQuantityValueLimitAndDepth) {
  const io::ModelFile rig_model{needle(), {{"insertion_scale", {{"ratio", 0.92}}}}};
  for (const Insertion& one : steer_all(rig_model, {needle(), {}})) {
    ASSERT_FALSE(one.at_depth);
    ASSERT_TRUE(one.stopped);
    EXPECT_EQ(one.stopped->reason, "needle state unhealthy, measurements rejected in a row");
    EXPECT_GT(one.stopped->value, one.stopped->limit);
    EXPECT_EQ(one.stopped->limit, estimator::Gate{}.rejects_before_unhealthy - 1);
    EXPECT_GT(one.stopped->depth_mm, 5);
    EXPECT_LT(one.stopped->depth_mm, 85);
  }
}

}  // namespace
}  // namespace bevel::rig
