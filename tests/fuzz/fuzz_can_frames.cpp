// SPDX-License-Identifier: MIT
// Arbitrary frames, faults and orders, in arbitrary order, for the stepper driver and two simulated drives on one wire.
// Whatever happens: nothing is enabled without an enable() that was accepted, a latched stop lasts until rearm(), and
// no commanded rate is above its limit or changes faster than its acceleration.
//
// Input: one byte for the start, then operations of one byte, each with its arguments.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include <bevel/drivers/can/memory_bus.hpp>
#include <bevel/drivers/stepper/stepper_driver.hpp>
#include <bevel/rig/drives/simulated_drive.hpp>
#include "tests/fuzz/fuzz_support.hpp"

namespace bevel::fuzz {
namespace {

using can::Frame;
using stepper::DriverState;
using stepper::kAxes;
using stepper::kMs;

bool is_latched(DriverState state) { return state == DriverState::stopped || state == DriverState::fault; }

// The driver's bus, with a look at every command that leaves it.
class WatchedBus final : public can::Bus {
 public:
  WatchedBus(can::MemoryNetwork& wire, const stepper::StepperConfig& config) : config_(config), bus_(wire.attach()) {}

  can::SendResult send(const Frame& frame) override {
    BEVEL_MUST(frame.id <= can::kMaxId && frame.size <= 8);
    for (std::size_t axis = 0; axis < kAxes; ++axis)
      if (frame.id == 0x200U + config_.axes.at(axis).node_id) on_command(axis, frame);
    return bus_->send(frame);
  }
  can::Reception receive() override { return bus_->receive(); }
  bool purge() override { return bus_->purge(); }
  void maintain(std::int64_t now_ns) override { bus_->maintain(now_ns); }
  bool is_open() const override { return bus_->is_open(); }
  int poll_fd() const override { return -1; }
  const can::BusCounters& counters() const override { return bus_->counters(); }

  bool enable_accepted = false;  // and since then neither disabled nor stopped

 private:
  void on_command(std::size_t axis, const Frame& frame) {
    const stepper::AxisConfig& limits = config_.axes.at(axis);
    BEVEL_MUST(frame.size == 6);
    const auto word = static_cast<std::uint16_t>(frame.data[0] | frame.data[1] << 8);
    std::uint32_t raw = 0;
    std::memcpy(&raw, frame.data.data() + 2, sizeof raw);
    const auto rate = static_cast<double>(static_cast<std::int32_t>(raw));
    constexpr double kRounding = 1.0;  // counts/s: both are whole numbers
    const double counts = std::abs(limits.counts_per_unit);
    const double largest_change = limits.acceleration_unit_s2 * counts * 2e-9 * static_cast<double>(config_.period_ns);
    // Motion and torque are for those who were allowed them.
    BEVEL_MUST(enable_accepted || (rate == 0 && word != 0x0F));
    BEVEL_MUST(std::abs(rate) <= limits.rate_limit_unit_s * counts + kRounding);
    BEVEL_MUST(rate == 0 || std::abs(rate - last_rate_.at(axis)) <= largest_change + kRounding);
    last_rate_.at(axis) = rate;
  }

  const stepper::StepperConfig& config_;
  std::unique_ptr<can::MemoryBus> bus_;
  std::array<double, kAxes> last_rate_{};
};

stepper::StepperConfig quick_config() {
  stepper::StepperConfig config;
  config.listen_ns = config.master_heartbeat_ns;  // less waiting in each input
  config.axes[0].position_min_unit = -5;
  config.axes[0].position_max_unit = 150;
  return config;
}

rig::SimulatedDriveConfig drive_config(const stepper::AxisConfig& axis) {
  rig::SimulatedDriveConfig drive;
  drive.node_id = axis.node_id;
  drive.counts_per_unit = axis.counts_per_unit;
  return drive;
}

class Bench {
 public:
  explicit Bench(Input& input) : input_(input) {
    wire_.set_tap([this](Frame& frame) { return on_wire(frame); });
  }

  void run() {
    const unsigned start = input_.byte() % 4;
    drives_run_ = start != 0;
    if (start >= 2) run_until(DriverState::ready);
    if (start == 3) {
      enable();
      run_until(DriverState::enabled);
    }
    for (int steps = 0; !input_.empty() && steps < kMostSteps; ++steps) operate();
    for (int i = 0; i < 3; ++i) cycle();
  }

