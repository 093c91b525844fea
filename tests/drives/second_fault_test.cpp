// SPDX-License-Identifier: MIT
// A second fault while the axes are being stopped for a first one: during the quick stop, and while the drive is still
// being asked which limit it was (0x60FD), whose answer is held back so that this takes as long as it can.
#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/drives/bench.hpp"

namespace bevel::test {
namespace {

using stepper::EnableAnswer;
using stepper::VelocityMode;

constexpr std::uint16_t kHeartbeatMissed = 0x8130;  // CiA 301: life guard or heartbeat error

struct SecondFault {
  const char* name;
  void (*happens)(Bench& bench);
  void (*passes)(Bench& bench);
  bool is_fault = false;         // of a drive, not of the bus: an operator must see that
  bool loses_position = false;   // of the insertion axis
  std::uint32_t error_code = 0;  // of the insertion axis
};

void PrintTo(const SecondFault& fault, std::ostream* out) { *out << fault.name; }

const SecondFault kFaults[] = {
    {"Unplugged", [](Bench& b) { b.insertion.set_silent(true); }, [](Bench& b) { b.insertion.set_silent(false); },
     false, true},
    {"OtherUnplugged", [](Bench& b) { b.rotation.set_silent(true); }, [](Bench& b) { b.rotation.set_silent(false); }},
    {"PdosFrozen", [](Bench& b) { b.insertion.set_pdos_frozen(true); },
     [](Bench& b) { b.insertion.set_pdos_frozen(false); }},
    {"Reset", [](Bench& b) { b.insertion.power_cycle(); }, [](Bench&) {}, false, true},
    {"DriveFault", [](Bench& b) { b.insertion.raise_fault(0x2310); }, [](Bench&) {}, true, false, 0x2310},
    {"OtherDriveFault", [](Bench& b) { b.rotation.raise_fault(0x4310); }, [](Bench&) {}, true},
    {"LeavesOperation",
     [](Bench& b) {
       b.wire.inject({0x701, 1, {0x04}});
     },
     [](Bench&) {}},
    {"ErrorPassive", [](Bench& b) { b.wire.raise(can::BusEvent::error_passive); }, [](Bench&) {}},
    {"BusOff", [](Bench& b) { b.wire.raise(can::BusEvent::bus_off); },
     [](Bench& b) { b.wire.raise(can::BusEvent::recovered); }},
    {"LinkDown", [](Bench& b) { b.wire.set_link_up(false); }, [](Bench& b) { b.wire.set_link_up(true); }, false, true},
    {"NobodyAcknowledges", [](Bench& b) { b.wire.set_acknowledged(false); },
     [](Bench& b) { b.wire.set_acknowledged(true); }, false, true},
    {"DriverStandsStill", [](Bench& b) { b.driver_runs = false; }, [](Bench& b) { b.driver_runs = true; }},
};

enum class First { operator_stop, limit };

class WhileStopping : public testing::TestWithParam<std::tuple<SecondFault, First, VelocityMode>> {
 protected:
  static stepper::StepperConfig config() {
    stepper::StepperConfig config;
    config.mode = std::get<VelocityMode>(GetParam());
    return config;
  }

  // Holds the answers about 0x60FD back, and notes what is asked and what is commanded.
  void SetUp() override {
    bench.wire.set_tap([this](can::Frame& frame) {
      const bool inputs = frame.data[1] == 0xFD && frame.data[2] == 0x60;
      if (frame.id == 0x601 && inputs) asked = true;
      if ((frame.id == 0x201 || frame.id == 0x202) && stepper::cia301::get_u32(frame, 2) != 0) commanded = true;
      if (frame.id != 0x581 || !inputs || !holds_answers) return true;
      answers.push_back(frame);
      return false;
    });
    ASSERT_TRUE(bench.enable());
    bench.move(10.0, 3.0);
  }

  // Stopped for the first reason, and not at rest yet.
  void stop_first() {
    if (std::get<First>(GetParam()) == First::operator_stop) {
      bench.run_ms(400);
      bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
      bench.run_ms(3);
    } else {
      ASSERT_TRUE(bench.run_until([this] { return asked; }, 1000));
      ASSERT_EQ(bench.reason(), StopReason::travel_limit);
    }
    ASSERT_FALSE(bench.at_rest()) << "it is to happen during the quick stop";
  }

