// SPDX-License-Identifier: MIT
// Back along the path on command, and where a needle that was drawn back will cut again.
#include <algorithm>
#include <cmath>

#include <bevel/controller/arc_walk.hpp>
#include <bevel/controller/supervisor.hpp>
#include <bevel/model/age.hpp>

namespace bevel::controller {
namespace {
constexpr double kBrakingShare = 0.5;  // of the acceleration, as at the closest approach
constexpr double kThere_mm = 0.05;     // less than what the ramp needs from the rate at which it gets there
constexpr double kAtFront_mm = 0.05;   // less bends by nothing
constexpr double kOut_mm = 1.0;        // not inserted: within what an entry point is met by
}  // namespace

void Supervisor::start_retraction(const std::optional<Target>& target, std::int64_t now_utime) {
  if (!in_motion_states()) return;
  if (status_.state == State::armed && !axes_were_enabled_ && !see_enabled(now_utime)) return;
  if (!check_inputs(now_utime) || !check_axes()) return;
  const double to_mm = target ? target->position_mm.z() : std::nan("");
  if (!(to_mm >= 0 && to_mm <= actuator_->insertion_mm))
    return stop(Reason::retraction_refused, to_mm, "mm",
                {"position_mm[2] of the request", 0, actuator_->insertion_mm, "choose a depth that is inserted"});
  if (config_.through_channel && !way_in_watched_)
    return stop(Reason::way_in_unknown, actuator_->insertion_mm, "mm inserted");
  if (!moves()) reset_count_ = needle_state_->reset_count;
  retract_to_mm_ = to_mm;
  clear_reason();
  status_.state = State::retracting;
}

// The bevel rests, and nothing is drawn while anything still goes in or turns.
model::MotionCommand Supervisor::retract(model::MotionCommand command, double dt_s) {
  const SteeringLimits& limits = config_.limits;
  const double age_s = model::age_s(command.utime, actuator_->utime);
  const double to_go_mm = actuator_->insertion_mm + age_s * actuator_->insertion_rate_mm_s - retract_to_mm_;
  Rates wanted;
  if (to_go_mm <= kThere_mm) {
    hold(Reason::retracted);
  } else if (!needle_state_->unsure && rates_.insertion_mm_s <= 0 && rates_.rotation_rad_s == 0) {
    const double braking = std::sqrt(2 * kBrakingShare * limits.insertion_acceleration_mm_s2 * to_go_mm);
    wanted.insertion_mm_s = -std::min(limits.retraction_rate_mm_s, braking);
  }
  return run(command, wanted, dt_s);
}

// One that began to look when it was inserted does not know the channel, nor does one that was told it is known.
void Supervisor::watch_way_in() {
  if (actuator_ && actuator_->insertion_mm <= kOut_mm)
    way_in_watched_ = true;
  else if (needle_state_ && !needle_state_->from_entry)
    way_in_watched_ = false;
}

// The deepest insertion stays one whatever the estimator declares; only where its end lies is not known after a reset.
void Supervisor::note_front() {
  if (front_ && actuator_->insertion_mm < front_->insertion_mm &&
      (front_->reset_count == needle_state_->reset_count || front_is_lost()))
    return;
  front_ = {actuator_->insertion_mm, actuator_->rotation_rad, needle_state_->pose, needle_state_->reset_count};
}

double Supervisor::drawn_back_mm() const {
  if (!config_.through_channel || !front_ || front_->reset_count != needle_state_->reset_count) return 0;
  const double back_mm = front_->insertion_mm - actuator_->insertion_mm;
  return back_mm > kAtFront_mm ? back_mm : 0;
}

// Until the axis is at the end again, or all the way out.
bool Supervisor::front_is_lost() const {
  return config_.through_channel && front_ && front_->reset_count != needle_state_->reset_count &&
         front_->insertion_mm - actuator_->insertion_mm > kAtFront_mm && actuator_->insertion_mm > kOut_mm;
}

// From where the law's arcs start: the tip, or where it will come out of its channel, with the bevel as it stands now.
model::Pose Supervisor::cutting_tip() const {
  if (drawn_back_mm() == 0) return needle_state_->pose;
  const ArcWalk walk(needle_now(), shaft_now());
  model::Pose middle = walk.middle_of(front_->tip);
  middle.R = middle.R * model::exp_so3({0, 0, actuator_->rotation_rad - front_->rotation_rad});
  return walk.tip_of(middle);
}

}  // namespace bevel::controller