 private:
  static constexpr int kMostSteps = 400;

  void run_until(DriverState state) {
    for (int i = 0; i < 400 && driver_.report().state != state; ++i) cycle();
    BEVEL_MUST(driver_.report().state == state);  // undisturbed so far
  }

  void operate() {
    switch (input_.byte() % 16) {
      case 0:
      case 1:
      case 2:
        for (int i = input_.byte() % 32; i >= 0; --i) cycle();
        break;
      case 3:
      case 4:
        inject();
        break;
      case 5:
        inject_answer();
        break;
      case 6:
        enable();
        break;
      case 7:
        driver_.disable();
        bus_.enable_accepted = false;
        break;
      case 8:
        driver_.stop_now(stepper::StopReason::operator_stop, now_ns_);
        BEVEL_MUST(is_latched(driver_.report().state));
        bus_.enable_accepted = false;
        break;
      case 9: {
        const bool was_latched = is_latched(driver_.report().state);
        BEVEL_MUST(driver_.rearm() == was_latched);
        if (was_latched) BEVEL_MUST(!is_latched(driver_.report().state));
        latched_ = false;
        break;
      }
      case 10:
        setpoint_.reset();
        break;
      case 11:
        take_setpoint();
        break;
      case 12:
        disturb_bus();
        break;
      case 13:
        disturb_drive();
        break;
      case 14:
        input_.byte() % 2 == 0 ? driver_.set_zero() : driver_.confirm_position();
        break;
      default:
        now_ns_ += std::int64_t{input_.take<std::uint16_t>()} * 10'000;  // a step that comes late, up to 0.66 s
        break;
    }
    check();
  }

  void cycle() {
    now_ns_ += config_.period_ns;
    if (drives_run_)
      for (auto* drive : {&insertion_, &rotation_}) drive->step(now_ns_);
    if (setpoint_ && setpoint_->age_ns < std::int64_t{1} << 60) setpoint_->age_ns += aging_ns_;
    driver_.step(now_ns_, setpoint_);
    check();
  }

  void enable() {
    const bool ready = driver_.report().state == DriverState::ready;
    const auto answer = driver_.enable();
    BEVEL_MUST(ready || answer == stepper::EnableAnswer::not_ready);
    if (answer == stepper::EnableAnswer::accepted) {
      bus_.enable_accepted = true;
      ever_enabled_ = true;
    }
  }

  void check() {
    const stepper::AxesReport report = driver_.report();
    if (is_latched(report.state)) bus_.enable_accepted = false;
    BEVEL_MUST(report.state != DriverState::enabled || bus_.enable_accepted);
    BEVEL_MUST(!latched_ || is_latched(report.state));
    latched_ = is_latched(report.state);
    BEVEL_MUST(!latched_ || report.stop.reason != stepper::StopReason::none);
    BEVEL_MUST(report.state != DriverState::stopped || !is_fault(report.stop.reason));
    BEVEL_MUST(report.state != DriverState::enabled || report.stop.reason == stepper::StopReason::none);
    BEVEL_MUST(std::isfinite(report.insertion_mm) && std::isfinite(report.rotation_rad));
    BEVEL_MUST(std::isfinite(report.insertion_rate_mm_s) && std::isfinite(report.rotation_rate_rad_s));
    BEVEL_MUST(report.sampled_ns <= now_ns_);
    BEVEL_MUST(!stepper::describe(report.stop).empty());
    for (const auto status : report.status)
      BEVEL_MUST(status >= stepper::AxisStatus::off && status <= stepper::AxisStatus::fault);
    for (const auto* drive : {&insertion_, &rotation_}) {
      BEVEL_MUST(std::isfinite(drive->position_unit()) && std::isfinite(drive->velocity_unit_s()));
      // Nobody but the driver spoke, and it was never enabled: no drive has torque.
      const bool quiet = foreign_ == 0 && !ever_enabled_;
      BEVEL_MUST(!quiet || drive->state() != rig::PowerStateMachine::State::operation_enabled);
    }
  }

  void inject() {
    Frame frame{input_.take<std::uint16_t>() & can::kMaxId, 0, {}};
    frame.size = input_.byte() % 9;
    for (std::size_t i = 0; i < frame.size; ++i) frame.data.at(i) = input_.byte();
    ++foreign_;
    wire_.inject(frame);
  }

