// SPDX-License-Identifier: MIT
// An axis that comes to its end: a limit switch of the rig ([rig.limit_switches]) or the drive's own software limit.
// Run into, at rest, latched with its reason, armed again by word and backed off.
#include <gmock/gmock.h>

#include <bevel/error.hpp>
#include <bevel/io/config.hpp>
#include "tests/loop/loop_fixture.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel {
namespace {

using nodes::Word;
using testing::HasSubstr;
const Eigen::Vector3d kTarget(6, -9, 100);

struct End {
  const char* name;
  void (*put)(nodes::SystemConfig&);
  std::uint32_t input;  // of 60FD, when it is met
};

nodes::SystemConfig with(const End& end) {
  nodes::SystemConfig config = test::loop_config();
  end.put(config);
  return config;
}

class TravelLimits : public testing::TestWithParam<End>, public test::SimulatedLoop {
 protected:
  TravelLimits() : SimulatedLoop(kSeed, with(GetParam())) {}
  double insertion_mm() { return rig->drive(0).position_unit(); }
  // By hand, in place of the controller.
  void command(double insertion_mm_s) {
    each_ms = [this, insertion_mm_s] {
      if (ms % 20 != 0) return;
      motion_command_t m{};
      m.utime = utime();
      m.seq = hand_seq_++;
      m.mode = 1;
      m.insertion_rate_mm_s = insertion_mm_s;
      port.publish(io::channel::kMotionCommand, m);
    };
  }
  bool arm_axes() {
    command(0);
    run(0.3);
    say(Word::arm);
    return run(5, [this] { return stepper->report().state == stepper::DriverState::enabled; });
  }

 private:
  std::int64_t hand_seq_ = 0;
};

TEST_P(TravelLimits, AreMetAtRestLatchedAndLeftByWord) {
  ASSERT_EQ(steer_to(kTarget), "");
  ASSERT_TRUE(run(20, [this] { return said("bevel-stepper").state == "stopped"; }));
  ASSERT_TRUE(run(0.2, [this] { return at_rest(); }));
  EXPECT_THAT(said("bevel-stepper").reason, HasSubstr("insertion: axis is at "));
  EXPECT_EQ(rig->drive(0).objects().get(0x60FD), GetParam().input);
  const double met_mm = insertion_mm();
  EXPECT_NEAR(met_mm, 20.0, 0.3);
  run(1);
  EXPECT_EQ(state(), controller::State::stopped) << "the controller too";
  const bool is_switch = GetParam().input != 0;
  EXPECT_EQ(said("bevel-stepper").reason,
            is_switch ? "insertion: axis is at its upper limit switch"
                      : "insertion: axis is at the drive's own limit, no limit switch is active")
      << "of the axis, whichever way the drive counts; latched";
  // Armed by word it goes on no further, and back.
  controller.reset();
  ASSERT_TRUE(arm_axes()) << said("bevel-stepper").reason;
  EXPECT_EQ(said("bevel-stepper").reason, "");
  command(5);
  ASSERT_TRUE(run(1, [this] { return said("bevel-stepper").state == "stopped"; }));
  EXPECT_THAT(said("bevel-stepper").reason, HasSubstr("insertion: axis is at "));
  run(0.2);
  EXPECT_LE(insertion_mm(), 20.3);
  ASSERT_TRUE(arm_axes()) << said("bevel-stepper").reason;
  command(-5);
  run(1);
  EXPECT_EQ(said("bevel-stepper").state, "enabled") << said("bevel-stepper").reason;
  EXPECT_LT(insertion_mm(), met_mm - 4);
  EXPECT_EQ(rig->drive(0).objects().get(0x60FD), 0U);
  std::cout << "seed " << kSeed << ": met at " << met_mm << " mm, backed off to " << insertion_mm() << " mm\n";
}

INSTANTIATE_TEST_SUITE_P(
    Ends, TravelLimits,
    testing::Values(End{"switch", [](nodes::SystemConfig& c) { c.rig.limit_switches[0].max_unit = 20; }, 2},
                    // A drive that counts the other way has its other switch there.
                    End{"switch_of_a_turned_drive",
                        [](nodes::SystemConfig& c) {
                          c.stepper.axes[0].counts_per_unit *= -1;
                          c.rig.limit_switches[0].max_unit = 20;
                        },
                        1},
                    End{"software_limit",
                        [](nodes::SystemConfig& c) { c.stepper.axes[0].drive_position_max_unit = 20; }, 0}),
    [](const auto& end) { return end.param.name; });

std::string refusal_of(const std::string& limit_switches) {
  const test::TemporaryFolder folder;
  const std::string needle = "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\n";
  try {
    const auto config = nodes::load_system_config(folder.write(
        "rig.toml", needle + "lambda1_per_rad = 0.49\nlambda2 = 0.22\n[rig.limit_switches]\n" + limit_switches));
    EXPECT_EQ(config.rig.limit_switches[0].max_unit, 20);
    EXPECT_EQ(config.rig.limit_switches[1].min_unit, -30);
    EXPECT_EQ(config.rig.limit_switches[1].max_unit, std::numeric_limits<double>::infinity());
  } catch (const io::ConfigError& e) {
    return e.what();
  }
  return "";
}

TEST(LimitSwitchKeys, AreReadAndRefusedByName) {
  EXPECT_EQ(refusal_of("insertion_max_mm = 20\nrotation_min_rad = -30\n"), "");
  EXPECT_THAT(refusal_of("insertion_max_mm = 0\n"), HasSubstr("rig.limit_switches.insertion_max_mm = 0"));
  EXPECT_THAT(refusal_of("rotation_min_rad = 3\n"), HasSubstr("rig.limit_switches.rotation_min_rad = 3"));
  EXPECT_THAT(refusal_of("insertion_mm = 20\n"), HasSubstr("unknown key rig.limit_switches.insertion_mm"));
}

}  // namespace
}  // namespace bevel
