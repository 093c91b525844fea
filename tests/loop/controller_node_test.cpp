// SPDX-License-Identifier: MIT
// bevel-controller as a rig's file sets it up: what it commands for the same state, with effects and without.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bevel/controller/axis_model.hpp>
#include <bevel/nodes/controller_node.hpp>
#include <bevel/nodes/needle_pose.hpp>
#include <bevel/nodes/runtime.hpp>
#include <bevel/nodes/system_config.hpp>
#include "tests/support/temporary_folder.hpp"

namespace bevel::nodes {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::int64_t kStart_utime = 1'700'000'000'000'000, kPeriod_us = 20'000;
constexpr int kPeriods = 12;  // enough for the ramp, too few for axes that stand still to be a tracking error
constexpr double kWidth_rad = 0.4;
constexpr const char* kNeedle =
    "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n";
constexpr const char* kBacklash = "[[effect]]\nname = \"rotation_backlash\"\nwidth_rad = 0.4\n";
constexpr const char* kLostSteps =
    "[[effect]]\nname = \"lost_steps\"\nrotation_rad = 0.8\n[effect.recordings.\"rec01.lcm\"]\nat_s = 3.3\n";

SystemConfig system_of(const std::string& text) {
  const test::TemporaryFolder folder;
  return load_system_config(folder.write("rig.toml", text));
}

// Commands of `periods` of the loop, from the second on steering to a target at the side; the needle is at its entry,
// the axes do not move.
std::vector<model::MotionCommand> commands_of(const SystemConfig& config, int periods) {
  lcm::LCM lcm("memq://");
  LcmPort port(lcm);
  ControllerNode node(lcm, config);
  OperatorHeartbeat heartbeat(port);
  std::int64_t session = 0;
  port.subscribe<process_status_t>(io::channel::kProcessStatus,
                                   [&](const process_status_t& m) { session = m.session; });
  std::vector<model::MotionCommand> commands;
  port.subscribe<motion_command_t>(io::channel::kMotionCommand,
                                   [&](const motion_command_t& m) { commands.push_back(io::to_sample(m)); });
  needle_state_t state{};
  write_pose({}, state);
  state.curvature_per_mm = config.needle.curvature_per_mm;
  state.lambda1_per_rad = config.needle.lambda1_per_rad;
  state.lambda2 = config.needle.lambda2;
  for (int i = 0; i < 9; ++i) state.covariance[10 * i] = 1e-4;
  model::ActuatorState axes;
  axes.axis_status = {2, 2};
  steering_target_t target{};
  target.position_mm[0] = 8;
  target.position_mm[2] = 100;
  for (int period = 0; period < periods; ++period) {
    const std::int64_t utime = kStart_utime + period * kPeriod_us;
    state.utime = state.measurement_utime = axes.utime = target.utime = utime;
    ++state.seq;
    ++axes.seq;
    const Now now{utime * 1000, utime};
    node.tell_time(now);
    port.tell_time(now);
    heartbeat.beat();
    port.publish(io::channel::kNeedleState, state);
    port.publish(io::channel::kActuatorState, io::to_message(axes));
    pump(lcm);
    for (const auto request : {controller::Request::arm, controller::Request::start}) {
      if (period != 1) break;  // in the first the node learns the time
      target.request = static_cast<std::int32_t>(request);
      ++target.seq;
      target.session[0] = session;
      port.publish(io::channel::kSteeringTarget, target);
      pump(lcm);
    }
    node.step(now, 0);
    pump(lcm);
  }
  return commands;
}

// At the entry half the width lies before the tip turns: the base turns faster by what it can brake within that.
TEST(ControllerNode, UndoesTheBacklashThatItsFileSpeaksOf) {
  // By the law that turns all the way, at a rate that leaves room for more.
  const std::string spinning = std::string(kNeedle) + "[controller]\nlaw = \"spin\"\n";
  const SystemConfig config = system_of(spinning + kBacklash);
  const std::string slack = "[estimator.prior]\nbending_mm = 0.0\n";  // as with effects
  const auto plain = commands_of(system_of(spinning + slack), kPeriods), undone = commands_of(config, kPeriods);
  ASSERT_THAT(plain, SizeIs(kPeriods));
  ASSERT_THAT(undone, SizeIs(kPeriods));
  EXPECT_EQ(plain.back().mode, 1);
  EXPECT_EQ(undone.back().mode, 1);
  const double wanted_rad_s = plain.back().rotation_rate_rad_s;
  EXPECT_GT(wanted_rad_s, 1);
  EXPECT_NEAR(undone.back().rotation_rate_rad_s,
              controller::base_rate_rad_s(wanted_rad_s, kWidth_rad / 2, 1, config.controller.limits), 1e-9);
  EXPECT_GT(undone.back().rotation_rate_rad_s, wanted_rad_s + 1);
}

TEST(ControllerNode, HasTheEffectsOfTheEstimator) {
  const SystemConfig config = system_of(std::string(kNeedle) + kBacklash + kLostSteps);
  ASSERT_THAT(config.estimator.effects, SizeIs(1));
  ASSERT_THAT(config.live_effects.active, SizeIs(1));
  EXPECT_EQ(config.live_effects.active[0].effect, config.estimator.effects[0].effect);
}

TEST(ControllerNode, LeavesOutAnEffectWithAnUnknownOfTheRecordingAndSaysSo) {
  const SystemConfig config = system_of(std::string(kNeedle) + kLostSteps);
  EXPECT_THAT(config.live_effects.left_out, ElementsAre(HasSubstr("effect lost_steps is left out: its at_s differs")));
  EXPECT_THAT(config.estimator.effects, IsEmpty());
  EXPECT_EQ(commands_of(config, kPeriods).back().rotation_rate_rad_s,
            commands_of(system_of(kNeedle), kPeriods).back().rotation_rate_rad_s);
}

}  // namespace
}  // namespace bevel::nodes
