// SPDX-License-Identifier: MIT
#pragma once
// When the needle may move. States: off, armed, steering, retracting, hold, stopped (latched, with its reason), fault.
// Motion fails safe: whatever is missing, stale, unhealthy or out of bounds stops within one period, and only an
// operator's word starts it again.
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

// What the controller needs of NEEDLE_STATE.
struct NeedleView {
  std::int64_t utime = 0;
  model::Pose pose;
  double curvature_per_mm = 0;
  double lambda1_per_rad = 0;
  double lambda2 = 0;
  double bending_mm = 0;  // of a stiff shaft; 0: as configured
  BendUncertainty uncertain;
  double position_variance_mm2 = 0;  // largest along any axis
  double heading_variance_rad2 = 0;  // of the shaft's direction, the larger of the two body axes
  std::int32_t health = 0;           // not zero: it must not be steered by
  bool unsure = false;  // it doubts its newest readings: come to rest, and go on when they are believed again
  std::int32_t reset_count = 0;
  std::int32_t reset_cause = 0;  // bits of bevel/estimator/health.hpp: why the newest reset was declared
  bool from_entry = true;        // the estimator has been there since it went in
};

struct Target {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  double tolerance_mm = 0;  ///< distance, mm, that counts as an arrival; 0: SafetyLimits::arrival_tolerance_mm
  std::int64_t utime = 0;   // when it was there; 0: now
  std::int64_t utime_or(std::int64_t now_utime) const { return utime != 0 ? utime : now_utime; }
};

/// The place of a refused value and the range that is allowed there; the value is Status::value.
struct Allowed {
  const char* place = "";  ///< empty: the reason has no range
  double least = 0, most = 0;
  const char* remedy = "";
};

struct Status {
  State state = State::off;
  Reason reason = Reason::none;
  double value = 0;  // the value behind the reason (an age, a miss, a rate...), in `unit`
  const char* unit = "";
  Allowed allowed;
  /// Prediction while armed and steering, if the law steers on; the final one after Reason::arrived and missed.
  Miss miss;
  /// While steering: the predicted miss exceeds the tolerance by more than its uncertainty. `lost_miss` is the
  /// prediction when this was found, or when it had grown by half a millimetre since.
  bool target_lost = false;
  Miss lost_miss;
  SteeringGeometry geometry;  // of Law::spin
  ArcGeometry arc;            // of Law::arcs and Law::flip
};

/// Returns the reason of \p status as text for the operator: place, value, allowed range and remedy where there are
/// any; the miss with its uncertainty and tolerance after an insertion, and while the target is lost. Allocates.
std::string describe(const Status& status);

class Supervisor {
 public:
  // `needle` gives ell and the variants; k and lambda come with each state. `effects` of the model file: what keeps the
  // tip from turning with the base is undone; the rest is the estimator's.
  Supervisor(const ControllerConfig& config, const model::NeedleParameters& needle,
             std::vector<model::ActiveEffect> effects = {});

  // The newest of each; the supervisor judges their age by the time handed to step().
  void set_needle(const NeedleView& view) {
    needle_state_ = view;
    watch_way_in();
  }
  void set_actuator(const model::ActuatorState& state) {
    actuator_ = state;
    watch_way_in();
    axes_.follow(state, needle_state_ ? needle_state_->pose.p_mm.z() : 0);
  }

  // An operator's word. arm: takes the target and leaves off, hold or stopped; refused (reason latched) when out of
  // reach. start: from armed or hold to steering, once both axes are enabled. hold: comes to rest within the limits of
  // acceleration, may go on, if the target is still within reach and it is known where the needle cuts. stop: latched.
  // follow: where the target is now, in motion too; it is aimed at where it will be (rendezvous.hpp), and stops the
  // needle when that is out of reach. way_point: to be passed on the way to the target that is armed next, in the order
  // told, within its tolerance (0: 1 mm); a start and a stop forget those told so far. retract: draws the needle back
  // until no more of it is inserted than target's z says (mm, by the axis; 0: to the entry), then holds; from hold,
  // armed or steering, once what moves has come to rest by the ramp, at its own rate, with the bevel at rest: the cable
  // is not unwound. A depth that is not behind the tip is a latched stop, and so is a needle with a channel that this
  // supervisor, or the estimator, has not watched go in. arm_to_retract: arms without a target, for that alone; a tip
  // in an obstacle's clearance, too deep or too far aside is drawn back from there.
  void request(Request request, const std::optional<Target>& target, std::int64_t now_utime);
  // Latches what others found: overrun, input_refused, ending.
  void report(Reason reason) { stop(reason, 0, ""); }

  // It was told to move, and is not at rest of itself.
  bool moves() const { return status_.state == State::steering || status_.state == State::retracting; }

  // Between periods, when something has come in: whether motion may go on. False once: it was latched just now.
  bool watch(std::int64_t now_utime);

  // One period: rates to command now. mode 1 while steering and holding, else 0: stop. Does not allocate. elapsed_s:
  // since the last one, more than a period where some were missed; time that counts against a limit is counted by it,
  // while rates change by no more than one period's worth.
  model::MotionCommand step(std::int64_t now_utime, double elapsed_s);

  const Status& status() const { return status_; }
  const Rates& commanded() const { return rates_; }  // by the last step

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
  /// Insertion of the base, mm, until the closest approach to a target that lies \p ahead_mm ahead of the tip.
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
  PathPoints way_points_;         // until it starts
  bool way_points_lost_ = false;  // more than there is room for
  void forget_way_points() { way_points_ = {}, way_points_lost_ = false; }
  bool pauses_for_path_ = false;
  // Position of a moving target at the closest approach, and its standard deviation.
  Eigen::Vector3d met_mm_ = Eigen::Vector3d::Zero();
  double met_sd_mm_ = 0;
  std::optional<double> beyond_since_mm_;  // of insertion: the predicted miss has exceeded the tolerance since
  bool was_outside_ = false;               // the newest position of a target that moves lay outside the workspace
  Eigen::Vector3d aim_mm_ = Eigen::Vector3d::Zero();  // the target, or where the path to it is a look-ahead later
  ArcLaw arcs_;
  Rates rates_;
  double retract_to_mm_ = 0;
  bool for_retraction_ = false;  // armed for that alone
  bool way_in_watched_ = false;  // by this and by the estimator, since it was out
  // Where it was inserted deepest: there it cuts on, however far it was drawn back.
  struct Front {
    double insertion_mm, rotation_rad;
    model::Pose tip;
    std::int32_t reset_count;
  };
  std::optional<Front> front_;
  std::int64_t seq_ = 0;
  std::int32_t reset_count_ = 0;
  std::optional<std::int64_t> followed_utime_;  // of the last report that was as told
  bool axes_were_enabled_ = false;              // since armed
  double enabling_s_ = 0;
  CommandWatch commands_;  // since armed
  // Where everything stood when the axes had come to rest.
  struct Resting {
    double insertion_mm, rotation_rad;
    Eigen::Vector3d tip_mm;
  };
  std::optional<Resting> resting_;
};

}  // namespace bevel::controller
