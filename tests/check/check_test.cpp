// SPDX-License-Identifier: MIT
// bevel-check against simulated drives in simulated time: a good rig, and each thing broken in turn.
#include <gmock/gmock.h>

#include <bevel/drivers/can/memory_bus.hpp>
#include <bevel/drivers/commissioning/bus_probe.hpp>
#include <bevel/drivers/commissioning/judgement.hpp>
#include <bevel/rig/drives/simulated_drive.hpp>

namespace bevel::drivers {
namespace {

using stepper::kMs;
using testing::HasSubstr;

class Check : public testing::Test {
 protected:
  Findings run() {
    BusProbe probe(*bus, config);
    for (int ms = 0; ms < 10'000 && !probe.done(); ++ms) {
      now_ns += kMs;
      if (each_ms) each_ms();
      for (auto& drive : drives) drive.step(now_ns);
      probe.step(now_ns);
    }
    EXPECT_TRUE(probe.done()) << "it ends, whatever is broken";
    return judge_bus(probe.measured(), config, "can0", "rig.toml");
  }
  // The one finding that failed.
  static Finding failed(const Findings& findings) {
    Finding found;
    for (const Finding& finding : findings) {
      if (finding.verdict != Verdict::failed) continue;
      EXPECT_EQ(found.name, "") << to_text(findings);
      found = finding;
    }
    EXPECT_NE(found.name, "") << to_text(findings);
    EXPECT_NE(found.remedy, "");
    return found;
  }

  stepper::StepperConfig config;
  can::MemoryNetwork wire;
  std::unique_ptr<can::MemoryBus> bus = wire.attach();
  std::array<std::unique_ptr<can::MemoryBus>, 2> drive_buses{wire.attach(), wire.attach()};
  std::array<rig::SimulatedDrive, 2> drives{rig::SimulatedDrive(*drive_buses[0], {1}),
                                            rig::SimulatedDrive(*drive_buses[1], {2})};
  std::function<void()> each_ms;
  std::int64_t now_ns = 1000 * kMs;
};

TEST_F(Check, AGoodRig) {
  const Findings findings = run();
  EXPECT_FALSE(any_failed(findings)) << to_text(findings);
  ASSERT_EQ(findings.size(), 8U);
  for (const Finding& finding : findings)
    EXPECT_EQ(finding.verdict, finding.name == "rotation scale" ? Verdict::not_tried : Verdict::ok)
        << to_text(findings);
  EXPECT_THAT(findings[1].measured, HasSubstr("Bevel simulated stepper drive, type 0x40192, vendor 0xBEE"));
  EXPECT_THAT(findings[2].measured, HasSubstr("1 velocity units in one count/s"));
  EXPECT_THAT(findings[3].measured, HasSubstr("longest silence 30 ms"));
  EXPECT_THAT(findings[6].measured, HasSubstr("ratio 1.0000"));
}

TEST_F(Check, LeavesTheDrivesAsTheyWere) {
  run();
  for (const auto& drive : drives) {
    EXPECT_EQ(drive.objects().get(0x1017), 0U);
    EXPECT_EQ(drive.nmt_state(), rig::NmtState::pre_operational);
    EXPECT_EQ(drive.state(), rig::PowerStateMachine::State::switch_on_disabled);
  }
}

TEST_F(Check, SendsNothingWhereAMasterCommands) {
  each_ms = [this] {
    if (now_ns / kMs % 10 == 0) wire.inject({0x080, 0, {}});
    if (now_ns / kMs % 30 == 0) wire.inject({0x701, 1, {0x05}});
    if (now_ns / kMs % 30 == 0) wire.inject({0x702, 1, {0x05}});
  };
  const Findings findings = run();
  EXPECT_EQ(bus->counters().sent, 0U);
  EXPECT_FALSE(any_failed(findings)) << to_text(findings);
  EXPECT_EQ(findings[1].verdict, Verdict::not_tried);
  EXPECT_THAT(findings[1].measured, HasSubstr("a master commands the drives (heard 0x80)"));
  EXPECT_EQ(findings[2].verdict, Verdict::ok) << "heartbeats are listened to";
}

TEST_F(Check, NoBus) {
  wire.set_link_up(false);
  const Finding finding = failed(run());
  EXPECT_EQ(finding.name, "bus can0");
  EXPECT_THAT(finding.remedy, HasSubstr("ip link set can0 up type can bitrate"));
}

TEST_F(Check, NobodyAcknowledges) {
  wire.set_acknowledged(false);
  const Findings findings = run();
  EXPECT_EQ(findings[0].verdict, Verdict::failed);
  EXPECT_THAT(findings[0].measured, HasSubstr("4 sent, 4 of them never on the wire"));
  EXPECT_THAT(findings[0].remedy, HasSubstr("nobody acknowledges"));
}

TEST_F(Check, ErrorPassive) {
  each_ms = [this] {
    if (now_ns == 1500 * kMs) wire.raise(can::BusEvent::error_passive);
  };
  EXPECT_THAT(failed(run()).measured, HasSubstr("error-passive"));
}

TEST_F(Check, ADriveThatIsSwitchedOff) {
  drives[1].set_silent(true);
  const Finding finding = failed(run());
  EXPECT_EQ(finding.name, "rotation drive");
  EXPECT_EQ(finding.measured, "node 2 does not answer");
  EXPECT_THAT(finding.remedy, HasSubstr("node_id of stepper.rotation in rig.toml"));
}

TEST_F(Check, AnotherDeviceWithItsNodeId) {
  wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x581 && frame.data[1] == 0x00 && frame.data[2] == 0x10) frame.data[4] = 0x91;
    return true;
  });
  EXPECT_THAT(failed(run()).remedy, HasSubstr("another device"));
}

