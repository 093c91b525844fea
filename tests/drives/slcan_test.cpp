// SPDX-License-Identifier: MIT
// A CAN controller that goes passive or off the bus, and a queue that nobody empties: the kernel's slcan driver on a
// pseudo-terminal says so, as hardware would. Run through on_can.sh.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <bevel/drivers/can/memory_bus.hpp>
#include <bevel/rig/drives/simulated_drive.hpp>
#include "tests/drives/driven_by_can.hpp"

namespace bevel::test {
namespace {

// asm/termbits.h has it, which does not go with termios.h.
#ifndef N_SLCAN
constexpr int N_SLCAN = 17;
#endif

// A CAN controller whose states are ours to say: the kernel's slcan driver on a pseudo-terminal.
class SlCan : public testing::Test {
 protected:
  void SetUp() override {
    terminal_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    ASSERT_GE(terminal_, 0);
    ASSERT_EQ(grantpt(terminal_) | unlockpt(terminal_), 0);
    line_ = ::open(ptsname(terminal_), O_RDWR | O_NOCTTY);
    ASSERT_GE(line_, 0);
    termios settings{};
    tcgetattr(line_, &settings);
    cfmakeraw(&settings);
    tcsetattr(line_, TCSANOW, &settings);
    const int discipline = N_SLCAN;
    if (ioctl(line_, TIOCSETD, &discipline) != 0) GTEST_SKIP() << "SKIPPED: this kernel has no slcan";
    ifreq request{};
    ASSERT_EQ(ioctl(line_, SIOCGIFNAME, request.ifr_name), 0);
    interface_ = request.ifr_name;
    if (!ip("link set " + interface_ + " up")) GTEST_SKIP() << "SKIPPED: not permitted to set " << interface_ << " up";
    bus_ = can::open_bus(interface_);
    ASSERT_TRUE(bus_->is_open());
  }
  void TearDown() override {
    master_.reset();
    bus_.reset();
    if (line_ >= 0) ::close(line_);
    if (terminal_ >= 0) ::close(terminal_);
  }
  void controller_says(const std::string& word) {
    ASSERT_EQ(::write(terminal_, word.data(), word.size()), static_cast<ssize_t>(word.size()));
  }
  // The first event within a second.
  std::optional<can::BusEvent> event() {
    for (int ms = 0; ms < 1000; ++ms) {
      for (auto found = bus_->receive(); found.kind != can::Reception::Kind::nothing; found = bus_->receive())
        if (found.kind == can::Reception::Kind::event) return found.event;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return std::nullopt;
  }

  int terminal_ = -1, line_ = -1;
  std::string interface_;
  std::unique_ptr<can::Bus> bus_;
  std::unique_ptr<DrivenByCan> master_;
};

TEST_F(SlCan, StatesOfTheControllerAreEvents) {
  controller_says("sp130050\r");  // passive: 130 errors heard, 50 made
  EXPECT_EQ(event(), can::BusEvent::error_passive);
  controller_says("sb000256\r");
  EXPECT_EQ(event(), can::BusEvent::bus_off);
  EXPECT_GE(bus_->counters().error_frames, 2U);
}

// Two simulated drives behind the terminal, in the adapter's own language: "t" identifier length data, in hexadecimal.
class DrivesBehindTheLine {
 public:
  DrivesBehindTheLine(int terminal, const StepperConfig& config)
      : insertion(*buses_[0], {1, config.axes[0].counts_per_unit, 0.004, {}, {}}),
        rotation(*buses_[1], {2, config.axes[1].counts_per_unit, 0.004, {}, {}}),
        terminal_(terminal) {}

  void step(std::int64_t now_ns) {
    std::array<char, 4096> bytes{};
    for (ssize_t got = 0; (got = ::read(terminal_, bytes.data(), bytes.size())) > 0;)
      text_.append(bytes.data(), static_cast<std::size_t>(got));
    for (auto end = text_.find('\r'); end != std::string::npos; end = text_.find('\r')) {
      if (text_.front() == 't') hear(text_.substr(0, end));
      text_.erase(0, end + 1);
    }
    insertion.step(now_ns);
    rotation.step(now_ns);
    for (auto found = master_->receive(); found.kind != can::Reception::Kind::nothing; found = master_->receive())
      if (found.kind == can::Reception::Kind::frame) say(found.frame);
  }

