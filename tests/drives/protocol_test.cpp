// SPDX-License-Identifier: MIT
// CANopen details: SDO answers that are late, doubled, wrong or refused; identity; state decoding; the drive's own
// rules.
#include <gmock/gmock.h>

#include <bevel/drivers/stepper/cia301.hpp>
#include <bevel/drivers/stepper/cia402.hpp>
#include "tests/drives/bench.hpp"
#include "tests/drives/raw_drive.hpp"

namespace bevel::test {
namespace {

using stepper::cia301::SdoClient;
namespace cia402 = stepper::cia402;

constexpr std::int64_t kTimeout_ns = 500 * kMs;

SdoClient waiting_for(std::uint16_t index) {
  SdoClient client(1, kTimeout_ns);
  client.upload({index, 0});
  client.sent(0);
  return client;
}

TEST(Sdo, UploadTakesTheSizeFromTheAnswer) {
  auto client = waiting_for(0x6061);
  client.on_response({0x581, 8, {0x4F, 0x61, 0x60, 0x00, 0x03, 0xFF, 0xFF, 0xFF}});
  EXPECT_EQ(client.status(), SdoClient::Status::done);
  EXPECT_EQ(client.value(), 3U);
}

TEST(Sdo, ATransferGivenUpIsEndedUnderItsOwnObjectBeforeTheNext) {
  auto client = waiting_for(0x6061);
  client.check_time(kTimeout_ns);
  client.upload({0x1000, 0});
  EXPECT_EQ(*client.frame_to_send(), (Frame{0x601, 8, {0x80, 0x61, 0x60, 0x00, 0x00, 0x00, 0x04, 0x05}}));
  client.sent(kTimeout_ns);
  EXPECT_EQ(*client.frame_to_send(), (Frame{0x601, 8, {0x40, 0x00, 0x10, 0x00}}));
  client.sent(kTimeout_ns);
  EXPECT_EQ(client.status(), SdoClient::Status::waiting);
}

// "Bevel 402" in two segments.
constexpr std::array<Frame, 3> kText{{{0x581, 8, {0x41, 0x08, 0x10, 0x00, 9, 0, 0, 0}},
                                      {0x581, 8, {0x00, 'B', 'e', 'v', 'e', 'l', ' ', '4'}},
                                      {0x581, 8, {0x1B, '0', '2'}}}};

SdoClient waiting_for_text() {
  SdoClient client(1, kTimeout_ns);
  client.upload_text({0x1008, 0});
  client.sent(0);
  return client;
}

TEST(Sdo, ATextInSegments) {
  auto client = waiting_for_text();
  client.on_response(kText[0]);
  EXPECT_EQ(*client.frame_to_send(), (Frame{0x601, 8, {0x60}}));
  client.sent(1);
  client.on_response(kText[1]);
  EXPECT_EQ(*client.frame_to_send(), (Frame{0x601, 8, {0x70}}));
  client.sent(2);
  client.on_response(kText[1]);  // the first one again
  EXPECT_EQ(client.status(), SdoClient::Status::waiting);
  EXPECT_EQ(client.ignored(), 1U);
  client.on_response(kText[2]);
  EXPECT_EQ(client.status(), SdoClient::Status::done);
  EXPECT_EQ(client.text(), "Bevel 402");
}

TEST(Sdo, ATextOfFourCharactersAtOnce) {
  auto client = waiting_for_text();
  client.on_response({0x581, 8, {0x47, 0x08, 0x10, 0x00, '2', '.', '0'}});
  EXPECT_EQ(client.status(), SdoClient::Status::done);
  EXPECT_EQ(client.text(), "2.0");
}

TEST(Sdo, ATextWithoutAnEndIsAborted) {
  auto client = waiting_for_text();
  client.on_response(kText[0]);
  int segments = 0;
  for (std::uint8_t toggle = 0; client.status() == SdoClient::Status::to_send; toggle ^= 0x10, ++segments) {
    client.sent(0);
    client.on_response({0x581, 8, {toggle, 'a', 'b', 'c', 'd', 'e', 'f', 'g'}});
  }
  EXPECT_EQ(segments, 10);
  EXPECT_EQ(client.status(), SdoClient::Status::aborted);
  EXPECT_EQ(client.text().size(), 63U);
  EXPECT_EQ(client.frame_to_send()->data[0], 0x80);
}

TEST(Sdo, ATextThatEndsHalfWay) {
  auto client = waiting_for_text();
  client.on_response(kText[0]);
  client.sent(0);
  auto refused = client;
  refused.on_response({0x581, 8, {0x80, 0x08, 0x10, 0x00, 0, 0, 4, 5}});
  EXPECT_EQ(refused.status(), SdoClient::Status::aborted);
  client.check_time(kTimeout_ns);
  EXPECT_EQ(client.status(), SdoClient::Status::timed_out);
  EXPECT_EQ(client.frame_to_send()->data[0], 0x80);
}

class Unfit : public testing::TestWithParam<Frame> {};

TEST_P(Unfit, AnswersAreIgnoredUntilTheTimeIsUp) {
  auto client = waiting_for(0x6061);
  client.on_response(GetParam());
  EXPECT_EQ(client.status(), SdoClient::Status::waiting);
  EXPECT_EQ(client.ignored(), 1U);
  client.check_time(kTimeout_ns);
  EXPECT_EQ(client.status(), SdoClient::Status::timed_out);
  const auto abort = client.frame_to_send();
  ASSERT_TRUE(abort.has_value());
  EXPECT_EQ(*abort, (Frame{0x601, 8, {0x80, 0x61, 0x60, 0x00, 0x00, 0x00, 0x04, 0x05}}));
}

INSTANTIATE_TEST_SUITE_P(Answers, Unfit,
                         testing::Values(Frame{0x581, 8, {0x4F, 0x60, 0x60, 0x00, 0x03}},  // wrong index
                                         Frame{0x581, 8, {0x4F, 0x61, 0x60, 0x01, 0x03}},  // wrong sub-index
                                         Frame{0x581, 8, {0x60, 0x61, 0x60, 0x00}},        // answer to a download
                                         Frame{0x581, 4, {0x4F, 0x61, 0x60, 0x00}}));      // too short

TEST(Sdo, LateAndDoubledAnswersAreIgnored) {
  auto client = waiting_for(0x6061);
  const Frame answer{0x581, 8, {0x4F, 0x61, 0x60, 0x00, 0x03}};
  client.on_response(answer);
  client.on_response(answer);
  EXPECT_EQ(client.ignored(), 1U);
  client.cancel();
  client.on_response(answer);
  EXPECT_EQ(client.ignored(), 2U);
  EXPECT_EQ(client.status(), SdoClient::Status::idle);
}

TEST(Sdo, SegmentedAnswersAreAborted) {
  auto client = waiting_for(0x1008);
  client.on_response({0x581, 8, {0x41, 0x08, 0x10, 0x00, 0x20}});
  EXPECT_EQ(client.status(), SdoClient::Status::aborted);
  EXPECT_TRUE(client.frame_to_send().has_value());
}

TEST(Cia402, StatuswordsOfTheStandard) {
  using State = cia402::State;
  for (const std::uint16_t other : {0x0000, 0x0200, 0x8410}) {  // bits that do not belong to the state
    EXPECT_EQ(cia402::decode(0x00 | other), State::not_ready);
    EXPECT_EQ(cia402::decode(0x40 | other), State::switch_on_disabled);
    EXPECT_EQ(cia402::decode(0x21 | other), State::ready_to_switch_on);
    EXPECT_EQ(cia402::decode(0x23 | other), State::switched_on);
    EXPECT_EQ(cia402::decode(0x27 | other), State::operation_enabled);
    EXPECT_EQ(cia402::decode(0x07 | other), State::quick_stop_active);
    EXPECT_EQ(cia402::decode(0x0F | other), State::fault_reaction);
    EXPECT_EQ(cia402::decode(0x08 | other), State::fault);
  }
}

// The master's controlwords against the drive's own machine, from every state towards every goal.
TEST(Cia402, EveryGoalIsReachedFromEveryState) {
  using Drive = rig::PowerStateMachine;
  const auto drive_in = [](Drive::State wanted) {
    Drive drive;
    for (const std::uint16_t word : {0x06, 0x07, 0x0F, 0x02})
      if (drive.state() != wanted) drive.on_controlword(word);
    return drive;
  };
  for (const auto start :
       {Drive::State::switch_on_disabled, Drive::State::ready_to_switch_on, Drive::State::switched_on,
        Drive::State::operation_enabled, Drive::State::quick_stop_active}) {
    const auto end_of = [&](cia402::Goal goal) {
      Drive drive = drive_in(start);
      EXPECT_EQ(drive.state(), start);
      for (int i = 0; i < 6; ++i)
        drive.on_controlword(cia402::controlword_towards(goal, cia402::decode(drive.statusword_bits())));
      return drive.state();
    };
    EXPECT_EQ(end_of(cia402::Goal::enabled), Drive::State::operation_enabled);
    EXPECT_EQ(end_of(cia402::Goal::ready), Drive::State::ready_to_switch_on);
    EXPECT_THAT(end_of(cia402::Goal::stop),
                testing::AnyOf(Drive::State::switch_on_disabled, Drive::State::quick_stop_active));
  }
}

TEST(Cia402, FaultResetNeedsARisingEdge) {
  rig::PowerStateMachine drive;
  drive.on_controlword(0x80);
  drive.on_fault();
  drive.on_controlword(0x80);  // still high: no edge
  EXPECT_EQ(drive.state(), rig::PowerStateMachine::State::fault);
  drive.on_controlword(0x00);
  drive.on_controlword(0x80);
  EXPECT_EQ(drive.state(), rig::PowerStateMachine::State::switch_on_disabled);
}

TEST(Identity, AnotherDeviceIsRefusedBeforeMotion) {
  stepper::StepperConfig config;
  config.axes[1].vendor_id = 0x1234;
  Bench bench(config);
  ASSERT_TRUE(bench.reach(DriverState::fault));
  EXPECT_EQ(bench.reason(), StopReason::wrong_device);
  EXPECT_EQ(bench.report().stop.object, (stepper::cia301::ObjectAddress{0x1018, 1}));
  EXPECT_EQ(bench.report().stop.wanted, 0x1234U);
  EXPECT_EQ(bench.report().stop.axis, 1);
}

TEST(Configuring, AMappingThatReadsBackDifferentlyIsRefused) {
  Bench bench;
  bench.wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x581 && frame.data[0] == 0x43 && frame.data[1] == 0x00 && frame.data[2] == 0x1A)
      frame.data[6] ^= 1;
    return true;
  });
  ASSERT_TRUE(bench.reach(DriverState::fault));
  EXPECT_EQ(bench.reason(), StopReason::configuration_failed);
}

