// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Simulated CiA 402 stepper drive. It answers on a can::Bus and moves the plant. Its CANopen is implemented from the
/// device's side and shares only frame and bus with drivers/src/stepper, so that each checks the other.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <bevel/drivers/can/bus.hpp>
#include <bevel/rig/drives/dialect.hpp>
#include <bevel/rig/drives/drive_motion.hpp>
#include <bevel/rig/drives/homing.hpp>
#include <bevel/rig/drives/object_dictionary.hpp>
#include <bevel/rig/drives/power_state_machine.hpp>
#include <bevel/rig/drives/travel_limits.hpp>
#include <bevel/rig/drives/unit_factors.hpp>

namespace bevel::rig {

/// Settings of a simulated drive.
struct SimulatedDriveConfig {
  std::uint8_t node_id = 1;  ///< node id, 1..127
  /// Encoder increments in one mm or rad, used by position_unit() and velocity_unit_s() only.
  double counts_per_unit = 2000.0;
  double following_time_s = 0.004;  ///< lag of the shaft behind the demand, s
  Identity identity{};              ///< identity objects
  LimitSwitches switches{};         ///< positions in increments of the shaft, which starts at 0
  DriveDialect dialect{};           ///< deviations of a maker's drive
};

/// NMT states, coded as in a heartbeat.
enum class NmtState : std::uint8_t {
  stopped = 0x04,         ///< stopped
  operational = 0x05,     ///< operational
  pre_operational = 0x7F  ///< pre-operational
};

/// Simulates one drive. Modes: profile velocity (3), homing (6), cyclic synchronous velocity (9).
/// factory_dictionary.cpp and, for other tools, bevel_drive.eds list its objects.
class SimulatedDrive {
 public:
  /// Creates a drive with factory settings.
  /// @param bus    bus of this drive only, since two drives on one Bus would take each other's frames; must outlive it
  /// @param config settings
  SimulatedDrive(can::Bus& bus, const SimulatedDriveConfig& config);

  /// Processes frames, simulates until now_ns, and sends frames that are due. Call it about every millisecond.
  /// @param now_ns clock of the caller, ns
  void step(std::int64_t now_ns);

  /// @return true position of the shaft, mm or rad
  double position_unit() const { return motion_.position() / config_.counts_per_unit; }
  /// @return true velocity of the shaft, mm/s or rad/s
  double velocity_unit_s() const { return motion_.velocity_per_s() / config_.counts_per_unit; }

  /// @return state of the CiA 402 state machine
  PowerStateMachine::State state() const { return power_.state(); }
  /// @return NMT state
  NmtState nmt_state() const { return nmt_; }
  /// @return object dictionary
  const ObjectDictionary& objects() const { return od_; }

  /// Simulates a disconnected bus cable: the drive neither receives nor sends.
  /// @param silent true: disconnected
  void set_silent(bool silent) { silent_ = silent; }
  /// Simulates a drive whose heartbeat continues while PDOs are neither sent nor obeyed.
  /// @param frozen true: frozen
  void set_pdos_frozen(bool frozen) { pdos_frozen_ = frozen; }
  /// Simulates a blocked shaft.
  /// @param blocked true: blocked
  void set_motor_blocked(bool blocked) { motion_.set_blocked(blocked); }
  /// Simulates a power stage that keeps turning regardless of commands.
  /// @param stuck true: keeps turning
  void set_power_stage_stuck(bool stuck) { power_stage_stuck_ = stuck; }
  /// Changes a setting without a frame, as a memory defect or another access to the drive would.
  /// @param index index of the object
  /// @param sub   sub-index
  /// @param value new value
  /// @throws std::out_of_range if the object does not exist
  void corrupt(std::uint16_t index, std::uint8_t sub, std::uint32_t value);
  /// Simulates a power cycle: all settings and the position's zero are lost; sends the boot-up message.
  void power_cycle();
  /// Simulates a fault that a supervision in the drive detects.
  /// @param error_code code of the emergency message
  void raise_fault(std::uint16_t error_code);

 private:
  static constexpr std::size_t kPdos = 4;

  void on_frame(const can::Frame& frame, std::int64_t now_ns);
  void on_nmt(const can::Frame& frame);
  void on_sdo(const can::Frame& frame);
  Abort begin_upload(std::uint16_t index, std::uint8_t sub, can::Frame& answer);
  Abort next_segment(std::uint8_t command, can::Frame& answer);
  void on_sync();
  void on_rpdo(std::size_t pdo, const can::Frame& frame);
  void on_master_heartbeat(std::int64_t now_ns);
  void on_master_lost();
  Abort write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes);
  Abort check_profile_setting(std::uint16_t index, std::uint8_t sub, std::uint32_t value) const;
  Abort check_pdo_setting(std::uint16_t index, std::uint8_t sub, std::uint32_t value) const;
  Abort check_mapping(std::uint16_t index, std::uint32_t entry) const;
  Abort check_mapping_length(std::uint16_t mapping, std::uint32_t count) const;
  void written(std::uint16_t index);
  void obey(std::size_t pdo, const can::Frame& frame);
  void send_tpdo(std::size_t pdo);
  void reset_communication();
  void boot();
  ObjectDictionary factory_settings() const;
  void begin_boot();
  void send(const can::Frame& frame);
  void send_emergency(std::uint16_t code);
  void advance(double dt_s);
  void advance_cycle(double dt_s);
  double wanted_increments_s() const;
  double ramp_increments_s2(double target) const;
  double quick_stop_ramp() const;
  TravelLimits travel_limits() const;
  void advance_homing();
  void on_new_target();
  void on_controlword();
  void supervise_following(double dt_s);
  void update_status();
  unsigned mode_bits() const;
  bool negative_switch() const { return motion_.position() <= config_.switches.negative_at; }
  bool positive_switch() const { return motion_.position() >= config_.switches.positive_at; }

  can::Bus& bus_;
  SimulatedDriveConfig config_;
  ObjectDictionary od_;
  DriveMotion motion_;
  PowerStateMachine power_;
  UnitFactors units_;
  Homing homing_;
  double zero_increments_ = 0.0;  // shaft position of the objects' zero
  double cyclic_target_ = 0.0;    // csv: the demand reaches a new target within 60C2
  double cyclic_ramp_ = 0.0;
  bool at_limit_ = false;
  std::uint16_t old_controlword_ = 0;
  NmtState nmt_ = NmtState::pre_operational;
  bool started_ = false;
  bool silent_ = false;
  bool pdos_frozen_ = false;
  bool power_stage_stuck_ = false;
  std::optional<std::int64_t> boots_at_ns_;  // set while it boots
  std::int64_t now_ns_ = 0;
  std::int64_t next_heartbeat_ns_ = 0;
  std::optional<std::int64_t> master_heard_ns_;  // set by its first heartbeat, which starts the monitoring
  bool master_lost_ = false;
  double following_error_s_ = 0.0;
  std::string upload_;  // remaining text of a segmented upload
  bool uploading_ = false;
  std::uint8_t toggle_ = 0;
  std::array<unsigned, kPdos> syncs_{};
  std::array<std::optional<can::Frame>, kPdos> held_rpdos_{};  // synchronous ones, until the next SYNC
};

}  // namespace bevel::rig
