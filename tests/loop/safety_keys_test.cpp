// SPDX-License-Identifier: MIT
// The configuration cannot switch safety off: every key of the chain from a fault to rest has both its limits, and a
// message that names key, value, what is allowed and why.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>

#include <bevel/error.hpp>
#include <bevel/io/config.hpp>
#include <bevel/nodes/system_config.hpp>
#include "tests/support/temporary_folder.hpp"

namespace bevel::nodes {
namespace {

using ::testing::HasSubstr;

constexpr const char* kNeedle =
    "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n";

struct Refused {
  const char* section;
  const char* key;
  const char* value;
};

void PrintTo(const Refused& r, std::ostream* out) { *out << r.section << "." << r.key << " = " << r.value; }

class SafetyKeys : public ::testing::TestWithParam<Refused> {};

TEST_P(SafetyKeys, AreRefusedBeyondTheirLimits) {
  const Refused& r = GetParam();
  const test::TemporaryFolder folder;
  const std::string path =
      folder.write("rig.toml", std::string(kNeedle) + "[" + r.section + "]\n" + r.key + " = " + r.value + "\n");
  try {
    load_system_config(path);
    FAIL() << r.section << "." << r.key << " = " << r.value << " was accepted";
  } catch (const io::ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr(r.key));
    EXPECT_THAT(e.what(), ::testing::AnyOf(HasSubstr("from "), HasSubstr("must be ")));
  }
}

constexpr const char* kSafety = "controller.safety";
constexpr const char* kLimits = "estimator.limits";
INSTANTIATE_TEST_SUITE_P(
    Table, SafetyKeys,
    ::testing::Values(Refused{kLimits, "measurement_age_s", "100.0"}, Refused{kLimits, "measurement_age_s", "0.0"},
                      Refused{kLimits, "measurement_silence_s", "1.0"}, Refused{kLimits, "actuator_age_s", "1.0"},
                      Refused{kLimits, "position_sd_mm", "1e9"}, Refused{kSafety, "state_age_s", "0.2"},
                      Refused{kSafety, "actuator_age_s", "0.2"}, Refused{kSafety, "position_sd_mm", "1e6"},
                      Refused{kSafety, "depth_max_mm", "-1000"}, Refused{kSafety, "depth_max_mm", "1e5"},
                      Refused{kSafety, "depth_min_mm", "50"}, Refused{kSafety, "lateral_max_mm", "1e5"},
                      Refused{kSafety, "tracking_error_mm_s", "1e3"}, Refused{kSafety, "tracking_error_rad_s", "1e3"},
                      Refused{kSafety, "tracking_error_s", "10"}, Refused{kSafety, "axis_delay_s", "10"},
                      Refused{kSafety, "resting_motion_mm", "100"}, Refused{kSafety, "enabling_s", "1e6"},
                      Refused{kSafety, "target_miss_max_mm", "1e4"}, Refused{"controller", "period_s", "0.2"},
                      Refused{"stepper", "setpoint_stop_age_ms", "10000"},
                      Refused{"stepper", "setpoint_zero_age_ms", "500"},
                      Refused{"stepper", "master_heartbeat_timeout_ms", "1000"},
                      Refused{"stepper", "drive_heartbeat_timeout_ms", "1000"}, Refused{"stepper", "period_ms", "50"},
                      Refused{"stepper.insertion", "quick_stop_unit_s2", "1e-6"},
                      Refused{"stepper.insertion", "drive_position_max_unit", "1e7"},
                      Refused{"stepper.rotation", "quick_stop_unit_s2", "1.0"}));

TEST(SafetyKeysTogether, TheMessageSaysWhy) {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("rig.toml", std::string(kNeedle) + "[controller.safety]\nstate_age_s = 1.0\n");
  try {
    load_system_config(path);
    FAIL();
  } catch (const io::ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("controller.safety.state_age_s"));
    EXPECT_THAT(e.what(), HasSubstr("from 0.01 to 0.12: the needle must rest within 200 ms of a fault"));
  }
}

std::string refusal_of(const std::string& controller) {
  const test::TemporaryFolder folder;
  try {
    load_system_config(folder.write("rig.toml", std::string(kNeedle) + controller));
  } catch (const io::ConfigError& e) {
    return e.what();
  }
  return "";
}

TEST(Obstacles, AreSpheresAndCapsulesAndNothingHalf) {
  const std::string head = "[[controller.obstacle]]\nclearance_mm = 1.0\nradius_mm = 3.0\n";
  EXPECT_EQ(refusal_of(head + "centre_mm = [0, 5, 50]\n"), "");
  EXPECT_EQ(refusal_of(head + "from_mm = [0, 5, 50]\nto_mm = [10, 5, 50]\n"), "");
  EXPECT_THAT(refusal_of(head), HasSubstr("centre_mm"));
  EXPECT_THAT(refusal_of(head + "from_mm = [0, 5, 50]\n"), HasSubstr("to_mm"));
  EXPECT_THAT(refusal_of(head + "centre_mm = [0, 5]\n"), HasSubstr("centre_mm"));
  EXPECT_THAT(refusal_of(head + "centre_mm = [0, 5, 50]\nto_mm = [0, 5, 50]\n"), HasSubstr("one or the other"));
  EXPECT_THAT(refusal_of("[[controller.obstacle]]\ncentre_mm = [0, 5, 50]\nradius_mm = 3.0\nclearance_mm = 0.0\n"),
              HasSubstr("the estimate of the tip is not exact"));
  EXPECT_THAT(refusal_of("[controller]\nlaw = \"spin\"\n" + head + "centre_mm = [0, 5, 50]\n"), HasSubstr("arcs"));
}

}  // namespace
}  // namespace bevel::nodes
