// SPDX-License-Identifier: MIT
// Talks to the two drives as far as is possible without a drive moving or leaving its NMT state: who is on the bus,
// does what is sent reach the wire, who are the drives, how evenly do their hearts beat. Pure: time is handed in.
//
//   listening --(a master is heard)--> watching, without a frame from us
//   listening --> asking (SDO: 1000, 1018, 6502, units, 1008; 1017 is set) --> watching --> restoring (1017) --> done
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <bevel/drivers/can/bus.hpp>
#include <bevel/drivers/stepper/cia301.hpp>
#include <bevel/drivers/stepper/drive_units.hpp>
#include <bevel/drivers/stepper/stepper_config.hpp>

namespace bevel::drivers {

struct DriveMeasured {
  bool answered = false;
  std::uint32_t device_type = 0;                // 1000
  std::array<std::uint32_t, 4> identity{};      // 1018:1-4: vendor, product, revision, serial
  std::uint32_t modes = 0;                      // 6502
  stepper::StatedUnits units{};                 // 60A8 to 60AA, 6096, 6091, 6092, 608F
  std::string name;                             // 1008; empty where the drive has none
  std::uint32_t heartbeats = 0;                 // heard while watching
  std::int64_t longest_silence_ns = 0;          // between two of them
  std::optional<std::uint32_t> refused_object;  // index << 8 | sub, and the code in refusal
  std::uint32_t refusal = 0;
};

struct BusMeasured {
  bool open = false;
  std::optional<std::uint32_t> master_id;  // identifier of a frame that only a master sends
  bool error_passive = false, bus_off = false, lost = false;
  std::uint64_t sent = 0, echoed = 0, received = 0;
  std::int64_t slowest_echo_ns = 0;
  std::array<DriveMeasured, stepper::kAxes> drives;
};

class BusProbe {
 public:
  static constexpr std::int64_t kListen_ns = 400 * stepper::kMs;
  static constexpr std::int64_t kWatch_ns = 1500 * stepper::kMs;

  // The bus must outlive the probe and hear everything.
  BusProbe(can::Bus& bus, const stepper::StepperConfig& config);

  void step(std::int64_t now_ns);  // about every millisecond, until done()
  bool done() const { return phase_ == Phase::done; }
  const BusMeasured& measured() const { return measured_; }

 private:
  enum class Phase : std::uint8_t { listening, asking, watching, restoring, done };
  struct Job {
    stepper::cia301::ObjectAddress object;
    enum class Kind : std::uint8_t { number, optional, text, set } kind = Kind::number;
  };
  struct Asked {  // of one drive
    stepper::cia301::SdoClient sdo;
    std::size_t job = 0;
    bool done = false;
    std::uint32_t old_heartbeat_ms = 0;
    bool heartbeat_set = false;
    std::int64_t heard_ns = 0;
  };
  static const std::vector<Job>& jobs();

  void receive(std::int64_t now_ns);
  void on_frame(const can::Frame& frame, std::int64_t now_ns);
  void on_echo(std::int64_t now_ns);
  void on_event(can::BusEvent event);
  void ask(std::size_t axis, std::int64_t now_ns);
  void begin_job(std::size_t axis);
  void end_job(std::size_t axis, bool worked);
  void restore(std::size_t axis, std::int64_t now_ns);
  void exchange(Asked& asked, std::int64_t now_ns);
  void enter(Phase phase, std::int64_t now_ns);
  bool of_a_master(std::uint32_t id) const;

  can::Bus& bus_;
  stepper::StepperConfig config_;
  Phase phase_ = Phase::listening;
  std::int64_t since_ns_ = -1;
  std::array<Asked, stepper::kAxes> asked_;
  std::optional<std::int64_t> awaiting_echo_ns_;
  BusMeasured measured_;
};

}  // namespace bevel::drivers
