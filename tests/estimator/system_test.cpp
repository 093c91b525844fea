// SPDX-License-Identifier: MIT
// The live estimator as a rig's file sets it up, and replays against the truth that a rig writes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>

#include <bevel/analysis/replay/batch.hpp>
#include <bevel/error.hpp>
#include <bevel/io/log_reader.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/nodes/estimator_node.hpp>
#include <bevel/nodes/needle_pose.hpp>
#include <bevel/nodes/runtime.hpp>
#include <bevel/nodes/system_config.hpp>
#include "tests/estimator/insertion.hpp"

namespace bevel {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
constexpr unsigned kSeed = 41;

constexpr const char* kNeedle =
    "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n";
constexpr const char* kWindup = "[[effect]]\nname = \"torsional_windup\"\nlag_at_100mm_rad = 0.6\n";

struct SystemFile : ::testing::Test {
  fs::path folder = fs::temp_directory_path() / ("bevel_system_" + std::to_string(::getpid()));
  void SetUp() override { fs::create_directories(folder); }
  void TearDown() override { fs::remove_all(folder); }
  std::string write(const std::string& text, const std::string& name = "rig.toml") const {
    std::ofstream(folder / name) << text;
    return (folder / name).string();
  }
};

TEST_F(SystemFile, TheEstimatorTakesTheEffectsBesideItsNeedle) {
  const auto config = nodes::load_system_config(write(std::string(kNeedle) + kWindup));
  ASSERT_EQ(config.estimator.effects.size(), 1U);
  EXPECT_EQ(config.estimator.effects[0].effect->name(), "torsional_windup");
  EXPECT_EQ(config.estimator.effects[0].parameters[0].value, 0.6);
  EXPECT_TRUE(config.rig.effects.empty());
  EXPECT_TRUE(nodes::load_system_config(write(kNeedle)).estimator.effects.empty());
}

TEST_F(SystemFile, OrTheModelFileBesideIt) {
  write(std::string(kNeedle) + kWindup, "found.toml");
  const auto config = nodes::load_system_config(write("model = \"found.toml\"\n"));
  EXPECT_EQ(config.needle.lambda1_per_rad, 0.49);
  EXPECT_EQ(config.estimator.prior.needle, config.needle);
  EXPECT_EQ(config.rig.truth, config.needle);
  ASSERT_EQ(config.estimator.effects.size(), 1U);
}

constexpr const char* kUncertain =
    "[[discrepancy]]\ncomponent = \"curvature_bevel\"\ncovariate = \"depth_mm\"\nknots = [0.0, 50.0]\n"
    "values = [0.0, 6e-4]\nstd_errors = [1e-4, 1e-4]\n[variation]\ncurvature_relative = 0.1\nroll_rad = 0.07\n";

TEST_F(SystemFile, TheEstimatorTakesDiscrepanciesAndVariationLiveAndInAReplay) {
  const std::string system_path = write(std::string(kNeedle) + kWindup + kUncertain);
  const auto config = nodes::load_system_config(system_path);
  ASSERT_EQ(config.estimator.effects.size(), 2U);
  EXPECT_EQ(config.estimator.effects[1].effect->name(), "discrepancy");
  EXPECT_EQ(config.estimator.prior.variation, (model::Variation{.curvature_relative = 0.1, .roll_rad = 0.07}));
  EXPECT_EQ(config.live_effects.active.size(), 2U);
  EXPECT_TRUE(config.live_effects.left_out.empty());
  for (const bool by_system : {true, false}) {
    analysis::BatchOptions options;
    (by_system ? options.system_path : options.model_path) = system_path;
    const analysis::ReplaySetup setup = analysis::load_setup(options);
    EXPECT_EQ(setup.discrepancies, config.discrepancies);
    EXPECT_EQ(setup.config.prior.variation, config.estimator.prior.variation);
  }
}

TEST_F(SystemFile, MistakesAreNamed) {
  const auto fault_of = [this](const std::string& text) -> std::string {
    try {
      nodes::load_system_config(write(text));
    } catch (const io::ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(fault_of("model = \"none.toml\"\n"), HasSubstr("none.toml: cannot be read"));
  EXPECT_THAT(fault_of(std::string("model = \"m.toml\"\n") + kNeedle), HasSubstr("model: stands for needle"));
  EXPECT_THAT(fault_of(std::string(kNeedle) + "[[effect]]\nname = \"layer\"\ncurvature_ratio = 0.5\n"),
              HasSubstr("effect[0].depth_mm is missing"));
  EXPECT_THAT(fault_of("[system]\n"), HasSubstr("needle"));
}

TEST_F(SystemFile, StatesOfTheRigAreRefusedWhereTheyMeanNothing) {
  const std::string view = "px_per_mm = 4.4\norigin_px = [240.0, 40.0]\nrows_carry = \"+z\"\n";
  const std::array cameras{"[[camera]]\ncamera = 0\ncolumns_carry = \"+y\"\n" + view,
                           "[[camera]]\ncamera = 1\ncolumns_carry = \"+x\"\n" + view,
                           "[[camera]]\ncamera = 2\ncolumns_carry = \"+x\"\n" + view};
  // What is said of a file with the first so many of them.
  const auto fault_of = [&](const std::string& told, std::size_t count, const std::string& more = "") -> std::string {
    std::string text = kNeedle + more;
    for (std::size_t i = 0; i < count; ++i) text += cameras.at(i);
    try {
      nodes::load_system_config(write(text + "[estimator.nuisance]\n" + told + "\n"));
    } catch (const io::ConfigError& error) {
      return error.what();
    }
    return "";
  };
  const auto names = [](const std::string& text) { return HasSubstr("nuisance." + text); };
  EXPECT_EQ(fault_of("windup_sd_rad = 0.4\nlatency_sd_s = 0.02", 2), "");
  EXPECT_EQ(fault_of("windup_sd_rad = 0.4\nlatency_sd_s = 0.02", 1), "");
  EXPECT_EQ(fault_of("windup_sd_rad = 0.4", 3), "");
  EXPECT_THAT(fault_of("latency_sd_s = 0.02", 3), AllOf(names("latency_sd_s"), HasSubstr("there is a camera 2")));
  EXPECT_THAT(fault_of("windup_sd_rad = -0.4", 2), AllOf(names("windup_sd_rad"), HasSubstr("0")));
  EXPECT_THAT(fault_of("latency_sd_s = 20", 2), AllOf(names("latency_sd_s"), HasSubstr("0.1")));
  EXPECT_THAT(fault_of("windup_rad = 0.4", 2), names("windup_rad"));
  EXPECT_THAT(fault_of("windup_sd_rad = 0.4", 2, kWindup), HasSubstr("torsional_windup is one"));
}

estimator::testing::Insertion insertion(std::mt19937_64& rng, const estimator::Prior& prior) {
  estimator::testing::InsertionPlan plan;
  plan.cameras = 2;
  return estimator::testing::draw_insertion(prior, plan, rng).data;
}

// Measurements before the actuator state that follows them, which is when the live estimator could first use them.
template <class TakeActuator, class TakeMeasurement>
void in_order(const estimator::testing::Insertion& data, TakeActuator take_actuator, TakeMeasurement take_measurement) {
  std::size_t next = 0;
  for (const auto& actuator : data.actuators) {
    while (next < data.measurements.size() && data.measurements[next].utime < actuator.utime)
      take_measurement(data.measurements[next++]);
    take_actuator(actuator);
  }
}

needle_state_t truth_message(std::int64_t utime, const model::Pose& pose) {
  needle_state_t m{};
  m.utime = utime;
  nodes::write_pose(pose, m);
  return m;
}

void write_log(const std::string& path, const estimator::testing::Insertion& data,
               const std::vector<needle_state_t>& truths = {}) {
  io::LogWriter log(path);
  in_order(
      data,
      [&](const model::ActuatorState& a) {
        log.write_message(a.utime, io::channel::kActuatorState, io::to_message(a));
      },
      [&](const model::TipMeasurement& m) {
        log.write_message(m.utime, io::channel::kTipMeasurement, io::to_message(m));
      });
  for (const needle_state_t& truth : truths) log.write_message(truth.utime, io::channel::kNeedleTruth, truth);
  log.close();
}

TEST_F(SystemFile, AReplayIsWithTheDiscrepancyAndTheVariation) {
  std::mt19937_64 rng(kSeed);
  const auto data = insertion(rng, estimator::Prior{});
  const std::string log = (folder / "log.lcm").string();
  write_log(log, data);
  const auto last_of = [&](const std::string& text) {
    analysis::BatchOptions options;
    options.model_path = write(text, "model.toml");
    const analysis::ReplaySetup setup = analysis::load_setup(options);
    const auto one =
        analysis::replay_logs({log}, setup.config, {.effects = setup.effects, .discrepancies = setup.discrepancies});
    return one.front().states.back().state.unpacked();
  };
  const auto plain = last_of(kNeedle), uncertain = last_of(std::string(kNeedle) + kUncertain);
  EXPECT_NE(plain.curvature_per_mm, uncertain.curvature_per_mm);
  EXPECT_GT(uncertain.covariance(3, 3), plain.covariance(3, 3));
}

TEST_F(SystemFile, TheLiveNodeAppliesItsEffectsAsAReplayWithTheSameFileDoes) {
  std::mt19937_64 rng(kSeed);
  const std::string system_path = write(std::string(kNeedle) + kWindup);
  const auto config = nodes::load_system_config(system_path);
  const auto data = insertion(rng, config.estimator.prior);
  lcm::LCM lcm("memq://");
  nodes::EstimatorNode node(lcm, config.estimator, {});
  nodes::LcmPort port(lcm);
  std::vector<needle_state_t> live;
  bool at_axes = false;
  // Between them come those of readings as they arrive, which hold at that moment.
  port.subscribe<needle_state_t>(io::channel::kNeedleState, [&](const needle_state_t& m) {
    if (at_axes) live.push_back(m);
  });
  in_order(
      data,
      [&](const model::ActuatorState& a) {
        at_axes = true;
        node.tell_time({a.utime * 1000, a.utime});
        port.publish(io::channel::kActuatorState, io::to_message(a));
        nodes::pump(lcm);
      },
      [&](const model::TipMeasurement& m) {
        at_axes = false;
        node.tell_time({m.utime * 1000, m.utime});
        port.publish(io::channel::kTipMeasurement, io::to_message(m));
        nodes::pump(lcm);
      });
  const std::string log = (folder / "live.lcm").string();
  write_log(log, data);
  analysis::BatchOptions options;
  options.system_path = system_path;
  const analysis::ReplaySetup setup = analysis::load_setup(options);
  const auto replayed = analysis::replay_logs({log}, setup.config, {.effects = setup.effects}).front();
  const auto without = analysis::replay_logs({log}, setup.config).front();
  ASSERT_EQ(live.size(), replayed.states.size());
  ASSERT_GT(live.size(), 900U);
  for (std::size_t i = 0; i < live.size(); ++i)
    for (int k = 0; k < 3; ++k) ASSERT_EQ(live[i].position_mm[k], replayed.states[i].state.pose.p_mm[k]) << i;
  EXPECT_NE(live.back().lambda1_per_rad, without.states.back().state.lambda1_per_rad);
}

TEST_F(SystemFile, ErrorsAgainstTheTruthAreThoseThatWerePutIn) {
  std::mt19937_64 rng(kSeed);
  const estimator::EstimatorConfig config;
  const auto data = insertion(rng, config.prior);
  const std::string log = (folder / "truth.lcm").string();
  write_log(log, data);
  const auto blind = analysis::replay_logs({log}, config).front();
  EXPECT_EQ(blind.truth.count, 0);
  // A truth off the estimate by as much in its own frame, sampled at every fifth actuator state.
  model::Vector6d error;
  error << 0.3, 0, 0.4, 0.01, 0, 0.03;
  std::vector<needle_state_t> truths;
  double nees = 0;
  for (std::size_t i = 0; i < blind.states.size(); i += 5) {
    const estimator::FilterState state = blind.states[i].state.unpacked();
    truths.push_back(truth_message(blind.states[i].utime, state.pose * model::exp_se3(error)));
    nees += error.dot(state.covariance.topLeftCorner<6, 6>().inverse() * error) / 6;
  }
  nees /= static_cast<double>(truths.size());
  // Before the first actuator state there is no estimate: such a truth is left out.
  truths.insert(truths.begin(), truth_message(blind.states.front().utime - 1000, {}));
  write_log(log, data, truths);
  const auto seen = analysis::replay_logs({log}, config).front();
  EXPECT_EQ(seen.truth.count, static_cast<std::int64_t>(truths.size()) - 1);
  EXPECT_NEAR(seen.truth.position_rmse_mm, 0.5, 2e-3);  // exp of a twist turns its displacement by half of 0.03
  EXPECT_NEAR(seen.truth.last_position_error_mm, 0.5, 2e-3);
  EXPECT_NEAR(seen.truth.tilt_rmse_rad, 0.01, 1e-6);
  EXPECT_NEAR(seen.truth.roll_rmse_rad, 0.03, 1e-6);
  EXPECT_NEAR(seen.truth.pose_nees.mean(), nees, 1e-3 * nees);
}

TEST_F(SystemFile, AgainstTheTruthOfFortyInsertionsTheFilterIsConsistent) {
  std::mt19937_64 rng(kSeed);
  estimator::EstimatorConfig config;
  config.process = {0, 0, 0, 0, 0, 0, 0};  // as the truth: the default's walk alone would bring NEES to a half
  analysis::ChiSquareMean nees;
  double squares_mm2 = 0;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    const auto data = insertion(rng, config.prior);
    // At the end alone: one independent figure of six degrees each.
    const std::string log = (folder / "truth.lcm").string();
    write_log(log, data, {truth_message(data.actuators.back().utime, data.poses.back())});
    const auto replay = analysis::replay_logs({log}, config).front();
    ASSERT_EQ(replay.truth.count, 1);
    nees.add(replay.truth.pose_nees.sum, 6);
    squares_mm2 += replay.truth.position_rmse_mm * replay.truth.position_rmse_mm / kRuns;
  }
  std::cout << "pose NEES/6 at the end of " << kRuns << " insertions " << nees.mean() << " [" << nees.lowest() << ", "
            << nees.highest() << "], RMSE " << std::sqrt(squares_mm2) << " mm, seed " << kSeed << "\n";
  EXPECT_TRUE(nees.in_band()) << nees.mean();
  EXPECT_LT(std::sqrt(squares_mm2), 0.15);  // a measurement's own standard deviation
}

}  // namespace
}  // namespace bevel
