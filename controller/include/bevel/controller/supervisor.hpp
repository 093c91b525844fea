// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Supervisor of the controller: state machine, safety checks and commanded rates.
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <bevel/controller/arc_law.hpp>
#include <bevel/controller/arrival.hpp>
#include <bevel/controller/axis_model.hpp>
#include <bevel/controller/command_watch.hpp>
#include <bevel/controller/reason.hpp>
#include <bevel/controller/rendezvous.hpp>
#include <bevel/controller/request.hpp>
#include <bevel/controller/route.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::controller {

/// The part of NEEDLE_STATE that the controller uses.
struct NeedleView {
  std::int64_t utime = 0;            ///< time for which the estimate holds, us
  model::Pose pose;                  ///< pose of the shaft's end in {A}, mm
  double curvature_per_mm = 0;       ///< k, 1/mm
  double lambda1_per_rad = 0;        ///< lambda1, 1/rad
  double lambda2 = 0;                ///< lambda2
  double bending_mm = 0;             ///< bending length of a stiff shaft, mm; 0: ShaftConfig::bending_mm
  BendUncertainty uncertain;         ///< standard deviations of k and of the bending length
  double position_variance_mm2 = 0;  ///< largest along any axis, mm^2
  double heading_variance_rad2 = 0;  ///< of the shaft's direction about body x or y, the larger, rad^2
  std::int32_t health = 0;           ///< bits of Health that forbid steering; 0: healthy
  bool unsure = false;  ///< the newest measurements were rejected: stop, and continue when they are accepted again
  std::int32_t reset_count = 0;  ///< declared resets of the estimator
  std::int32_t reset_cause = 0;  ///< cause of the newest reset, one of estimator::kResetBits
  bool from_entry = true;        ///< the estimator has observed the needle since the entry
};

/// Commanded target, way-point or retraction depth.
struct Target {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< position in {A}, mm; of a retraction, z is the depth
  double tolerance_mm = 0;  ///< distance that counts as an arrival, mm; 0: the default (SafetyLimits, way-point)
  std::int64_t utime = 0;   ///< time of the position, us; 0: now
  /// Returns the time of the position.
  /// @param now_utime current time, us
  /// @return `utime`, or \p now_utime if that is 0
  std::int64_t utime_or(std::int64_t now_utime) const { return utime != 0 ? utime : now_utime; }
};

/// Name and allowed range of a rejected value, which is Status::value.
struct Allowed {
  const char* place = "";   ///< name of the quantity; empty: the reason has no range
  double least = 0,         ///< smallest allowed value, mm
      most = 0;             ///< largest allowed value, mm
  const char* remedy = "";  ///< advice to the operator; may be empty
};

/// State of the controller with its reason and the geometry of the law.
struct Status {
  State state = State::off;      ///< state of the supervisor
  Reason reason = Reason::none;  ///< reason of states stopped, fault and hold
  double value = 0;              ///< value that caused the reason, for example an age or a rate, in `unit`
  const char* unit = "";         ///< unit of the value; empty: there is no value
  Allowed allowed;               ///< allowed range of the value
  /// Predicted miss while armed and steering; the final miss after Reason::arrived and Reason::missed.
  Miss miss;
  /// Whether, while steering, the predicted miss exceeds the tolerance by more than its uncertainty.
  bool target_lost = false;
  Miss lost_miss;             ///< predicted miss when `target_lost` was set, or after it has grown by 0.5 mm since
  SteeringGeometry geometry;  ///< geometry of Law::spin
  ArcGeometry arc;            ///< geometry of Law::arcs and Law::flip
};

/// Describes the reason of a status for the operator.
/// @param status status of the supervisor
/// @return quantity, value, allowed range and remedy, as far as the reason has them; after an insertion and while the
///     target is lost, the miss with its uncertainty and tolerance. Empty if there is nothing to report. Allocates.
std::string describe(const Status& status);