TEST(Configuring, ARefusedWriteNamesItsAbortCode) {
  Bench bench;
  bench.wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x602 && frame.data[0] == 0x2B && frame.data[1] == 0x07) frame.data[4] = 99;  // 6007 = 99
    return true;
  });
  ASSERT_TRUE(bench.reach(DriverState::fault));
  EXPECT_EQ(bench.reason(), StopReason::sdo_aborted);
  EXPECT_EQ(bench.report().stop.code, 0x06090030U);
  EXPECT_EQ(bench.report().stop.object, (stepper::cia301::ObjectAddress{0x6007, 0}));
}

TEST(Configuring, ALostAnswerIsAskedForAgain) {
  Bench bench;
  int lost = 0;
  bench.wire.set_tap([&lost](can::Frame& frame) { return frame.id != 0x581 || ++lost != 7; });
  EXPECT_TRUE(bench.reach(DriverState::ready));
  EXPECT_GE(lost, 7);
}

TEST(Configuring, ADriveThatStopsAnsweringIsReported) {
  Bench bench;
  int answers = 0;
  bench.wire.set_tap([&answers](can::Frame& frame) { return frame.id != 0x581 || ++answers < 7; });
  ASSERT_TRUE(bench.reach(DriverState::fault));
  EXPECT_EQ(bench.reason(), StopReason::sdo_timeout);
  EXPECT_EQ(bench.report().stop.axis, 0);
}