 private:
  can::MemoryNetwork wire_;
  std::unique_ptr<can::MemoryBus> master_ = wire_.attach();
  std::array<std::unique_ptr<can::MemoryBus>, 2> buses_{wire_.attach(), wire_.attach()};

 public:
  rig::SimulatedDrive insertion;
  rig::SimulatedDrive rotation;
  int velocities_heard = 0;  // commands with one other than zero

 private:
  void hear(const std::string& line) {
    can::Frame frame;
    frame.id = static_cast<std::uint32_t>(std::stoul(line.substr(1, 3), nullptr, 16));
    frame.size = static_cast<std::uint8_t>(line.at(4) - '0');
    for (std::size_t i = 0; i < frame.size; ++i)
      frame.data.at(i) = static_cast<std::uint8_t>(std::stoul(line.substr(5 + 2 * i, 2), nullptr, 16));
    if ((frame.id == 0x201 || frame.id == 0x202) && stepper::cia301::get_u32(frame, 2) != 0) ++velocities_heard;
    (void)master_->send(frame);
  }
  void say(const can::Frame& frame) {
    std::array<char, 32> line{};
    int size = std::snprintf(line.data(), line.size(), "t%03X%d", frame.id, frame.size);
    for (std::size_t i = 0; i < frame.size; ++i)
      size += std::snprintf(line.data() + size, line.size() - static_cast<std::size_t>(size), "%02X", frame.data.at(i));
    line.at(static_cast<std::size_t>(size++)) = '\r';
    (void)!::write(terminal_, line.data(), static_cast<std::size_t>(size));
  }

  int terminal_;
  std::string text_;
};

TEST_F(SlCan, ABusOffInFlightIsALatchedStopAndNothingOldIsSentAfterIt) {
  bus_.reset();
  Clock clock;
  DrivesBehindTheLine drives(terminal_, patient());
  master_ = std::make_unique<DrivenByCan>(patient(), interface_);
  const auto run_until = [&](auto condition, int limit_ms = 10'000) {
    for (const std::int64_t end_ns = clock.now_ns() + limit_ms * kMs; !condition() && clock.now_ns() < end_ns;) {
      const std::int64_t now_ns = clock.pass();
      drives.step(now_ns);
      master_->step(now_ns);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return condition();
  };
  const auto report = [this] { return master_->driver.report(); };
  ASSERT_TRUE(run_until([&] { return report().state == DriverState::ready; })) << describe(report().stop);
  ASSERT_EQ(master_->driver.enable(), stepper::EnableAnswer::accepted);
  ASSERT_TRUE(run_until([&] { return report().state == DriverState::enabled; })) << describe(report().stop);
  master_->insertion_rate_mm_s = 5.0;
  master_->rotation_rate_rad_s = 2.0;
  ASSERT_TRUE(run_until([&] { return drives.insertion.position_unit() > 2.0; })) << describe(report().stop);
  controller_says("sb000256\r");
  EXPECT_TRUE(run_until([&] { return report().state == DriverState::stopped; }));
  EXPECT_EQ(report().stop.reason, StopReason::bus_off);
  EXPECT_GE(report().counters.purges, 1U);
  // The one that was on the line when the controller went off, and none after it.
  run_until([] { return false; }, 20);
  const int before = drives.velocities_heard;
  EXPECT_TRUE(run_until(
      [&] { return drives.insertion.velocity_unit_s() == 0 && drives.rotation.velocity_unit_s() == 0; }, 3000));
  run_until([] { return false; }, 1000);
  EXPECT_EQ(drives.velocities_heard, before);
  EXPECT_TRUE(master_->bus->is_open()) << "reopened, and still stopped";
  EXPECT_GE(report().state, DriverState::stopped);
  EXPECT_EQ(report().stop.reason, StopReason::bus_off);
}

// Nobody takes what is written: the queue fills, is refused, and nothing blocks.
TEST_F(SlCan, AFullQueueIsRefusedAndCounted) {
  using namespace std::chrono;
  const auto begun = steady_clock::now();
  can::SendResult last = can::SendResult::sent;
  for (int i = 0; i < 20'000 && last == can::SendResult::sent; ++i) last = bus_->send({0x201, 8, {}});
  EXPECT_EQ(last, can::SendResult::queue_full);
  EXPECT_GE(bus_->counters().queue_full, 1U);
  EXPECT_LT(steady_clock::now() - begun, seconds(10));
}

}  // namespace
}  // namespace bevel::test
