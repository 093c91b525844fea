// SPDX-License-Identifier: MIT
#include <bevel/controller/reason.hpp>

namespace bevel::controller {

const char* to_string(State state) {
  switch (state) {
    case State::off:
      return "off";
    case State::armed:
      return "armed";
    case State::steering:
      return "steering";
    case State::retracting:
      return "retracting";
    case State::hold:
      return "hold";
    case State::stopped:
      return "stopped";
    case State::fault:
      return "fault";
  }
  return "?";
}

const char* to_string(Reason reason) {
  switch (reason) {
    case Reason::none:
      return "";
    case Reason::operator_stop:
      return "stopped by the operator";
    case Reason::state_stale:
      return "needle state stale or missing";
    case Reason::state_unhealthy:
      return "needle state unhealthy";
    case Reason::state_uncertain:
      return "needle position too uncertain";
    case Reason::state_reset:
      return "the estimator declared a reset";
    case Reason::state_not_finite:
      return "needle state not finite";
    case Reason::actuator_stale:
      return "actuator state stale or missing";
    case Reason::axes_not_enabled:
      return "axes not enabled";
    case Reason::insertion_tracking:
      return "insertion does not follow the command";
    case Reason::rotation_tracking:
      return "rotation does not follow the command";
    case Reason::workspace:
      return "tip outside the workspace";
    case Reason::target_unreachable:
      return "target out of reach";
    case Reason::outside_model:
      return "tip outside the model's domain";
    case Reason::overrun:
      return "control loop too late";
    case Reason::resting_axes_moved:
      return "axes moved though told to rest";
    case Reason::resting_tip_moved:
      return "needle state moved though the axes rest";
    case Reason::off_the_axes:
      return "needle state farther from the entry than the needle was inserted";
    case Reason::input_refused:
      return "input cannot be trusted";
    case Reason::path_blocked:
      return "no path to the target is clear of the obstacles";
    case Reason::obstacle_near:
      return "tip too near to an obstacle";
    case Reason::way_point_missed:
      return "way-point missed";
    case Reason::way_point_unreachable:
      return "way-points and target out of reach one after the other";
    case Reason::way_points_too_many:
      return "too many way-points";
    case Reason::law_without_path:
      return "only the law by arcs goes round obstacles and through way-points";
    case Reason::retraction_refused:
      return "there is no such depth behind the tip to retract to";
    case Reason::channel_unknown:
      return "drawn back in a channel whose end is not known since a reset";
    case Reason::way_in_unknown:
      return "its way in was not watched, so it is not drawn back by itself: draw it out by hand";
    case Reason::operator_silent:
      return "operator program does not respond";
    case Reason::ending:
      return "told to end";
    case Reason::target_outside:
      return "target outside the workspace";
    case Reason::held:
      return "held by the operator";
    case Reason::coming_to_rest:
      return "at the closest approach, coming to rest";
    case Reason::arrived:
      return "arrived";
    case Reason::missed:
      return "missed the target";
    case Reason::retracted:
      return "retracted";
  }
  return "?";
}

bool refuses_target(Reason reason) {
  switch (reason) {
    case Reason::target_outside:
    case Reason::target_unreachable:
    case Reason::path_blocked:
    case Reason::way_point_unreachable:
    case Reason::law_without_path:
      return true;
    default:
      return false;
  }
}

}  // namespace bevel::controller
