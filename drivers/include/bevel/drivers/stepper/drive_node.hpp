// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// One drive from its master's point of view: presence, configuration, state, position.

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <bevel/drivers/stepper/cia301.hpp>
#include <bevel/drivers/stepper/cia402.hpp>
#include <bevel/drivers/stepper/configuration_script.hpp>
#include <bevel/drivers/stepper/drive_units.hpp>
#include <bevel/drivers/stepper/reason.hpp>
#include <bevel/drivers/stepper/rest_watch.hpp>
#include <bevel/drivers/stepper/stepper_config.hpp>
#include <bevel/drivers/stepper/transmitter.hpp>

namespace bevel::stepper {

/// Configures, supervises and commands one drive.
class DriveNode {
 public:
  /// Progress towards operation.
  enum class Phase : std::uint8_t {
    absent,       ///< an NMT reset is sent, the boot-up is awaited
    configuring,  ///< SDO transfers of the configuration
    starting,     ///< NMT start is sent, the operational state and the PDOs are awaited
    operational,  ///< operational, sends PDOs
  };

  /// Counters since construction.
  struct Counters {
    std::uint64_t malformed = 0;    ///< frames of a wrong length
    std::uint64_t missed_pdos = 0;  ///< SYNCs that were not answered by both PDOs
  };

  /// Creates the node in Phase::absent.
  /// @param config settings of the driver; must outlive the node
  /// @param axis   kInsertion or kRotation
  DriveNode(const StepperConfig& config, std::size_t axis);

  /// Returns to Phase::absent from any phase.
  void restart();
  /// Processes a received frame. Frames of other nodes are ignored.
  /// @param frame  received frame
  /// @param now_ns steady clock, ns
  void on_frame(const can::Frame& frame, std::int64_t now_ns);
  /// Records that the master's SYNC was sent.
  /// @param now_ns steady clock, ns
  void on_sync(std::int64_t now_ns);
  /// Performs one cycle of work towards Phase::operational.
  /// @param now_ns steady clock, ns
  /// @param out    sender of the frames
  void configure(std::int64_t now_ns, Transmitter& out);
  /// Writes the drive's software limits again after set_zero() has moved them; otherwise reads the monitored settings
  /// back, one after the other. A setting that differs is reported by take_trouble() (StopReason::setting_changed).
  /// Does nothing before Phase::operational.
  /// @param now_ns steady clock, ns
  /// @param out    sender of the frames
  void maintain_settings(std::int64_t now_ns, Transmitter& out);
  /// Checks the time-outs of heartbeat and PDOs.
  /// @param now_ns steady clock, ns
  void supervise(std::int64_t now_ns);
  /// Reads the error code (0x603F) of a drive in fault, once.
  /// @param now_ns steady clock, ns
  /// @param out    sender of the frames
  void read_error_code(std::int64_t now_ns, Transmitter& out);
  /// Determines from the drive's digital inputs (0x60FD) which limit stopped the axis.
  /// @param now_ns steady clock, ns
  /// @param out    sender of the frames
  /// @return StopReason::lower_switch, upper_switch or drive_limit, in the direction of the axis, in the call in which
  /// the
  ///   answer is available; travel_limit in all other calls, if both switches are active, and if the drive has no
  ///   answer
  StopReason read_limit(std::int64_t now_ns, Transmitter& out);
  /// Sends controlword and rate as RPDO1. The rounding error of the rate is added to the next command.
  /// @param controlword controlword (0x6040)
  /// @param rate_unit_s rate, mm/s or rad/s; the sign of counts_per_unit gives the drive's direction
  /// @param now_ns      steady clock, ns
  /// @param out         sender of the frame
  /// @return false if the frame was not accepted (Transmitter::send())
  bool command(std::uint16_t controlword, double rate_unit_s, std::int64_t now_ns, Transmitter& out);

  /// Sends "disable voltage" by SDO, once, to a drive that does not obey its PDOs.
  /// @param now_ns steady clock, ns
  /// @param out    sender of the frames
  void disable_voltage(std::int64_t now_ns, Transmitter& out);

  /// Takes the oldest error since the last call.
  /// @return the error; StopReason::none if there was none
  Stop take_trouble();

