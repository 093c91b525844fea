// The loop with a needle that is not the model: a beam in elastic tissue, by drives and messages as they run live.
#include <gmock/gmock.h>

#include <cmath>

#include "io/config.hpp"
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
