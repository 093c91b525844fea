// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <bevel/drivers/can/bus.hpp>
#include <bevel/drivers/stepper/drive_node.hpp>
#include <bevel/drivers/stepper/follow_watch.hpp>
#include <bevel/drivers/stepper/rate_shaper.hpp>
#include <bevel/drivers/stepper/reason.hpp>
#include <bevel/drivers/stepper/rest_watch.hpp>
#include <bevel/drivers/stepper/scale_watch.hpp>
#include <bevel/drivers/stepper/stepper_config.hpp>
#include <bevel/drivers/stepper/transmitter.hpp>

namespace bevel::stepper {

/// Measured state of an axis after a stop.
enum class AxisRest : std::uint8_t {
  not_stopped,    ///< no stop is in force
  slowing,        ///< within the travel that its ramp allows
  at_rest,        ///< stationary, and where it came to rest
  not_measured,   ///< the drive sends no measurements: it has to stop by its own monitoring of our heartbeat
  does_not_stop,  ///< moves on although it was stopped
};

/// Strongest order that a stop has sent to an axis. Each order follows if the one before does not bring the axis to
/// rest.
enum class StopOrder : std::uint8_t { none, quick_stop, disable_voltage, nmt_stop };

struct MotionSetpoint {
  std::int64_t age_ns = 0;           // since it was made; more than a cycle below zero is refused
  bool run = false;                  // false: stop; while the axes are being moved that is a latched quick stop
  double insertion_rate_mm_s = 0.0;  // + into the tissue
  double rotation_rate_rad_s = 0.0;
};

enum class DriverState : std::uint8_t {
  off,          // no bus, or listening whether somebody else commands the drives
  configuring,  // also while a drive is not there yet
  ready,
  enabled,
  stopped,  // latched
  fault,    // latched: drive, configuration or another master at fault (is_fault(reason))
};
const char* to_string(DriverState state);

enum class AxisStatus : std::int8_t { off = 0, ready = 1, enabled = 2, quick_stop = 3, fault = 4 };

enum class EnableAnswer : std::uint8_t { accepted, not_ready, position_not_trusted };

struct DriverCounters {
  std::uint64_t steps = 0;
  std::uint64_t overruns = 0;  // step() more than half a period late
  std::uint64_t setpoints_refused = 0;
  std::uint64_t setpoints_stale = 0;    // steps in which the rate was forced to zero by age
  std::uint64_t setpoints_clamped = 0;  // steps with a rate over a limit
  std::uint64_t held_back = 0;          // frames not sent, as the one before was not on the wire yet
  std::uint64_t queue_full = 0;
  std::uint64_t missed_pdos = 0;
  std::uint64_t malformed = 0;
  std::uint64_t sdo_ignored = 0;
  std::uint64_t bus_errors = 0;
  std::uint64_t purges = 0;
  std::uint64_t later_stops = 0;          // troubles after the one that is latched
  std::uint64_t heartbeats_withheld = 0;  // stops that a drive did not confirm
  std::uint64_t stops_escalated = 0;      // axes that did not slow by their quick stop
};

struct AxesReport {
  std::int64_t sampled_ns = 0;  // clock of step(): the SYNC at which the older of both positions was taken; 0: none yet
  std::array<AxisStatus, kAxes> status{};
  double insertion_mm = 0.0;
  double insertion_rate_mm_s = 0.0;
  double rotation_rad = 0.0;
  double rotation_rate_rad_s = 0.0;
  std::array<bool, kAxes> position_trusted{};
  std::array<std::uint16_t, kAxes> error_code{};  // last EMCY code or 0x603F
  std::array<AxisRest, kAxes> rest{};             // in stopped and fault
  std::array<StopOrder, kAxes> order{};           // in stopped and fault
  std::array<bool, kAxes> waits_for_boot{};       // in configuring: an NMT reset is sent, the boot-up is awaited
  bool heartbeat_ended = false;  // in stopped and fault: so that drives that do not confirm the stop end it themselves
  DriverState state = DriverState::off;
  Stop stop{};   // latched in stopped and fault; in off and configuring what stands in the way, if known
  Stop later{};  // the first trouble of a drive or the bus after the latched stop; none if there was none
  DriverCounters counters{};
};

/// Describes the state in one line for the operator: an axis that does not stop first, then the latched stop, what came
/// after it, and what is awaited. Empty if there is nothing to report. Allocates.
std::string describe(const AxesReport& report);

/// Two CiA 402 drives, insertion and rotation, as one needle driver on a can::Bus.
///
///   off --(bus open, nobody else commands)--> configuring --(both drives checked, operational)--> ready
///   ready --enable()--> enabled --disable()--> ready
///   ready, enabled --(any trouble)--> stopped or fault, latched: quick stop on both axes until rearm()
///
/// Nothing moves without enable(). Nothing recovers from a latched stop without rearm() and enable(). A stop counts as
/// carried out when both axes are measured at rest (RestWatch). An axis that does not slow as its ramp demands gets, in
/// this order, "disable voltage" (by PDO and by SDO) and NMT stop; the end of our heartbeat, on which drives stop by
/// themselves, follows where a drive does not confirm or report. Uses no files, clocks or messages.
class StepperDriver {
 public:
  // bus: must outlive the driver and hear listen_ids(). Throws ArgumentError listing every problem of config.
  StepperDriver(can::Bus& bus, const StepperConfig& config);
  StepperDriver(const StepperDriver&) = delete;
  StepperDriver& operator=(const StepperDriver&) = delete;

  static std::vector<std::uint32_t> listen_ids(const StepperConfig& config);