TEST_F(Check, AnotherVendorThanTheSystemFileNames) {
  config.axes[0].vendor_id = 0x1234;
  const Finding finding = failed(run());
  EXPECT_THAT(finding.allowed, HasSubstr("vendor_id 0x1234"));
  EXPECT_THAT(finding.remedy, HasSubstr("vendor_id = 0xBEE of stepper.insertion in rig.toml"));
}

TEST_F(Check, AModeThatTheDriveDoesNotHave) {
  wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x581 && frame.data[1] == 0x02 && frame.data[2] == 0x65) frame.data[5] = 0;
    return true;
  });
  EXPECT_FALSE(any_failed(run())) << "profile velocity is there";
  config.mode = stepper::VelocityMode::cyclic;
  bus = wire.attach();
  EXPECT_THAT(failed(run()).remedy, HasSubstr("mode of [stepper]"));
}

TEST_F(Check, AVelocityUnitInRpm) {
  rig::SimulatedDriveConfig rpm;
  rpm.dialect.velocity_unit = 0x00B44700;
  rig::SimulatedDrive drive(*drive_buses[0], rpm);
  drives[0].set_silent(true);
  each_ms = [&] { drive.step(now_ns); };
  const Finding finding = failed(run());
  EXPECT_EQ(finding.name, "insertion velocity unit");
  EXPECT_THAT(finding.measured, HasSubstr("60A9 0x00B44700, 6096 absent; not usable"));
  EXPECT_THAT(finding.remedy, HasSubstr("set counts_per_revolution"));
  config.axes[0].counts_per_revolution = 51200.0;
  bus = wire.attach();
  EXPECT_FALSE(any_failed(run()));
}

TEST_F(Check, HeartbeatsWithGaps) {
  int heartbeats = 0;
  wire.set_tap([&](can::Frame& frame) { return frame.id != 0x701 || ++heartbeats % 10 > 2; });
  const Finding finding = failed(run());
  EXPECT_EQ(finding.name, "insertion heartbeat");
  EXPECT_THAT(finding.measured, HasSubstr("longest silence 120 ms"));
}

TEST_F(Check, NoHeartbeatAtAll) {
  wire.set_tap([](can::Frame& frame) { return frame.id != 0x702; });
  const Finding finding = failed(run());
  EXPECT_EQ(finding.name, "rotation heartbeat");
  EXPECT_THAT(finding.remedy, HasSubstr("cannot be supervised"));
}

TEST(Judge, Multicast) {
  EXPECT_EQ(judge_multicast({true, 20, 20, 1 * kMs}).verdict, Verdict::ok);
  for (const MulticastMeasured& bad :
       {MulticastMeasured{}, MulticastMeasured{true, 4, 0, 0}, MulticastMeasured{true, 20, 19, kMs},
        MulticastMeasured{true, 20, 20, 30 * kMs}}) {
    const Finding finding = judge_multicast(bad);
    EXPECT_EQ(finding.verdict, Verdict::failed) << finding.measured;
    EXPECT_THAT(finding.remedy, HasSubstr(bad.heard == bad.sent && bad.started ? "end what else" : "ip route add"));
  }
}

TEST(Judge, Timer) {
  std::vector<std::int64_t> lateness_ns(100, 200'000);
  lateness_ns[7] = 40 * kMs;  // one in a hundred is the machine's, not the loop's
  EXPECT_EQ(judge_timer(lateness_ns, 10 * kMs, true).verdict, Verdict::ok);
  lateness_ns[8] = lateness_ns[9] = 6 * kMs;
  const Finding finding = judge_timer(lateness_ns, 10 * kMs, false);
  EXPECT_EQ(finding.verdict, Verdict::failed) << finding.measured;
  EXPECT_THAT(finding.remedy, HasSubstr("setcap cap_sys_nice"));
}

TEST(Judge, Cameras) {
  EXPECT_EQ(judge_cameras({}, {0, 1}, 1500 * kMs, 100 * kMs).front().verdict, Verdict::not_tried);
  const Findings findings = judge_cameras({{0, {45, 40 * kMs}}, {1, {6, 260 * kMs}}}, {0, 1, 2}, 1500 * kMs, 100 * kMs);
  ASSERT_EQ(findings.size(), 3U);
  EXPECT_EQ(findings[0].verdict, Verdict::ok);
  EXPECT_EQ(findings[1].verdict, Verdict::failed);
  EXPECT_THAT(findings[1].measured, HasSubstr("4.0 pictures a second, longest silence 260 ms"));
  EXPECT_THAT(findings[2].measured, HasSubstr("0.0 pictures a second, longest silence 1500 ms"));
}

}  // namespace
}  // namespace bevel::drivers
