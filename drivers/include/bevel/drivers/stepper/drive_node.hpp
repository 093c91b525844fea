// SPDX-License-Identifier: MIT
// One drive as its master sees it: presence, configuration, state, position.
#pragma once

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

class DriveNode {
 public:
  enum class Phase : std::uint8_t {
    absent,       // an NMT reset is sent, its boot-up is awaited
    configuring,  // SDO
    starting,     // told to start, until it is operational and sends its PDOs
    operational,
  };

  struct Counters {
    std::uint64_t malformed = 0;    // frames of a wrong length
    std::uint64_t missed_pdos = 0;  // SYNCs without both answers
  };

  DriveNode(const StepperConfig& config, std::size_t axis);

  void restart();                                               // from absent, whatever was
  void on_frame(const can::Frame& frame, std::int64_t now_ns);  // ignores frames of others
  void on_sync(std::int64_t now_ns);                            // our SYNC was sent
  void configure(std::int64_t now_ns, Transmitter& out);        // one cycle of work towards operational
  // Once operational: writes the drive's software limits anew after set_zero() has moved them; else reads one monitored
  // setting after the other back. A setting that differs is trouble (setting_changed).
  void maintain_settings(std::int64_t now_ns, Transmitter& out);
  void supervise(std::int64_t now_ns);                          // time-outs
  void read_error_code(std::int64_t now_ns, Transmitter& out);  // in fault: 0x603F, once
  // Which limit stopped the axis, by 0x60FD, once it has answered; travel_limit until then, and where it has no answer.
  StopReason read_limit(std::int64_t now_ns, Transmitter& out);
  // rate: in counts of the drive, by sign of counts_per_unit. False: not accepted (Transmitter::send()).
  bool command(std::uint16_t controlword, double rate_unit_s, std::int64_t now_ns, Transmitter& out);

  // Orders "disable voltage" by SDO, once: for a drive that does not obey its PDOs.
  void disable_voltage(std::int64_t now_ns, Transmitter& out);

  Stop take_trouble();  // the oldest trouble since the last call

  Phase phase() const { return phase_; }
  bool configured() const { return phase_ == Phase::operational && job_ == script_.size(); }
  // Its statusword since then says that it obeys a stop. Silence says nothing.
  bool confirms_stop(std::int64_t since_ns) const {
    return phase_ == Phase::operational && status_pdo_ns_ > since_ns && state() != cia402::State::operation_enabled;
  }
  cia402::State state() const { return cia402::decode(statusword_); }
  std::uint16_t statusword() const { return statusword_; }
  bool says_limit() const { return (statusword_ & cia402::kInternalLimit) != 0; }  // a switch's, or its own
  std::uint16_t error_code() const { return error_code_; }
  double position_unit() const;
  double rate_unit_s() const;
  AxisSample sample() const;                                                                  // the newest measurement
  bool shows_mode() const { return shown_mode_ == static_cast<std::uint8_t>(config_.mode); }  // 0x6061
  bool waits_for_boot() const { return phase_ == Phase::absent && next_nmt_ns_ != INT64_MIN; }
  std::int64_t sampled_ns() const { return sampled_ns_; }  // 0: never
  bool position_trusted() const { return position_trusted_; }
  void confirm_position() { position_trusted_ = true; }
  void set_zero();

  const Counters& counters() const { return counters_; }
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
  double velocity_units() const;  // in one mm/s or rad/s, signed
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
  bool voltage_ordered_ = false;  // off, by SDO, since the last restart
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
  int surplus_pdos_ = 0;     // answers beyond one to each since the last SYNC
  int surplus_balance_ = 0;  // those less the ones that were missed and may still come

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
