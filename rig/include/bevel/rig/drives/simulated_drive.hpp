// SPDX-License-Identifier: MIT
// A CiA 402 stepper drive that exists only as a program: it answers on a can::Bus as a real one would and gives the
// plant the motion of its shaft. CANopen here is written from the device's side and shares nothing but the frame and
// the bus with drivers/src/stepper, so that each checks the other. Modes: profile velocity (3), homing (6), cyclic
// synchronous velocity (9). Its objects are in factory_dictionary.cpp, and for others in bevel_drive.eds.
#pragma once

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

struct SimulatedDriveConfig {
  std::uint8_t node_id = 1;
  double counts_per_unit = 2000.0;  // encoder increments to a mm or rad, for position_unit() only
  double following_time_s = 0.004;  // lag of the shaft behind the demand
  Identity identity{};
  LimitSwitches switches{};  // in increments of the shaft, which stands at 0 when the drive is made
  DriveDialect dialect{};
};

enum class NmtState : std::uint8_t { stopped = 0x04, operational = 0x05, pre_operational = 0x7F };

class SimulatedDrive {
 public:
  // bus: of this drive alone (two drives on one Bus would eat each other's frames); must outlive it.
  SimulatedDrive(can::Bus& bus, const SimulatedDriveConfig& config);

  // Takes in frames, moves on to now_ns, sends what is due. Call it about every millisecond; the clock is the caller's.
  void step(std::int64_t now_ns);

  // True motion of the shaft, for the plant.
  double position_unit() const { return motion_.position() / config_.counts_per_unit; }
  double velocity_unit_s() const { return motion_.velocity_per_s() / config_.counts_per_unit; }

  PowerStateMachine::State state() const { return power_.state(); }
  NmtState nmt_state() const { return nmt_; }
  const ObjectDictionary& objects() const { return od_; }

  // Faults to order.
  void set_silent(bool silent) { silent_ = silent; }            // its connector is pulled: hears and says nothing
  void set_pdos_frozen(bool frozen) { pdos_frozen_ = frozen; }  // heartbeat alive, PDOs neither sent nor obeyed
  void set_motor_blocked(bool blocked) { motion_.set_blocked(blocked); }
  void set_power_stage_stuck(bool stuck) { power_stage_stuck_ = stuck; }  // turns on whatever it is ordered
  // Changes a setting without a frame, as a defect of its memory or another way into the drive would.
  void corrupt(std::uint16_t index, std::uint8_t sub, std::uint32_t value);
  void power_cycle();                          // all settings are lost, and where its zero was; boot-up
  void raise_fault(std::uint16_t error_code);  // as if a supervision inside the drive had tripped

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
  double zero_increments_ = 0.0;  // where on the shaft the objects' positions count from
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
  std::optional<std::int64_t> master_heard_ns_;  // set once its heartbeat was heard: only then is it watched
  bool master_lost_ = false;
  double following_error_s_ = 0.0;
  std::string upload_;  // what is left of a text that is being sent in segments
  bool uploading_ = false;
  std::uint8_t toggle_ = 0;
  std::array<unsigned, kPdos> syncs_{};
  std::array<std::optional<can::Frame>, kPdos> held_rpdos_{};  // synchronous ones, until the next SYNC
};

}  // namespace bevel::rig