TEST(Configuring, DoubledAnswersDoNoHarm) {
  Bench bench;
  bench.wire.set_tap([&bench](can::Frame& frame) {
    static bool again = false;
    if (frame.id == 0x581 && !again) {
      again = true;
      bench.wire.inject(frame);
      again = false;
    }
    return true;
  });
  ASSERT_TRUE(bench.reach(DriverState::ready)) << to_string(bench.reason());
  EXPECT_GT(bench.report().counters.sdo_ignored, 10U);
}

TEST(Configuring, ADriveThatIsSwitchedOnLaterIsWaitedFor) {
  Bench bench;
  bench.rotation.set_silent(true);
  bench.run_ms(3000);
  EXPECT_EQ(bench.report().state, DriverState::configuring);
  bench.rotation.set_silent(false);
  bench.rotation.power_cycle();
  EXPECT_TRUE(bench.reach(DriverState::ready));
}

TEST(Configuring, AFaultFoundAtTheStartWaitsForTheOperator) {
  Bench bench;
  bench.run_ms(2);
  bench.insertion.raise_fault(0x7305);
  ASSERT_TRUE(bench.reach(DriverState::fault));
  EXPECT_EQ(bench.reason(), StopReason::drive_fault);
  bench.run_ms(1000);
  EXPECT_EQ(bench.insertion.state(), rig::PowerStateMachine::State::fault);
  ASSERT_TRUE(bench.driver->rearm());
  EXPECT_TRUE(bench.reach(DriverState::ready)) << to_string(bench.reason());
}