  // One cycle, every config.period_ns. now_ns: steady clock. setpoint: the newest known (hand it in again while its age
  // grows), or nothing. Does not allocate, lock or block.
  void step(std::int64_t now_ns, const std::optional<MotionSetpoint>& setpoint);
  // Optional, between steps, when a new set-point has arrived: in profile velocity it is on the bus at once, in cyclic
  // velocity with the next SYNC. The limits hold as in step().
  void take(std::int64_t now_ns, const MotionSetpoint& setpoint);
  // Optional, between steps, when the bus is readable: takes in frames as they arrive. What they ask to be stopped is
  // told to stop at once, and a command that waited for the echo of the one before goes out, not in the next step.
  void receive(std::int64_t now_ns);

  EnableAnswer enable();                                  // carried out by the following steps
  void disable();                                         // the drives ramp down and let go; back to ready
  void stop_now(StopReason reason, std::int64_t now_ns);  // quick stop, latched, and sent at once
  bool rearm();             // out of stopped or fault: configure again, reset faults. False: nothing is latched
  void set_zero();          // both axes are at their zero now
  void confirm_position();  // the drives' positions still hold, although a drive was out of sight

  bool command_waits() const { return command_waits_[kInsertion] || command_waits_[kRotation]; }  // for an echo
  bool moving() const;  // a rate other than zero is commanded
  AxesReport report() const;

 private:
  void take_in(std::int64_t now_ns);
  void on_frame(const can::Frame& frame, std::int64_t now_ns);
  void on_event(can::BusEvent event, std::int64_t now_ns);
  void on_trouble(const Stop& trouble, std::int64_t now_ns);
  void latch(const Stop& stop, std::int64_t now_ns);
  void purge(std::int64_t now_ns);
  void note_timing(std::int64_t now_ns);
  void supervise_transmission(std::int64_t now_ns);
  void run_off(std::int64_t now_ns);
  void run_configuring(std::int64_t now_ns);
  void run_ready(std::int64_t now_ns);
  void run_enabled(std::int64_t now_ns, const std::optional<MotionSetpoint>& setpoint);
  void shape(std::int64_t now_ns, const std::array<double, kAxes>& rates);
  void supervise_motion(std::int64_t now_ns);
  void watch_rest(std::size_t axis, std::int64_t now_ns, double ramp_unit_s2);
  void begin_watch(std::size_t axis, std::int64_t now_ns, double fastest_unit_s, double ramp_unit_s2);
  void measure_rest(std::size_t axis, std::int64_t now_ns);
  void escalate(std::size_t axis, std::int64_t now_ns);
  void judge_rest(std::size_t axis, std::int64_t now_ns);
  void supervise_stop(std::int64_t now_ns);
  void supervise_disabling(std::int64_t now_ns);
  void note_later(const Stop& stop);
  bool holds(std::size_t axis) const;
  AxisRest rest_of(std::size_t axis) const;
  void ask_why(std::int64_t now_ns);
  std::array<double, kAxes> wanted_rates(std::int64_t now_ns, const std::optional<MotionSetpoint>& setpoint);
  void transmit(std::int64_t now_ns);
  bool may_send() const { return bus_.is_open() && !silent_; }
  void send_command(std::size_t axis, std::int64_t now_ns);
  void send_commands(std::int64_t now_ns);
  void send_stop(std::int64_t now_ns);
  std::uint16_t controlword_for(std::size_t axis) const;
  bool latched() const { return state_ == DriverState::stopped || state_ == DriverState::fault; }
  bool all_in(cia402::State state) const;

  const StepperConfig config_;
  can::Bus& bus_;
  Transmitter out_;
  std::array<DriveNode, kAxes> nodes_;
  std::array<RateShaper, kAxes> shapers_;
  std::array<FollowWatch, kAxes> follows_;
  std::array<ScaleWatch, kAxes> scales_;

  DriverState state_ = DriverState::off;
  Stop stop_{};
  bool silent_ = false;  // another master was there first: not a frame from us
  bool enable_wanted_ = false;
  bool reset_faults_ = false;        // rearm() was called
  bool withhold_heartbeat_ = false;  // a drive did not confirm the stop: its own watch over us is to stop it
  std::int64_t last_step_ns_ = 0;
  std::int64_t shaped_ns_ = 0;   // when the rates were last shaped
  std::int64_t stopped_ns_ = 0;  // when the stop was latched, or the axes were disabled
  std::int64_t state_since_ns_ = 0;
  std::int64_t listen_since_ns_ = 0;
  std::int64_t enable_since_ns_ = 0;
  std::int64_t next_heartbeat_ns_ = INT64_MIN;
  std::int64_t next_purge_ns_ = INT64_MIN;
  std::int64_t fresh_setpoint_ns_ = 0;  // when the newest usable set-point was made
  bool refusing_setpoints_ = false;
  // Since a stop or disable(): the watch over each axis, its rate at that time, and whether it was blocked.
  std::array<RestWatch, kAxes> rests_{};
  std::array<StopOrder, kAxes> orders_{};
  std::array<double, kAxes> stopped_from_unit_s_{};
  std::array<bool, kAxes> judged_{}, held_back_{};
  std::array<bool, kAxes> stop_confirmed_{};
  std::array<std::int64_t, kAxes> next_nmt_stop_ns_{};
  Stop later_{};
  std::array<bool, kAxes> command_waits_{};  // for the echo of the one before
  std::array<bool, kAxes> at_limit_{};       // what the statuswords said last
  DriverCounters counters_;
};

}  // namespace bevel::stepper
