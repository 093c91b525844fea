// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Driver of the insertion and the rotation axis over CANopen.

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
enum class StopOrder : std::uint8_t {
  none,             ///< no order
  quick_stop,       ///< quick stop
  disable_voltage,  ///< "disable voltage" by PDO and by SDO
  nmt_stop          ///< NMT stop
};

/// Commanded rates of both axes.
struct MotionSetpoint {
  std::int64_t age_ns = 0;  ///< age, ns; a value more than a cycle below zero is rejected
  /// false: stop. While the axes are moving this is a latched quick stop.
  bool run = false;
  double insertion_rate_mm_s = 0.0;  ///< insertion rate, mm/s; positive into the tissue
  double rotation_rate_rad_s = 0.0;  ///< rotation rate, rad/s
};

/// State of the driver.
enum class DriverState : std::uint8_t {
  off,          ///< no bus, or listening whether another master commands the drives
  configuring,  ///< the drives are configured; also while a drive is absent
  ready,        ///< both drives are configured and not enabled
  enabled,      ///< the axes follow set-points
  stopped,      ///< latched stop
  fault,        ///< latched stop; drive, configuration or another master at fault (is_fault(reason))
};
/// Returns the name of a state.
/// @param state state of the driver
/// @return static string
const char* to_string(DriverState state);

/// State of one axis, as in actuator_state_t.
enum class AxisStatus : std::int8_t {
  off = 0,         ///< not operational, or in another state
  ready = 1,       ///< ready to switch on, or switched on
  enabled = 2,     ///< operation enabled
  quick_stop = 3,  ///< quick stop active
  fault = 4        ///< fault, or fault reaction active
};

/// Answer to StepperDriver::enable().
enum class EnableAnswer : std::uint8_t {
  accepted,             ///< the following steps enable the axes
  not_ready,            ///< the driver is not ready
  position_not_trusted  ///< a position is not trusted: set_zero() or confirm_position() is required
};

/// Counters since construction.
struct DriverCounters {
  std::uint64_t steps = 0;                ///< calls of step()
  std::uint64_t overruns = 0;             ///< calls of step() more than half a period late
  std::uint64_t setpoints_refused = 0;    ///< set-points not finite, or with an age more than a cycle below zero
  std::uint64_t setpoints_stale = 0;      ///< steps in which the age of the set-point forced the rate to zero
  std::uint64_t setpoints_clamped = 0;    ///< steps with a rate over a limit
  std::uint64_t held_back = 0;            ///< frames not sent, as the previous one was not on the wire yet
  std::uint64_t queue_full = 0;           ///< frames rejected by the transmit queue
  std::uint64_t missed_pdos = 0;          ///< SYNCs that were not answered by both PDOs of a drive
  std::uint64_t malformed = 0;            ///< frames of a wrong length
  std::uint64_t sdo_ignored = 0;          ///< SDO responses that did not match a request
  std::uint64_t bus_errors = 0;           ///< error events of the bus
  std::uint64_t purges = 0;               ///< attempts to discard queued frames
  std::uint64_t later_stops = 0;          ///< errors after the one that is latched
  std::uint64_t heartbeats_withheld = 0;  ///< stops that a drive did not confirm
  std::uint64_t stops_escalated = 0;      ///< axes that did not slow by their quick stop
};

/// Measured state of both axes, and state of the driver.
struct AxesReport {
  /// Clock of step(), ns: the SYNC at which the older of both positions was sampled; 0: none yet.
  std::int64_t sampled_ns = 0;
  std::array<AxisStatus, kAxes> status{};      ///< state of each axis
  double insertion_mm = 0.0;                   ///< inserted length from the entry point, mm
  double insertion_rate_mm_s = 0.0;            ///< insertion rate as the drive reports it, mm/s
  double rotation_rad = 0.0;                   ///< rotation from the entry point, rad
  double rotation_rate_rad_s = 0.0;            ///< rotation rate as the drive reports it, rad/s
  std::array<bool, kAxes> position_trusted{};  ///< false: the drive was not monitored; confirm_position() is required
  std::array<std::uint16_t, kAxes> error_code{};  ///< last EMCY code or 0x603F
  std::array<AxisRest, kAxes> rest{};             ///< in stopped and fault
  std::array<StopOrder, kAxes> order{};           ///< in stopped and fault
  std::array<bool, kAxes> waits_for_boot{};       ///< in configuring: an NMT reset is sent, the boot-up is awaited
  /// In stopped and fault: the driver's heartbeat has ended, so that drives that do not confirm the stop end it
  /// themselves.
  bool heartbeat_ended = false;
  DriverState state = DriverState::off;  ///< state of the driver
  /// Latched stop in stopped and fault; in off and configuring the obstacle, if known.
  Stop stop{};
  /// First error of a drive or the bus after the latched stop; StopReason::none if there was none.
  Stop later{};
  DriverCounters counters{};  ///< counters since construction
};