/// Decides whether the needle may move, and computes the rates to command.
///
/// The states are off, armed, steering, retracting, hold, stopped (latched, with its reason) and fault. Motion fails
/// safe: input that is missing, stale, unhealthy or out of range stops the needle within one period, and only an
/// operator command starts it again.
class Supervisor {
 public:
  /// Constructs the supervisor in state off.
  /// @param config law, limits and obstacles; copied
  /// @param needle ell and the variants of the slip law; k and lambda come with each NeedleView
  /// @param effects effects of the model file; dead bands of the rotation and jumps of the tip are compensated
  ///     (AxisModel), the others are part of the estimate
  /// @throws bevel::ArgumentError if there are more than model::kMaxEffects effects
  Supervisor(const ControllerConfig& config, const model::NeedleParameters& needle,
             std::vector<model::ActiveEffect> effects = {});

  /// Sets the newest estimate. step() checks its age.
  /// @param view estimate of the needle
  void set_needle(const NeedleView& view) {
    needle_state_ = view;
    watch_way_in();
  }
  /// Sets the newest actuator state. step() checks its age.
  /// @param state positions, mm and rad, rates and status of the axes
  void set_actuator(const model::ActuatorState& state) {
    actuator_ = state;
    watch_way_in();
    axes_.follow(state, needle_state_ ? needle_state_->pose.p_mm.z() : 0);
  }

  /// Executes an operator command. A rejected command latches a reason (Status).
  ///
  /// - arm: takes the target, and leaves off, hold or stopped. Rejected if the target is out of reach.
  /// - start: from armed or hold to steering, once both axes are enabled. The end of the channel must be known, and
  /// after
  ///   a hold the target must still be within reach.
  /// - hold: decelerates within the limits and stops. Steering can continue after a start.
  /// - stop: stops and latches.
  /// - follow: sets the present position of the target, during motion too. The law aims at its predicted position
  ///   (rendezvous.hpp), and the needle stops if that is out of reach.
  /// - way_point: adds a point to be passed on the way to the target that is armed next, in the order of the commands,
  ///   within its tolerance (0: 1 mm). A start and a stop delete the way-points.
  /// - retract: retracts the needle until the axis is at the depth in z of the target (mm; 0: the entry), then holds.
  ///   From armed, hold or steering; axes that move decelerate first. The rate is
  ///   SteeringLimits::retraction_rate_mm_s, and the rotation is stationary, so the cable is not unwound. A depth
  ///   outside 0 to the insertion latches a stop. With ControllerConfig::through_channel, so does an insertion that the
  ///   supervisor or the estimator has not observed from the entry.
  /// - arm_to_retract: arms without a target, for a retraction only. A tip within an obstacle's clearance, too deep or
  ///   too far from the z axis can be retracted.
  /// - entry, confirm: ignored.
  /// @param request the command
  /// @param target target of arm and follow, way-point, or depth of a retraction, {A}, mm; otherwise empty
  /// @param now_utime current time, us
  void request(Request request, const std::optional<Target>& target, std::int64_t now_utime);
  /// Latches a stop whose reason was found outside the supervisor, for example Reason::overrun.
  /// @param reason the reason
  void report(Reason reason) { stop(reason, 0, ""); }

  /// Returns whether the state is steering or retracting.
  /// @return true in one of these states
  bool moves() const { return status_.state == State::steering || status_.state == State::retracting; }

  /// Checks new input between two periods.
  /// @param now_utime current time, us
  /// @return false if this call has latched a stop, and the axes have to be stopped now
  bool watch(std::int64_t now_utime);

  /// Computes the rates to command in this period. Does not allocate.
  /// @param now_utime current time, us
  /// @param elapsed_s time since the previous step, s; more than a period if some were missed. Time limits count all of
  ///     it, while the rates change by at most one period's acceleration.
  /// @return rates, mm/s and rad/s; mode 1 while steering, retracting and in hold, else 0: stop
  model::MotionCommand step(std::int64_t now_utime, double elapsed_s);

  /// Returns the status.
  /// @return state, reason and geometry after the newest command or step
  const Status& status() const { return status_; }
  /// Returns the rates of the newest step.
  /// @return commanded rates, mm/s and rad/s
  const Rates& commanded() const { return rates_; }

