// SPDX-License-Identifier: MIT
// The loop with a needle that is not the model: a beam in elastic tissue, by drives and messages as they run live.
#include <gmock/gmock.h>

#include <cmath>

#include <bevel/error.hpp>
#include <bevel/io/config.hpp>
#include "tests/loop/simulated_loop.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel {
namespace {

using controller::State;

constexpr unsigned kSeed = 19;

// The file of the demo on this plant.
nodes::SystemConfig beam_config() { return nodes::load_system_config(BEVEL_SOURCE_DIR "/config/beam.toml"); }

TEST(BeamLoop, SteersABeamToATargetByAShaftThatItLearns) {
  nodes::SystemConfig config = beam_config();
  ASSERT_TRUE(config.rig.beam);
  test::SimulatedLoop loop(kSeed, config);
  double heard_mm = 0, sd_mm = 0;
  loop.port.subscribe<needle_shaft_t>(
      io::channel::kNeedleShaft, [&](const needle_shaft_t& m) { heard_mm = m.bending_mm, sd_mm = m.bending_sd_mm; });
  const Eigen::Vector3d target(6, -5, 100);
  ASSERT_EQ(loop.steer_to(target), "");
  ASSERT_TRUE(loop.run(60, [&] { return loop.state() != State::steering; }));
  EXPECT_EQ(loop.state(), State::hold) << controller::to_string(loop.reason());
  loop.run(0.5);
  const double miss_mm = (loop.tip() - target).norm();
  const double truth_mm = std::pow(4 * 1.6e4 / 0.05, 0.25);
  std::cout << "seed " << kSeed << ": tip to target " << miss_mm << " mm, bending length " << heard_mm << " +- "
            << sd_mm << " mm of " << truth_mm << ", told " << config.estimator.prior.bending_mm << "\n";
  EXPECT_LT(miss_mm, 0.6);
  EXPECT_LT(std::abs(heard_mm - truth_mm), 4 * sd_mm);
  EXPECT_LT(sd_mm, 0.5 * config.estimator.prior.bending_sd_mm);
  EXPECT_TRUE(loop.at_rest());
}

// What the shaft is for: the same needle by the plain filter is lost.
TEST(BeamLoop, WithoutIt_TheFilterRejectsWhatItSees) {
  nodes::SystemConfig config = beam_config();
  config.estimator.prior.bending_mm = 0;
  config.controller.shaft = {};
  test::SimulatedLoop loop(kSeed, config);
  ASSERT_EQ(loop.steer_to({6, -5, 100}), "");
  ASSERT_TRUE(loop.run(60, [&] { return loop.state() != State::steering; }));
  EXPECT_TRUE(loop.state() != State::hold || (loop.tip() - Eigen::Vector3d(6, -5, 100)).norm() > 1)
      << "tip to target " << (loop.tip() - Eigen::Vector3d(6, -5, 100)).norm();
}

// A file without [estimator.prior] in soft tissue (50 kPa and 1 N, 20 kPa and 0.5 N) and in gel. Its k is off by 15 %.
TEST(BeamLoop, TheDefaultConfigurationArrivesInSoftTissueAndInGel) {
  struct Tissue {
    const char* rig;
    double curvature_per_mm;
    Eigen::Vector3d target_mm;
  };
  const test::TemporaryFolder folder;
  for (const Tissue& tissue :
       {Tissue{"[rig.beam]\nfoundation_modulus_kPa = 50.0\nbevel_force_N = 1.0\n", 0.0024, {4, -5, 100}},
        Tissue{"[rig.beam]\nfoundation_modulus_kPa = 20.0\nbevel_force_N = 0.5\n", 0.0015, {2, -3, 100}},
        Tissue{"[rig.needle]\ncurvature_per_mm = 0.0041\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n",
               0.0047,
               {6, -9, 100}}}) {
    char needle[200];
    std::snprintf(needle, sizeof needle,
                  "[needle]\ncurvature_per_mm = %.4f\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n",
                  tissue.curvature_per_mm);
    const auto config = nodes::load_system_config(folder.write("rig.toml", std::string(needle) + tissue.rig));
    EXPECT_GT(config.controller.shaft.bending_mm, 0);
    test::SimulatedLoop loop(kSeed, config);
    ASSERT_EQ(loop.steer_to(tissue.target_mm), "") << tissue.rig;
    ASSERT_TRUE(loop.run(60, [&] { return loop.state() != State::steering; })) << tissue.rig;
    loop.run(0.6);
    EXPECT_EQ(loop.state(), State::hold) << tissue.rig << loop.said("bevel-controller").reason;
    EXPECT_EQ(loop.reason(), controller::Reason::arrived) << tissue.rig << loop.said("bevel-controller").reason;
    EXPECT_THAT(loop.said("bevel-controller").reason, testing::StartsWith("arrived: "));
    EXPECT_THAT(loop.said("bevel-estimator").reason, testing::Not(testing::HasSubstr("guide turned"))) << tissue.rig;
    EXPECT_LT((loop.tip() - tissue.target_mm).norm(), 0.6) << tissue.rig;
  }
}

// Without the bending length the needle stops, and the reason names the keys.
TEST(BeamLoop, AFilterThatRejectsNamesTheKeysThatMayBeWrong) {
  nodes::SystemConfig config = beam_config();
  config.estimator.prior.bending_mm = 0;
  config.controller.shaft = {};
  test::SimulatedLoop loop(kSeed, config);
  ASSERT_EQ(loop.steer_to({6, -5, 100}), "");
  ASSERT_TRUE(loop.run(60, [&] { return loop.state() != State::steering; }));
  loop.run(0.1);
  ASSERT_EQ(loop.reason(), controller::Reason::state_unhealthy) << loop.said("bevel-controller").reason;
  const std::string reason = loop.said("bevel-controller").reason;
  for (const char* key :
       {"rejecting measurements", "[estimator.prior] bending_mm, bending_sd_mm, guide_mm", "[needle]"})
    EXPECT_THAT(reason, testing::HasSubstr(key));
}

// The default gives way to what the filter does not estimate together with a bending length.
TEST(BeamLoop, TheDefaultShaftGivesWayToEffectsHeadingsAndTheWheelbase) {
  const test::TemporaryFolder folder;
  const auto bending_mm = [&](const std::string& more) {
    return nodes::load_system_config(
               folder.write("rig.toml",
                            "[needle]\ncurvature_per_mm = 0.002\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.0\nlambda2 = "
                            "0.0\n" +
                                more))
        .estimator.prior.bending_mm;
  };
  EXPECT_EQ(bending_mm(""), estimator::kUnknownBending_mm);
  EXPECT_EQ(bending_mm("[estimator.prior]\nguide_mm = 4.0\n"), estimator::kUnknownBending_mm);
  EXPECT_EQ(bending_mm("[estimator.prior]\nbending_mm = 0.0\n"), 0);
  EXPECT_EQ(bending_mm("[estimator.prior]\nbending_mm = 33.0\n"), 33);
  EXPECT_EQ(bending_mm("[estimator.prior]\nwheelbase_sd_mm = 2.0\n"), 0);
  EXPECT_EQ(bending_mm("[[effect]]\nname = \"torsional_windup\"\nlag_at_100mm_rad = 0.5\n"), 0);
  EXPECT_EQ(bending_mm("[rig.heading]\nsd_rad = 0.02\n"), 0);
}

TEST(BeamLoop, AShaftThatCannotBeIsRefusedByName) {
  const test::TemporaryFolder folder;
  const auto refused = [&](const std::string& more, const std::string& text) {
    const std::string path = folder.write(
        "rig.toml",
        "[needle]\ncurvature_per_mm = 0.002\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.0\nlambda2 = 0.0\n" + more);
    EXPECT_THAT([&] { nodes::load_system_config(path); },
                testing::ThrowsMessage<io::ConfigError>(testing::HasSubstr(text)));
  };
  refused("[estimator.prior]\nbending_mm = 2.0\n", "allowed: 0, or 5 to 200");
  refused("[estimator.prior]\nbending_mm = 40.0\nwheelbase_sd_mm = 2.0\n", "one or the other");
  refused("[[effect]]\nname = \"torsional_windup\"\nlag_at_100mm_rad = 0.5\n[estimator.prior]\nbending_mm = 40.0\n",
          "torsional_windup is one");
  refused("[rig.beam]\nfoundation_modulus_kPa = -1.0\n", "foundation_modulus_kPa");
  refused("[rig.beam]\nmodulus = 3.0\n", "modulus");
  refused("[controller]\nlaw = \"zigzag\"\n", "law");
}

}  // namespace
}  // namespace bevel
