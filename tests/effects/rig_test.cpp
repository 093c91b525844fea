// SPDX-License-Identifier: MIT
// The simulated rig with the effects of a model file: its plant, its pictures, its configuration.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include <bevel/drivers/camera/frame_source.hpp>
#include <bevel/drivers/can/memory_bus.hpp>
#include <bevel/error.hpp>
#include <bevel/nodes/rig_node.hpp>
#include "tests/effects/script.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::model::testing {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using ::testing::HasSubstr;

// All that act between base and tip, two by two.
std::vector<std::vector<ActiveEffect>> all_pairs_of_interest() {
  return {{},
          {active("rotation_backlash", {0.37}), active("flip_transient", {6})},
          {active("torsional_windup", {0.8}), active("drilling", {1.7})},
          {active("insertion_backlash", {1.1}), active("layer", {30, 0.7})},
          {active("insertion_scale", {0.93}), active("lateral_bias", {7e-4, -1e-3})},
          {active("puncture", {21.7, 2.3}), active("depth_dependence", {0.5})},
          {active("lost_steps", {0.8, 0, 3.3}), active("rate_dependence", {0.2})},
          {active("entry_angle", {0.05, -0.03}), active("slip_direction", {})},
          {active("bevel_offset", {0.3}), active("relaxation", {1.1, 2.2, 5})},
          {active("tissue_motion", {1.2, 0.27, 0.9, 2.0})}};
}

TEST(PlantWithEffects, IsTheModelAlongTheSameMotion) {
  const Motion motion = rich_script().fine();
  for (const auto& effects : all_pairs_of_interest()) {
    const auto path = path_of(agar(), effects, motion);
    rig::KinematicPlant plant(agar(), effects);
    std::size_t reading = 1;
    for (std::size_t i = 1; i < motion.nodes.size(); ++i) {
      const BaseMotion &a = motion.nodes[i - 1], &b = motion.nodes[i];
      plant.advance(b.insertion_mm - a.insertion_mm, b.rotation_rad - a.rotation_rad, b.time_s - a.time_s);
      if (reading == path.size() || motion.at[reading] != i) continue;
      ASSERT_LT((plant.tip().p_mm - path[reading]).norm(), 1e-8) << b.time_s;
      ++reading;
    }
    EXPECT_EQ(reading, path.size());
    const std::vector<Vector3d> shaft_mm = plant.shaft_mm();
    EXPECT_EQ(shaft_mm.back(), plant.tip().p_mm);
    for (std::size_t i = 1; i < shaft_mm.size(); ++i)  // no kinks where an offset begins
      EXPECT_LT((shaft_mm[i] - shaft_mm[i - 1]).norm(), 2.6);
  }
}

TEST(PlantWithEffects, RollErrorIsNotTakenUpByAGap) {
  rig::KinematicPlant plant(bicycle(), {active("rotation_backlash", {0.4})}, 0.1);
  plant.advance(50, 0, 5);
  EXPECT_NEAR(std::atan2(plant.tip().p_mm.x(), -plant.tip().p_mm.y()), 0.1, 1e-9);
}

TEST(PlantWithEffects, CameraAlongXSeesItsOwnPicture) {
  rig::KinematicPlant plant(agar(), {active("camera_scale", {1.05})});
  for (int i = 0; i < 600; ++i) plant.advance(0.1, 0, 0.01);
  const auto seen = rig::shaft_seen_along_x(plant);
  ASSERT_EQ(seen.size(), plant.shaft_mm().size());
  for (std::size_t i = 0; i < seen.size(); ++i)
    EXPECT_LT((seen[i] - plant.shaft_mm()[i].cwiseProduct(Vector3d(1, 1.05, 1.05))).norm(), 1e-12);
}