  /// @return present phase
  Phase phase() const { return phase_; }
  /// @return true if the drive is operational and no job of the configuration is pending
  bool configured() const { return phase_ == Phase::operational && job_ == script_.size(); }
  /// Returns whether the drive confirms a stop by its statusword. A drive that sends none does not confirm.
  /// @param since_ns time of the stop, steady clock, ns
  /// @return true if a statusword received after since_ns shows a state other than operation enabled
  bool confirms_stop(std::int64_t since_ns) const {
    return phase_ == Phase::operational && status_pdo_ns_ > since_ns && state() != cia402::State::operation_enabled;
  }
  /// @return state according to the newest statusword
  cia402::State state() const { return cia402::decode(statusword_); }
  /// @return newest statusword (0x6041); 0 after restart()
  std::uint16_t statusword() const { return statusword_; }
  /// @return true if the newest statusword reports an internal limit: a limit switch, or the drive's software limit
  bool says_limit() const { return (statusword_ & cia402::kInternalLimit) != 0; }
  /// @return code of the last emergency message, or of 0x603F once it is read; 0: none
  std::uint16_t error_code() const { return error_code_; }
  /// @return newest position, mm or rad from the entry point
  double position_unit() const;
  /// @return newest rate as the drive reports it (0x606C), mm/s or rad/s
  double rate_unit_s() const;
  /// @return newest measurement
  AxisSample sample() const;
  /// @return true if the drive shows the configured mode (0x6061)
  bool shows_mode() const { return shown_mode_ == static_cast<std::uint8_t>(config_.mode); }
  /// @return true if an NMT reset is sent and the boot-up is awaited
  bool waits_for_boot() const { return phase_ == Phase::absent && next_nmt_ns_ != INT64_MIN; }
  /// @return time of the SYNC at which the newest position was sampled, steady clock, ns; 0: never
  std::int64_t sampled_ns() const { return sampled_ns_; }
  /// @return false if the drive may have been reset or moved while it was not monitored
  bool position_trusted() const { return position_trusted_; }
  /// Accepts the position as valid.
  void confirm_position() { position_trusted_ = true; }
  /// Makes the present position the entry point, accepts it as valid, and moves the software limits with it.
  void set_zero();

  /// @return counters since construction
  const Counters& counters() const { return counters_; }
  /// @return number of SDO responses that did not match a request
  std::uint64_t sdo_ignored() const { return sdo_.ignored(); }

 private:
  void on_heartbeat(const can::Frame& frame, std::int64_t now_ns);
  void on_emergency(const can::Frame& frame);
  void on_position(const can::Frame& frame, std::int64_t now_ns);
  void out_of_sight();
  void trouble(StopReason reason, std::uint32_t code = 0);
  void job_trouble(StopReason reason, std::uint32_t found);
  void transfer(std::int64_t now_ns, Transmitter& out);
  void on_abort(std::int64_t now_ns);
  void decide_units(std::int64_t now_ns);
  std::uint32_t value_of(const SdoJob& job) const;
  double velocity_units() const;  // per mm/s or rad/s, signed
  void monitor(std::int64_t now_ns, Transmitter& out);
  void judge_monitored(std::int64_t now_ns);
  bool ask_once(cia301::ObjectAddress object, bool& asked, std::int64_t now_ns, Transmitter& out);
  bool has_limits() const { return std::isfinite(limits_.min_unit) || std::isfinite(limits_.max_unit); }
  void place_limits();
  void begin_job();
  void finish_job(std::int64_t now_ns);
  void next_job(std::int64_t now_ns);

  const StepperConfig& config_;
  std::size_t axis_;
  std::uint8_t node_;
  DriveLimits limits_;
  std::vector<SdoJob> script_;  // ends with kLimitJobs, if there are limits
  // For each job, the value that is now in the drive, masked; empty if the drive lacks the object.
  std::vector<std::optional<std::uint32_t>> settled_;
  cia301::SdoClient sdo_;
  StatedUnits units_{};
  UnitScales scales_{};
  double rate_residue_ = 0.0;  // velocity units that rounding left over in the last command

  Phase phase_ = Phase::absent;
  std::int64_t next_nmt_ns_ = INT64_MIN;
  std::int64_t phase_since_ns_ = 0;
  std::int64_t reset_sent_ns_ = 0;
  std::size_t job_ = 0;
  bool reads_back_ = false;    // of the present job, after its write
  bool falls_back_ = false;    // the present job writes its fallback
  std::size_t monitored_ = 0;  // job whose value is read back next
  bool monitoring_ = false;    // its transfer is under way
  std::int64_t next_monitor_ns_ = 0;
  bool voltage_ordered_ = false;  // "disable voltage" was sent by SDO since the last restart
  int unanswered_ = 0;            // cyclic read-backs in a row
  int retries_ = 0;
  std::int64_t job_since_ns_ = 0;
  bool seen_operational_ = false;
  bool error_code_asked_ = false;
  bool inputs_asked_ = false;
  Stop trouble_{};

  cia301::NmtState nmt_state_ = cia301::NmtState::boot_up;
  std::int64_t heartbeat_ns_ = 0;
  std::int64_t status_pdo_ns_ = 0;
  std::int64_t position_pdo_ns_ = 0;
  std::int64_t sync_ns_ = 0;
  bool status_pdo_due_ = false;
  bool position_pdo_due_ = false;
  int surplus_pdos_ = 0;     // PDOs beyond one of each since the last SYNC
  int surplus_balance_ = 0;  // surplus PDOs minus missed PDOs that may still arrive

  std::uint16_t statusword_ = 0;
  std::uint16_t error_code_ = 0;
  std::uint8_t shown_mode_ = 0;
  std::int32_t raw_rate_ = 0;  // velocity units of the drive
  std::int32_t raw_position_ = 0;
  std::int64_t position_counts_ = 0;  // raw_position_ unwrapped
  std::int64_t zero_counts_ = 0;
  std::int64_t sampled_counts_ = 0;  // position_counts_ at sampled_ns_
  double travel_rate_unit_s_ = 0.0;
  bool have_position_ = false;
  bool position_trusted_ = true;
  std::int64_t sampled_ns_ = 0;
  Counters counters_;
};

}  // namespace bevel::stepper