  // As a drive would answer, with the object last asked for.
  void inject_answer() {
    const std::uint8_t shape = input_.byte();
    Frame frame = last_request_;
    frame.id = 0x580U + (frame.id & 0x7FU);
    frame.size = 8;
    frame.data[0] = input_.byte();
    for (std::size_t i = 4; i < 8; ++i) frame.data.at(i) = input_.byte();
    if (shape % 4 == 1) frame.size = shape / 4 % 9;
    for (std::size_t i = frame.size; i < 8; ++i) frame.data.at(i) = 0;
    ++foreign_;
    wire_.inject(frame);
  }

  void take_setpoint() {
    stepper::MotionSetpoint wanted;
    const std::uint8_t shape = input_.byte();
    wanted.run = (shape & 1U) != 0;
    const auto rate = [&] { return (shape & 2U) != 0 ? input_.take<double>() : 0.25 * input_.take<std::int8_t>(); };
    wanted.insertion_rate_mm_s = rate();
    wanted.rotation_rate_rad_s = rate();
    if ((shape & 4U) != 0) wanted.age_ns = input_.take<std::int64_t>();
    aging_ns_ = (shape & 8U) != 0 ? config_.period_ns : 0;
    setpoint_ = wanted;
  }

  void disturb_bus() {
    const std::uint8_t what = input_.byte();
    switch (what % 5) {
      case 0:
        wire_.set_link_up(what / 5 % 2 == 0);
        break;
      case 1:
        wire_.set_acknowledged(what / 5 % 2 == 0);
        break;
      case 2:
        wire_.raise(static_cast<can::BusEvent>(what / 5 % 7));
        break;
      case 3:
        lose_ = what / 5 % 4;
        break;
      default:
        alter_ = what / 5;
        foreign_ += alter_ != 0 ? 1 : 0;
        break;
    }
  }

  void disturb_drive() {
    const std::uint8_t what = input_.byte();
    rig::SimulatedDrive& drive = what % 2 == 0 ? insertion_ : rotation_;
    const bool on = what / 2 % 2 == 0;
    switch (what / 4 % 6) {
      case 0:
        drive.set_silent(on);
        break;
      case 1:
        drive.set_pdos_frozen(on);
        break;
      case 2:
        drive.set_motor_blocked(on);
        break;
      case 3:
        drive.power_cycle();
        break;
      case 4:
        drive.raise_fault(input_.take<std::uint16_t>());
        break;
      default:
        drives_run_ = on;
        break;
    }
  }

  // Loses one of so many frames, or changes a byte of each.
  bool on_wire(Frame& frame) {
    if (frame.id > 0x600 && frame.id < 0x680) last_request_ = frame;
    ++frames_;
    if (alter_ != 0 && frame.size > 0) frame.data.at(frames_ % frame.size) ^= static_cast<std::uint8_t>(alter_);
    return lose_ == 0 || frames_ % (lose_ + 1U) != 0;
  }

  Input& input_;
  stepper::StepperConfig config_ = quick_config();
  can::MemoryNetwork wire_;
  WatchedBus bus_{wire_, config_};
  std::array<std::unique_ptr<can::MemoryBus>, kAxes> drive_buses_{wire_.attach(), wire_.attach()};
  rig::SimulatedDrive insertion_{*drive_buses_[0], drive_config(config_.axes[0])};
  rig::SimulatedDrive rotation_{*drive_buses_[1], drive_config(config_.axes[1])};
  stepper::StepperDriver driver_{bus_, config_};
  std::optional<stepper::MotionSetpoint> setpoint_ = stepper::MotionSetpoint{};
  std::int64_t aging_ns_ = 0;
  std::int64_t now_ns_ = 1'000'000'000;
  Frame last_request_{0x601, 8, {}};
  bool drives_run_ = true;
  bool ever_enabled_ = false;
  bool latched_ = false;
  unsigned foreign_ = 0;  // frames on the wire that nobody here made, or not like that
  unsigned frames_ = 0;
  unsigned lose_ = 0;
  unsigned alter_ = 0;
};

}  // namespace
}  // namespace bevel::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bevel::fuzz::Input input(data, size);
  bevel::fuzz::Bench(input).run();
  return 0;
}