TEST(PlantWithADiscrepancy, IsTheModelAlongTheSameMotion) {
  const Motion motion = rich_script().fine();
  for (const auto& info : discrepancy_components()) {
    if (info.component >= DiscrepancyComponent::x) continue;  // the plant shows those too, but has no reading at rest
    const auto curve =
        active_discrepancy({info.component, Covariate::depth_mm, {0, 40}, {0, 0.02 * info.largest}, {0, 0}});
    const auto path = path_of(agar(), {curve}, motion);
    rig::KinematicPlant plant(agar(), {curve});
    for (std::size_t i = 1; i < motion.nodes.size(); ++i) {
      const BaseMotion &a = motion.nodes[i - 1], &b = motion.nodes[i];
      plant.advance(b.insertion_mm - a.insertion_mm, b.rotation_rad - a.rotation_rad, b.time_s - a.time_s);
    }
    EXPECT_LT((plant.tip().p_mm - path.back()).norm(), 0.05) << info.name;  // the last reading is 50 ms or less before
  }
}

TEST(PlantOfOneInsertion, EntersWhereAndAsItsOwnValuesSay) {
  const OwnValues own{.curvature_relative = 0.2,
                      .tilt_x_rad = 0.02,
                      .tilt_y_rad = -0.01,
                      .roll_rad = 0.3,
                      .entry_x_mm = 0.5,
                      .entry_y_mm = -0.4};
  rig::KinematicPlant plant(bicycle(), {}, 0, own);
  EXPECT_EQ(plant.tip().p_mm, Vector3d(0.5, -0.4, 0));
  EXPECT_LT((plant.tip().R.col(2) - exp_so3({0.02, -0.01, 0}).col(2)).norm(), 1e-12);
  plant.advance(60, 0, 6);
  // An arc of the bicycle's, 1.2 times as sharp, in the plane to which the bevel was turned.
  const double k = 1.2 * bicycle().curvature_per_mm;
  const Vector3d arc(0, -(1 - std::cos(60 * k)) / k, std::sin(60 * k) / k);
  const Vector3d expected = Vector3d(0.5, -0.4, 0) + exp_so3({0.02, -0.01, 0}) * (exp_so3({0, 0, 0.3}) * arc);
  EXPECT_LT((plant.tip().p_mm - expected).norm(), 1e-9);
}

TEST(RigWithVariation, DrawsTheInsertionsOwnValuesBySeed) {
  nodes::SystemConfig config;
  config.rig.variation = {.curvature_relative = 0.1, .entry_angle_rad = 0.01, .entry_point_mm = 0.3, .roll_rad = 0.1};
  lcm::LCM lcm("memq://");
  const auto entry_of = [&](std::int64_t seed) {
    config.rig.seed = seed;
    can::MemoryNetwork network;
    const auto insertion = network.attach(), rotation = network.attach();
    const nodes::RigNode rig(lcm, *insertion, *rotation, config, nullptr);
    EXPECT_EQ(rig.own_values().entry_x_mm, draw(config.rig.variation, static_cast<std::uint64_t>(seed)).entry_x_mm);
    EXPECT_EQ(rig.plant().tip().p_mm.x(), rig.own_values().entry_x_mm);
    return rig.plant().tip().p_mm;
  };
  EXPECT_EQ(entry_of(3), entry_of(3));
  EXPECT_NE(entry_of(3), entry_of(4));
}

