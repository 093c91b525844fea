// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Check of the bus and the two drives for bevel-check, without moving a drive or changing its NMT state: masters on
/// the bus, transmission, identity of the drives, regularity of their heartbeats. Uses no clock.

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

/// Measurements of one drive.
struct DriveMeasured {
  bool answered = false;                    ///< the drive answered an SDO request
  std::uint32_t device_type = 0;            ///< object 0x1000
  std::array<std::uint32_t, 4> identity{};  ///< objects 0x1018:1 to 4: vendor, product, revision, serial
  std::uint32_t modes = 0;                  ///< object 0x6502
  stepper::StatedUnits units{};             ///< objects 0x60A8 to 0x60AA, 0x6096, 0x6091, 0x6092, 0x608F
  std::string name;                         ///< object 0x1008; empty if the drive does not have it
  std::uint32_t heartbeats = 0;             ///< heartbeats received while watching
  std::int64_t longest_silence_ns = 0;      ///< longest time between two heartbeats, ns
  /// First object that the drive rejected, as index << 8 | sub-index; empty: none.
  std::optional<std::uint32_t> refused_object;
  std::uint32_t refusal = 0;  ///< abort code of the rejection
};

/// Measurements of the bus and both drives.
struct BusMeasured {
  bool open = false;                       ///< the bus was open
  std::optional<std::uint32_t> master_id;  ///< identifier of a frame that only a master sends; empty: none was received
  bool error_passive = false,              ///< the CAN controller was error-passive
      bus_off = false,                     ///< the CAN controller was bus-off
      lost = false;                        ///< the link was lost
  std::uint64_t sent = 0,                  ///< frames accepted by the bus
      echoed = 0,                          ///< frames on the wire
      received = 0;                        ///< frames of other participants
  std::int64_t slowest_echo_ns = 0;        ///< longest time from a frame to its echo, ns
  std::array<DriveMeasured, stepper::kAxes> drives;  ///< measurements of the insertion and the rotation drive
};

/// Performs the check.
///
///     listening --(a master is received)--> watching, without a frame from the probe
///     listening --> asking (SDO: 1000, 1018, 6502, units, 1008; 1017 is set) --> watching --> restoring (1017) -->
///     done
class BusProbe {
 public:
  /// Duration of the phase `listening`, ns.
  static constexpr std::int64_t kListen_ns = 400 * stepper::kMs;
  /// Duration of the phase `watching`, ns.
  static constexpr std::int64_t kWatch_ns = 1500 * stepper::kMs;

  /// Creates a probe.
  /// @param bus    bus; must outlive the probe and receive all identifiers
  /// @param config settings of the driver, with the node ids
  BusProbe(can::Bus& bus, const stepper::StepperConfig& config);

  /// Continues the check. Call it about every millisecond until done().
  /// @param now_ns steady clock, ns
  void step(std::int64_t now_ns);
  /// @return true if the check is complete
  bool done() const { return phase_ == Phase::done; }
  /// @return measurements so far
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