  void expect_first_reason() const {
    if (std::get<First>(GetParam()) == First::operator_stop) {
      EXPECT_EQ(bench.reason(), StopReason::operator_stop);
    } else {
      EXPECT_THAT(bench.reason(), testing::AnyOf(StopReason::travel_limit, StopReason::upper_switch));
      EXPECT_EQ(bench.report().stop.axis, 0);
    }
  }

  // Stopped, and neither set-points nor an enable() change anything.
  void expect_stands_still(int ms) {
    const double insertion_mm = bench.insertion.position_unit(), rotation_rad = bench.rotation.position_unit();
    for (int i = 0; i < ms; i += 10) {
      bench.run_ms(10);
      EXPECT_EQ(bench.driver->enable(), EnableAnswer::not_ready);
      EXPECT_GE(bench.report().state, DriverState::stopped);
    }
    EXPECT_NEAR(bench.insertion.position_unit(), insertion_mm, 1e-3);
    EXPECT_NEAR(bench.rotation.position_unit(), rotation_rad, 1e-3);
    EXPECT_FALSE(commanded) << "a velocity went out after the stop";
  }

  Bench bench{config(), {-5.0 * 2000.0, 5.0 * 2000.0}};
  bool asked = false, commanded = false, holds_answers = true;
  std::vector<can::Frame> answers;
};

TEST_P(WhileStopping, BothAxesRestAndNothingMovesUntilArmedAnew) {
  const SecondFault fault = std::get<SecondFault>(GetParam());
  stop_first();
  fault.happens(bench);
  bench.run_ms(1);  // what was on its way
  commanded = false;
  const auto ms = bench.ms_to_rest();
  ASSERT_TRUE(ms.has_value());
  EXPECT_LE(*ms, 200);
  // Longer than any time-out: a question that has no answer is given up.
  expect_stands_still(1500);
  expect_first_reason();
  EXPECT_EQ(bench.report().state, fault.is_fault ? DriverState::fault : DriverState::stopped);
  EXPECT_GE(bench.report().counters.later_stops, fault.is_fault ? 1U : 0U);
  // A drive whose stop the driver did not see confirmed stops by its own watch, and says so where it can be heard.
  const bool withheld = bench.report().counters.heartbeats_withheld != 0;
  EXPECT_THAT(bench.report().error_code[0],
              testing::AnyOf(fault.error_code, withheld ? kHeartbeatMissed : fault.error_code));
  fault.passes(bench);
  expect_stands_still(1500);
  expect_first_reason();
  // An answer of before, while the drives are being configured anew, is none to what is asked then.
  ASSERT_TRUE(bench.driver->rearm());
  for (const can::Frame& late : answers) bench.wire.inject(late);
  holds_answers = false;
  ASSERT_TRUE(bench.reach(DriverState::ready)) << describe(bench.report().stop);
  EXPECT_EQ(bench.report().position_trusted[0], !fault.loses_position);
  bench.driver->confirm_position();
  bench.command = stepper::MotionSetpoint{};
  const double stood_mm = bench.insertion.position_unit();
  bench.run_ms(300);
  EXPECT_NEAR(bench.insertion.position_unit(), stood_mm, 1e-3) << "armed is not yet enabled";
  EXPECT_FALSE(commanded);
  ASSERT_TRUE(bench.enable()) << describe(bench.report().stop);
  bench.move(-5.0, 0.0);
  bench.run_ms(500);
  EXPECT_LT(bench.insertion.position_unit(), stood_mm - 1.0);
  EXPECT_EQ(bench.report().state, DriverState::enabled) << describe(bench.report().stop);
}

std::string name_of(const testing::TestParamInfo<WhileStopping::ParamType>& test) {
  const auto& [fault, first, mode] = test.param;
  return std::string(fault.name) + (first == First::limit ? "AtALimit" : "AfterTheOperator") +
         (mode == VelocityMode::cyclic ? "Cyclic" : "");
}

INSTANTIATE_TEST_SUITE_P(Stops, WhileStopping,
                         testing::Combine(testing::ValuesIn(kFaults),
                                          testing::Values(First::operator_stop, First::limit),
                                          testing::Values(VelocityMode::profile, VelocityMode::cyclic)),
                         name_of);

}  // namespace
}  // namespace bevel::test