TEST(RigWithEffects, FramesOfALateCameraComeLateAndAreStampedThen) {
  nodes::SystemConfig config;
  config.cameras.resize(1);
  config.cameras[0].view.origin_px = {240, 40};
  config.rig.effects = {{.name = "camera_latency", .parameters = {{"latency_s", 0.1}}}};
  const test::TemporaryFolder folder;
  const std::string socket = (folder / "frames").string();
  rig::FrameServer frames(socket);
  const auto source = camera::make_frame_source({.kind = camera::SourceKind::stream, .path = socket});
  for (int i = 0; i < 5000 && frames.clients() < 1; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  lcm::LCM lcm("memq://");
  can::MemoryNetwork network;
  const auto insertion = network.attach(), rotation = network.attach();
  nodes::RigNode rig(lcm, *insertion, *rotation, config, &frames);
  const std::int64_t start = 1'700'000'000'000'000;
  using namespace std::chrono_literals;
  for (std::int64_t ms = 1; ms < 101; ++ms) rig.step({ms * 1'000'000, start + ms * 1000});
  EXPECT_TRUE(std::holds_alternative<camera::FrameTimeout>(source->next(20ms)));
  rig.step({101'000'000, start + 101'000});
  const auto got = source->next(5000ms);
  ASSERT_TRUE(std::holds_alternative<camera::Frame>(got));
  EXPECT_EQ(std::get<camera::Frame>(got).capture_utime, start + 101'000);  // taken at 1 ms
}

struct RigConfigFile : ::testing::Test {
  test::TemporaryFolder folder;
  nodes::RigConfig load(const std::string& rig) const {
    return nodes::load_system_config(folder.write("rig.toml", kNeedle + rig)).rig;
  }
  std::string fault_of(const std::string& rig) const {
    try {
      load(rig);
    } catch (const io::ConfigError& error) {
      return error.what();
    }
    return "";
  }
  static constexpr const char* kNeedle =
      "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n";
  static constexpr const char* kWindup = "name = \"torsional_windup\"\nlag_at_100mm_rad = 0.6\n";
};

TEST_F(RigConfigFile, TakesEffectsBesideItsNeedle) {
  const auto rig = load(std::string("[rig]\nseed = 3\n[[rig.effect]]\n") + kWindup);
  ASSERT_EQ(rig.effects.size(), 1U);
  EXPECT_EQ(rig.effects[0].parameters.at("lag_at_100mm_rad"), 0.6);
  EXPECT_EQ(rig.truth.lambda1_per_rad, 0.49);  // what the software believes, unless said
}

TEST_F(RigConfigFile, TakesAModelFileBesideIt) {
  io::ModelFile model;
  model.needle.curvature_per_mm = 0.0052;
  model.effects = {{.name = "torsional_windup", .parameters = {{"lag_at_100mm_rad", 0.6}}}};
  io::save_model_file(model, (folder / "truth.toml").string());
  const auto rig = load("[rig]\nmodel = \"truth.toml\"\n");
  EXPECT_EQ(rig.truth, model.needle);
  EXPECT_EQ(rig.effects, model.effects);
}

TEST_F(RigConfigFile, TakesDiscrepanciesAndVariationFromEither) {
  io::ModelFile model;
  model.discrepancies = {{DiscrepancyComponent::advance, Covariate::depth_mm, {0, 50}, {0, 0.1}, {0.01, 0.02}}};
  model.variation = Variation{.curvature_relative = 0.1, .roll_rad = 0.05};
  io::save_model_file(model, (folder / "truth.toml").string());
  const auto from_file = load("[rig]\nmodel = \"truth.toml\"\n");
  EXPECT_EQ(from_file.discrepancies, model.discrepancies);
  EXPECT_EQ(from_file.variation, *model.variation);
  const auto own = load(
      "[[rig.discrepancy]]\ncomponent = \"advance\"\ncovariate = \"depth_mm\"\nknots = [0.0, 50.0]\n"
      "values = [0.0, 0.1]\nstd_errors = [0.01, 0.02]\n[rig.variation]\ncurvature_relative = 0.1\nroll_rad = 0.05\n");
  EXPECT_EQ(own.discrepancies, model.discrepancies);
  EXPECT_EQ(own.variation, *model.variation);
  // What the software believes is never the rig's.
  EXPECT_EQ(load("[variation]\nroll_rad = 0.1\n").variation, Variation{});
}

TEST_F(RigConfigFile, MistakesAreNamed) {
  EXPECT_THAT(fault_of("[rig]\nmodel = \"none.toml\"\n"), HasSubstr("none.toml: cannot be read"));
  EXPECT_THAT(fault_of(std::string("[rig]\nmodel = \"m.toml\"\n[[rig.effect]]\n") + kWindup),
              HasSubstr("rig.model: stands for needle, effect, discrepancy and variation, and there is effect too"));
  EXPECT_THAT(fault_of("[[rig.effect]]\nname = \"layer\"\ncurvature_ratio = 0.5\n"),
              HasSubstr("rig.effect[0].depth_mm is missing"));
}

}  // namespace
}  // namespace bevel::model::testing