/// Describes the state in one line for the operator: an axis that does not stop first, then the latched stop, later
/// errors, and what is awaited. Allocates.
/// @param report report of StepperDriver::report()
/// @return text without a line break; empty if there is nothing to report
std::string describe(const AxesReport& report);

/// Drives two CiA 402 drives, insertion and rotation, as one needle driver on a can::Bus.
///
///     off --(bus open, no other master commands)--> configuring --(both drives checked, operational)--> ready
///     ready --enable()--> enabled --disable()--> ready
///     ready, enabled --(any error)--> stopped or fault, latched: quick stop on both axes until rearm()
///
/// Nothing moves without enable(). A latched stop ends only by rearm() and enable(). A stop counts as carried out when
/// both axes are measured at rest (RestWatch). An axis that does not slow as its ramp requires receives, in this order,
/// "disable voltage" (by PDO and by SDO) and NMT stop. If a drive does not confirm or report, the driver then ends its
/// heartbeat, on which drives stop by themselves. Uses no files, clocks or messages.
class StepperDriver {
 public:
  /// Creates the driver in DriverState::off.
  /// @param bus    bus; must outlive the driver and receive listen_ids()
  /// @param config settings
  /// @throws ArgumentError listing every problem of config (problems_of())
  StepperDriver(can::Bus& bus, const StepperConfig& config);
  StepperDriver(const StepperDriver&) = delete;
  StepperDriver& operator=(const StepperDriver&) = delete;

  /// Returns the identifiers that the driver must receive, including those that it sends.
  /// @param config settings with the node ids
  /// @return 11-bit identifiers
  static std::vector<std::uint32_t> listen_ids(const StepperConfig& config);

  /// Performs one cycle; call it every config.period_ns. Does not allocate, lock or block.
  /// @param now_ns   steady clock, ns
  /// @param setpoint newest set-point (pass it again while its age grows), or empty
  void step(std::int64_t now_ns, const std::optional<MotionSetpoint>& setpoint);
  /// Commands a new set-point between steps; optional. In profile velocity it is sent immediately, in cyclic velocity
  /// with the next SYNC. The limits are those of step().
  /// @param now_ns   steady clock, ns
  /// @param setpoint new set-point
  void take(std::int64_t now_ns, const MotionSetpoint& setpoint);
  /// Processes received frames between steps, when the bus is readable; optional. An error in them stops the axes
  /// immediately, and a command that waited for the echo of the previous one is sent before the next step.
  /// @param now_ns steady clock, ns
  void receive(std::int64_t now_ns);

  /// Requests that both axes are enabled; the following steps carry it out.
  /// @return whether the request is accepted
  EnableAnswer enable();
  /// Requests that the drives decelerate and release the axes; the state returns to ready.
  void disable();
  /// Stops both axes by a quick stop, latched and sent immediately. Does nothing if a stop is latched already.
  /// @param reason reason of the stop
  /// @param now_ns steady clock, ns
  void stop_now(StopReason reason, std::int64_t now_ns);
  /// Leaves a latched stop: the drives are configured again, and faults are reset.
  /// @return false if no stop is latched
  bool rearm();
  /// Makes the present position of both axes the entry point.
  void set_zero();
  /// Accepts the drives' positions as valid although a drive was not monitored.
  void confirm_position();

  /// @return true if a command waits for the echo of the previous one
  bool command_waits() const { return command_waits_[kInsertion] || command_waits_[kRotation]; }
  /// @return true if a rate other than zero is commanded
  bool moving() const;
  /// @return state of the axes and the driver after the last step
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
  bool silent_ = false;  // another master was active first: send no frame
  bool enable_wanted_ = false;
  bool reset_faults_ = false;        // rearm() was called
  bool withhold_heartbeat_ = false;  // a drive did not confirm the stop: its heartbeat monitoring must stop it
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
  std::array<bool, kAxes> command_waits_{};  // for the echo of the previous one
  std::array<bool, kAxes> at_limit_{};       // limit bit of the newest statuswords
  DriverCounters counters_;
};

}  // namespace bevel::stepper
