// A bad line by the kernel itself: the driver on one end of a vxcan pair, the drives on the other, and netem between
// them. (On a vcan netem changes nothing: what its sockets hear never passes a queue.) Run through on_can.sh.
#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>

#include "rig/drives/simulated_drive.hpp"
#include "tests/drives/driven_by_can.hpp"

namespace bevel::test {
namespace {

const std::string kDriverEnd = "bevelx0", kDriveEnd = "bevelx1";

class Vxcan : public testing::Test {
 protected:
  void SetUp() override {
    if (!ip("link add " + kDriverEnd + " type vxcan peer name " + kDriveEnd) || !ip("link set " + kDriverEnd + " up") ||
        !ip("link set " + kDriveEnd + " up"))
      GTEST_SKIP() << "SKIPPED: this kernel has no vxcan, or it is not permitted to add one";
    if (!spoil(kDriverEnd, "loss 0%") || !spoil(kDriveEnd, "loss 0%"))
      GTEST_SKIP() << "SKIPPED: this kernel has no netem, or there is no tc";
    insertion_bus_ = can::open_bus(kDriveEnd);
    rotation_bus_ = can::open_bus(kDriveEnd);
    insertion = std::make_unique<rig::SimulatedDrive>(
        *insertion_bus_, rig::SimulatedDriveConfig{1, patient().axes[0].counts_per_unit, 0.004, {}, {}});
    rotation = std::make_unique<rig::SimulatedDrive>(
        *rotation_bus_, rig::SimulatedDriveConfig{2, patient().axes[1].counts_per_unit, 0.004, {}, {}});
    master = std::make_unique<DrivenByCan>(patient(), kDriverEnd);
    ASSERT_TRUE(run_until([&] { return state() == DriverState::ready; })) << describe(stop());
    ASSERT_EQ(master->driver.enable(), stepper::EnableAnswer::accepted);
    ASSERT_TRUE(run_until([&] { return state() == DriverState::enabled; })) << describe(stop());
    master->insertion_rate_mm_s = 5.0;
    master->rotation_rate_rad_s = 2.0;
    ASSERT_TRUE(run_until([&] { return insertion->position_unit() > 2.0; })) << describe(stop());
  }
  void TearDown() override { ip("link del " + kDriverEnd); }

  // What leaves at this end: netem's own words.
  static bool spoil(const std::string& end, const std::string& how) {
    return std::system(("tc qdisc replace dev " + end + " root netem limit 10000 " + how + " 2>/dev/null").c_str()) ==
           0;
  }
  static bool spoil_both(const std::string& how) { return spoil(kDriverEnd, how) && spoil(kDriveEnd, how); }

  template <typename Condition>
  bool run_until(Condition condition, int limit_ms = 10'000) {
    for (const std::int64_t end_ns = clock_.now_ns() + limit_ms * kMs; !condition();) {
      const std::int64_t now_ns = clock_.pass();
      if (now_ns > end_ns) return false;
      insertion->step(now_ns);
      rotation->step(now_ns);
      master->step(now_ns);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  void run_ms(int ms) {
    run_until([] { return false; }, ms);
  }
  bool at_rest() const { return insertion->velocity_unit_s() == 0.0 && rotation->velocity_unit_s() == 0.0; }
  DriverState state() const { return master->driver.report().state; }
  stepper::Stop stop() const { return master->driver.report().stop; }

  // Stopped for good: the line repaired, the commands still fresh, and nothing moves.
  void expect_latched_at_rest() {
    EXPECT_TRUE(run_until([this] { return state() >= DriverState::stopped; }, 3000));
    EXPECT_TRUE(run_until([this] { return at_rest(); }, 3000)) << describe(stop());
    ASSERT_TRUE(spoil_both("loss 0%"));
    run_ms(300);
    const double rests_mm = insertion->position_unit();
    run_ms(1000);
    EXPECT_GE(state(), DriverState::stopped);
    EXPECT_NEAR(insertion->position_unit(), rests_mm, 1e-3);
  }
  // Borne: on its way, and the driver knows where.
  void expect_borne() {
    const double before_mm = insertion->position_unit();
    run_ms(3000);
    EXPECT_EQ(state(), DriverState::enabled) << describe(stop());
    EXPECT_GT(insertion->position_unit(), before_mm + 10.0);
    EXPECT_NEAR(master->driver.report().insertion_mm, insertion->position_unit(), 1.0);
  }

  Clock clock_;
  std::unique_ptr<can::Bus> insertion_bus_, rotation_bus_;

 public:
  std::unique_ptr<rig::SimulatedDrive> insertion, rotation;
  std::unique_ptr<DrivenByCan> master;
};

TEST_F(Vxcan, AFewFramesLostAreBorne) {
  ASSERT_TRUE(spoil_both("loss 1%"));
  expect_borne();
}

TEST_F(Vxcan, AFewFramesDoubledAreBorne) {
  ASSERT_TRUE(spoil_both("duplicate 1%"));
  expect_borne();
}

TEST_F(Vxcan, AllFramesDoubledIsALatchedStop) {
  ASSERT_TRUE(spoil_both("duplicate 100%"));
  expect_latched_at_rest();
  EXPECT_EQ(stop().reason, StopReason::second_drive);
}

TEST_F(Vxcan, FramesLateByLessThanAPeriodAreBorne) {
  ASSERT_TRUE(spoil_both("delay 5ms 3ms"));
  expect_borne();
}

TEST_F(Vxcan, AnswersLostAreALatchedStop) {
  ASSERT_TRUE(spoil(kDriveEnd, "loss 100%"));
  expect_latched_at_rest();
  EXPECT_THAT(stop().reason, testing::AnyOf(StopReason::pdo_lost, StopReason::drive_heartbeat_lost));
}

// The drives hear nothing, and stop by themselves; what they say about it is the driver's stop.
TEST_F(Vxcan, CommandsLostStopTheDrivesByThemselves) {
  ASSERT_TRUE(spoil(kDriverEnd, "loss 100%"));
  EXPECT_TRUE(run_until([this] { return at_rest(); }, 3000));
  EXPECT_EQ(insertion->state(), rig::PowerStateMachine::State::quick_stop_active);
  EXPECT_EQ(rotation->state(), rig::PowerStateMachine::State::quick_stop_active);
  expect_latched_at_rest();
}

TEST_F(Vxcan, AnswersLateByMoreThanTheirTimeOutAreALatchedStop) {
  ASSERT_TRUE(spoil(kDriveEnd, "delay 600ms"));
  expect_latched_at_rest();
  EXPECT_THAT(stop().reason, testing::AnyOf(StopReason::pdo_lost, StopReason::drive_heartbeat_lost));
}

// Commands that wait in the kernel, with velocities of before the stop among them: once the stop has come through, no
// old one moves anything.
TEST_F(Vxcan, CommandsLateByHalfASecondStopLaterAndForGood) {
  ASSERT_TRUE(spoil(kDriverEnd, "delay 500ms"));
  run_ms(100);
  master->driver.stop_now(StopReason::operator_stop, clock_.now_ns());
  expect_latched_at_rest();
  EXPECT_EQ(stop().reason, StopReason::operator_stop);
}

// One bit in any part of the frame: another identifier, another length, another value. Borne or stopped; and the
// controller's zero is obeyed, or the stop.
TEST_F(Vxcan, CorruptedFramesNeverLetTheAxesRunOn) {
  ASSERT_TRUE(spoil_both("corrupt 3%"));
  run_ms(3000);
  master->driver.stop_now(StopReason::operator_stop, clock_.now_ns());
  expect_latched_at_rest();
}

}  // namespace
}  // namespace bevel::test