// The drive's rules, with raw frames: the driver alone would never break them.
TEST_F(RawDrive, AbortCodes) {
  EXPECT_EQ(abort_of(write(0x40, 0x1000, 0, 0)), 0U);
  EXPECT_EQ(abort_of(write(0x40, 0x5FFF, 0, 0)), 0x06020000U);
  EXPECT_EQ(abort_of(write(0x40, 0x1018, 9, 0)), 0x06090011U);
  EXPECT_EQ(abort_of(write(0x23, 0x1000, 0, 1)), 0x06010002U);
  EXPECT_EQ(abort_of(write(0x23, 0x6040, 0, 1)), 0x06070012U);
  EXPECT_EQ(abort_of(write(0x2F, 0x60FF, 0, 1)), 0x06070013U);
  EXPECT_EQ(abort_of(write(0x2B, 0x6007, 0, 9)), 0x06090030U);
  EXPECT_EQ(abort_of(write(0xE0, 0x1000, 0, 0)), 0x05040001U);
}

TEST_F(RawDrive, MappingRules) {
  EXPECT_EQ(abort_of(write(0x23, 0x1A00, 1, 0x10170010)), 0x06040041U);
  EXPECT_EQ(abort_of(write(0x23, 0x1A00, 1, 0x60640020)), 0U);
  EXPECT_EQ(abort_of(write(0x23, 0x1A00, 2, 0x606C0020)), 0U);
  EXPECT_EQ(abort_of(write(0x23, 0x1A00, 3, 0x60410010)), 0U);
  EXPECT_EQ(abort_of(write(0x2F, 0x1A00, 0, 3)), 0x06040042U);
  EXPECT_EQ(abort_of(write(0x2F, 0x1A00, 0, 2)), 0U);
  EXPECT_EQ(abort_of(write(0x23, 0x1A00, 1, 0x60640020)), 0x08000022U);  // filled while counted
  EXPECT_EQ(abort_of(write(0x23, 0x1800, 1, 0x181)), 0U);
  EXPECT_EQ(abort_of(write(0x2F, 0x1A00, 0, 0)), 0x08000022U);  // changed while switched on
}

}  // namespace
}  // namespace bevel::test