 private:
  void stop(Reason reason, double value, const char* unit, const Allowed& allowed = {});
  void clear_reason();
  void hold(Reason reason);
  bool is_inside(const Eigen::Vector3d& target_mm);
  bool refuse_outside(double value, const Allowed& allowed);
  bool follow_target(const Target& target, std::int64_t now_utime);
  double arrival_tolerance_mm() const;
  Miss predicted_miss() const;
  bool check_miss();
  void settle(std::int64_t now_utime);
  bool check_inputs(std::int64_t now_utime);
  bool all_enabled() const;
  bool see_enabled(std::int64_t now_utime);
  bool waits_for_axes(std::int64_t now_utime, double elapsed_s);
  bool check_axes();
  bool check_tracking();
  bool check_rest(std::int64_t now_utime);
  Rates steer(std::int64_t now_utime);
  void start_retraction(const std::optional<Target>& target, std::int64_t now_utime);
  model::MotionCommand retract(model::MotionCommand command, double dt_s);
  void note_front();
  void watch_way_in();
  void await_axes();
  double drawn_back_mm() const;
  bool front_is_lost() const;
  model::Pose cutting_tip() const;
  bool check_reset();
  model::MotionCommand run(model::MotionCommand command, const Rates& wanted, double dt_s);
  bool see_path(double elapsed_s);
  void stop_without_path();
  PathStart path_start() const;
  bool see_geometry();
  double to_go_mm() const;
  // Insertion of the actuator, mm, until the closest approach to a target that lies \p ahead_mm ahead of the tip.
  double insertion_left_mm(double ahead_mm) const;
  bool by_arcs() const { return config_.law != Law::spin; }
  double predicted_miss_mm(const Eigen::Vector3d& target_mm) const;
  bool by_half_turns() const;
  bool check_reach(std::int64_t now_utime);
  model::NeedleParameters needle_now() const;
  ShaftConfig shaft_now() const;
  bool in_motion_states() const { return status_.state == State::armed || status_.state == State::hold || moves(); }

  ControllerConfig config_;
  model::NeedleParameters needle_;
  AxisModel axes_;
  std::optional<NeedleView> needle_state_;
  std::optional<model::ActuatorState> actuator_;
  std::optional<Target> target_;
  Status status_;
  Rendezvous rendezvous_;
  Route route_;
  PathPoints way_points_;         // until the start command
  bool way_points_lost_ = false;  // there were more than kMostWayPoints
  void forget_way_points() { way_points_ = {}, way_points_lost_ = false; }
  bool pauses_for_path_ = false;
  // Position of a moving target at the closest approach, and its standard deviation.
  Eigen::Vector3d met_mm_ = Eigen::Vector3d::Zero();
  double met_sd_mm_ = 0;
  std::optional<double> beyond_since_mm_;  // insertion since which the predicted miss exceeds the tolerance
  bool was_outside_ = false;               // the newest position of a moving target was outside the workspace
  Eigen::Vector3d aim_mm_ = Eigen::Vector3d::Zero();  // the target, or the point of the path at the look-ahead distance
  ArcLaw arcs_;
  Rates rates_;
  double retract_to_mm_ = 0;
  bool for_retraction_ = false;  // armed for a retraction only
  bool way_in_watched_ = false;  // supervisor and estimator have observed the insertion since the entry
  // Deepest insertion, the end of the channel: a retracted needle cuts from there.
  struct Front {
    double insertion_mm, rotation_rad;
    model::Pose tip;
    std::int32_t reset_count;
  };
  std::optional<Front> front_;
  std::int64_t seq_ = 0;
  std::int32_t reset_count_ = 0;
  std::optional<std::int64_t> followed_utime_;  // time of the newest report that agreed with the commands
  bool axes_were_enabled_ = false;              // since armed
  double enabling_s_ = 0;
  CommandWatch commands_;  // since armed
  // Positions when the axes became stationary.
  struct Resting {
    double insertion_mm, rotation_rad;
    Eigen::Vector3d tip_mm;
  };
  std::optional<Resting> resting_;
};

}  // namespace bevel::controller
