// SPDX-License-Identifier: MIT
#include "tests/faults/fault_matrix.hpp"

#include <algorithm>
#include <cmath>

#include <bevel/estimator/health.hpp>
#include <bevel/model/lie.hpp>

namespace bevel::test {
namespace {

using nodes::Component;
using nodes::FaultKind;

constexpr double kHour_us = 3.6e9;
constexpr double kBehind_unit = 0.06;  // mm or rad: 0.05 that the driver tolerates, and 0.01 for scale and timing

std::size_t axis_of(Component drive) { return drive == Component::insertion_drive ? 0 : 1; }

nodes::LcmPort* port_of(SimulatedLoop& loop, Component component) {
  switch (component) {
    case Component::camera:
      return &loop.camera_port;
    case Component::estimator:
      return loop.estimator ? &loop.estimator->port() : nullptr;
    case Component::controller:
      return loop.controller ? &loop.controller->port() : nullptr;
    case Component::stepper:
      return loop.stepper ? &loop.stepper->port() : nullptr;
    case Component::insertion_drive:
    case Component::rotation_drive:
      break;
  }
  return nullptr;
}

void kill(SimulatedLoop& loop, Component component) {
  if (component == Component::estimator) loop.estimator.reset();
  if (component == Component::controller) loop.controller.reset();
  if (component == Component::stepper) loop.stepper.reset();
}

// What is said of a process whose messages do not come, come late or mean nothing.
std::vector<std::string> causes_of_silence(Component component) {
  switch (component) {
    case Component::camera:
      return {"measurements stale", "a camera fell silent"};
    case Component::estimator:
      return {"needle state stale"};
    case Component::controller:
      return {"set-points too old"};
    case Component::stepper:
      return {"actuator state stale"};
    case Component::insertion_drive:
      return {"insertion: "};
    case Component::rotation_drive:
      return {"rotation: "};
  }
  return {};
}

std::vector<std::string> causes_of(Component component, FaultKind kind) {
  std::vector<std::string> causes = causes_of_silence(component);
  const std::string channel = nodes::channel_of(component);
  const bool process = !channel.empty();
  // Another's message that comes first is known by what it says.
  if (process && (kind == FaultKind::replayed || kind == FaultKind::second_sender))
    return {"a second sender on " + channel, channel + " comes out of order", channel + ": jump of the "};
  if (kind == FaultKind::wrong || kind == FaultKind::stuck) {
    if (component == Component::camera) causes.insert(causes.end(), {"rejecting measurements", "a camera is frozen"});
    if (component == Component::estimator)
      causes.insert(causes.end(), {"NEEDLE_STATE: ", "farther from the entry than the needle was inserted"});
    if (component == Component::controller) causes = {"does not follow the command", "set-points too old"};
    if (component == Component::stepper) causes.push_back("ACTUATOR_STATE: ");
  }
  if (!process) {
    causes.push_back("another master commands the drives");
    // An old report tells an old rate.
    if (kind == FaultKind::stuck || kind == FaultKind::replayed)
      causes.push_back(component == Component::insertion_drive ? "insertion does not follow"
                                                               : "rotation does not follow");
    // Positions that are not those of the shaft are known by their jumps.
    const std::string what = component == Component::insertion_drive ? "insertion" : "rotation";
    causes.push_back("ACTUATOR_STATE: jump of the " + what);
    causes.push_back("ACTUATOR_STATE: " + what + " rate");
  }
  return causes;
}

// A blocked motor shows once it stands nowhere it was told to be within what an axis may lag; a controller whose
// commands stand still, once they are none of what it meant within the delay of the axes. Until then the needle does
// what it should.
std::function<bool(const SimulatedLoop&)> shows(Component component, FaultKind kind) {
  if (kind != FaultKind::stuck) return {};
  if (component == Component::controller)
    return [](const SimulatedLoop& loop) {
      const controller::SafetyLimits& limits = loop.config.controller.safety;
      const auto off = [&](double sent, double controller::Rates::*rate, double allowed) {
        return std::ranges::all_of(loop.meant,
                                   [&](const controller::Rates& r) { return std::abs(r.*rate - sent) > allowed; });
      };
      return off(loop.sent.insertion_rate_mm_s, &controller::Rates::insertion_mm_s, limits.tracking_error_mm_s) ||
             off(loop.sent.rotation_rate_rad_s, &controller::Rates::rotation_rad_s, limits.tracking_error_rad_s);
    };
  if (nodes::channel_of(component)[0] != '\0') return {};
  const std::size_t axis = axis_of(component);
  return [axis](const SimulatedLoop& loop) {
    const double shaft = loop.rig->drive(axis).position_unit();
    return std::ranges::all_of(loop.told, [&](const auto& told) { return told.at(axis) > shaft + kBehind_unit; }) ||
           std::ranges::all_of(loop.told, [&](const auto& told) { return told.at(axis) < shaft - kBehind_unit; });
  };
}

FaultClass process_fault(Component component, FaultKind kind) {
  FaultClass c;
  c.name = std::string(nodes::name_of(component)) + ":" + nodes::name_of(kind);
  c.causes = causes_of(component, kind);
  c.inject = [component, kind](SimulatedLoop& loop, std::mt19937_64& rng) {
    loop.injector(component)->begin(kind, loop.ns(), rng());
  };
  c.mend = [component](SimulatedLoop& loop) {
    if (nodes::LcmPort* port = port_of(loop, component)) port->inject(nullptr);
  };
  c.shows = shows(component, kind);
  return c;
}

FaultClass killed(Component component) {
  FaultClass c;
  c.name = std::string(nodes::name_of(component)) + ":killed";
  c.causes = causes_of_silence(component);
  // Its own reports cease with the driver; the drives have seen to themselves.
  if (component == Component::stepper) c.causes.push_back("needle state stale");
  c.inject = [component](SimulatedLoop& loop, std::mt19937_64&) { kill(loop, component); };
  c.mend = [component](SimulatedLoop& loop) {
    if (component == Component::estimator) loop.start_estimator();
    if (component == Component::controller) loop.start_controller();
    if (component == Component::stepper) loop.start_stepper();
  };
  return c;
}

FaultClass drive_fault(Component component, FaultKind kind) {
  FaultClass c;
  c.name = std::string(nodes::name_of(component)) + ":" + nodes::name_of(kind);
  c.causes = causes_of(component, kind);
  c.inject = [component, kind](SimulatedLoop& loop, std::mt19937_64& rng) {
    if (kind == FaultKind::stuck) {
      loop.rig->drive(axis_of(component)).set_motor_blocked(true);
    } else {
      loop.rig->faulty_bus(axis_of(component)).begin(kind, loop.ns(), rng());
    }
  };
  c.mend = [component](SimulatedLoop& loop) {
    loop.rig->drive(axis_of(component)).set_motor_blocked(false);
    loop.rig->faulty_bus(axis_of(component)).end();
  };
  c.shows = shows(component, kind);
  return c;
}

// ACTUATOR_STATE is not published for a time while the driver works on, and comes again: what the axes did meanwhile
// nobody has observed.
FaultClass gap_of_axes() {
  FaultClass c;
  c.name = "stepper:gap";
  c.causes = causes_of_silence(Component::stepper);
  c.inject = [](SimulatedLoop& loop, std::mt19937_64& rng) {
    loop.injector(Component::stepper)->begin(FaultKind::off, loop.ns(), rng());
    const auto length_ms = std::uniform_int_distribution<std::int64_t>(200, 700)(rng);
    loop.each_ms = [&loop, until = loop.ms + length_ms] {
      if (loop.ms == until && loop.stepper) loop.stepper->port().inject(nullptr);
    };
  };
  c.mend = [](SimulatedLoop& loop) { loop.each_ms = nullptr; };
  c.judge = [](const SimulatedLoop& loop) -> std::string {
    const estimator::Estimate e = loop.estimator->estimator().estimate(loop.utime());
    if (e.state.reset_cause != estimator::ResetCause::gap) return "the estimate passed the gap without a reset";
    const model::Vector6d error = model::log_se3(e.tip.inverse() * loop.rig->plant().tip());
    const double nees = error.dot(e.state.covariance.topLeftCorner<6, 6>().ldlt().solve(error));
    // A chi-square of six exceeds it once in ten million times.
    return nees < 42 ? "" : "pose NEES " + std::to_string(nees) + " after the gap";
  };
  return c;
}

// One camera of two is wrong until it is rejected, and then gone. It shows with its second rejected measurement: one
// alone is an outlier, which the gate keeps out.
FaultClass rejected_camera_vanishes() {
  FaultClass c;
  c.name = "camera:rejected, vanishes";
  c.causes = {"rejecting measurements", "a camera fell silent"};
  c.inject = [](SimulatedLoop& loop, std::mt19937_64& rng) {
    const int which = static_cast<int>(rng() & 1U);
    const double off_mm = std::uniform_real_distribution<double>(6, 20)(rng);
    loop.see = [&loop, which, off_mm, gone = std::optional<std::int64_t>{}](
                   const Eigen::Vector3d& tip, std::int64_t, int camera) mutable -> std::optional<tip_measurement_t> {
      tip_measurement_t m = loop.picture(tip, camera);
      if (camera != which) return m;
      if (!gone && loop.needle_state && (loop.needle_state->health & estimator::kRejecting) != 0) gone = loop.ms;
      if (gone) return std::nullopt;
      m.position_mm[camera == 0 ? 1 : 0] += off_mm;
      return m;
    };
  };
  c.shows = [](const SimulatedLoop& loop) {
    return loop.needle_state && (loop.needle_state->health & (estimator::kUnsure | estimator::kRejecting)) != 0;
  };
  c.mend = [](SimulatedLoop& loop) { loop.run(1); };
  c.judge = [](const SimulatedLoop& loop) -> std::string {
    const bool rejecting = (loop.needle_state->health & estimator::kRejecting) != 0;
    return rejecting ? "still \"rejecting measurements\" of a camera that is gone" : "";
  };
  return c;
}

}  // namespace

std::vector<FaultClass> fault_classes() {
  std::vector<FaultClass> classes;
  for (int c = 0; c < nodes::kComponents; ++c)
    for (int k = 0; k < nodes::kFaultKinds; ++k) {
      const auto component = static_cast<Component>(c);
      const auto kind = static_cast<FaultKind>(k);
      const bool process = nodes::channel_of(component)[0] != '\0';
      classes.push_back(process ? process_fault(component, kind) : drive_fault(component, kind));
    }
  for (const Component component : {Component::estimator, Component::controller, Component::stepper})
    classes.push_back(killed(component));

  FaultClass clock;
  clock.name = "clock:set";
  clock.causes = {"the wall clock was set"};
  clock.inject = [](SimulatedLoop& loop, std::mt19937_64& rng) {
    const double size_us = std::exp(std::uniform_real_distribution<double>(std::log(5e4), std::log(kHour_us))(rng));
    loop.clock_offset_us += (rng() & 1U) != 0 ? std::llround(size_us) : -std::llround(size_us);
  };
  clock.mend = [](SimulatedLoop& loop) { loop.clock_offset_us = 0; };
  classes.push_back(clock);

  // Words of before a stop come again after it, as they were and under new stamps.
  FaultClass words;
  words.name = "operator:replayed";
  words.causes = {"stopped by the operator"};
  words.inject = [](SimulatedLoop& loop, std::mt19937_64& rng) {
    const Eigen::Vector3d target(0, 0, 100);
    const bool restamped = (rng() & 1U) != 0;
    loop.each_ms = [&loop, restamped,
                    before = std::array{loop.word(nodes::Word::arm, target), loop.word(nodes::Word::start, target)}] {
      if (loop.ms % 100 != 0) return;
      for (steering_target_t m : before) {
        if (restamped) m.utime = loop.utime(), m.seq = loop.target_seq++;
        loop.port.publish(io::channel::kSteeringTarget, m);
      }
    };
    loop.say(nodes::Word::stop);
  };
  words.mend = [](SimulatedLoop& loop) { loop.each_ms = nullptr; };
  classes.push_back(words);

  // Its last heartbeat is up to 50 ms old; the fault is there once the heartbeat has timed out.
  FaultClass hung;
  hung.name = "operator:hung";
  hung.causes = {"operator program does not respond"};
  hung.inject = [](SimulatedLoop& loop, std::mt19937_64&) { loop.operator_hangs = true; };
  hung.mend = [](SimulatedLoop& loop) { loop.operator_hangs = false; };
  hung.shows = [](const SimulatedLoop& loop) {
    return static_cast<double>(loop.ms - loop.heartbeat_ms) > 1e3 * loop.config.controller.operator_timeout_s;
  };
  classes.push_back(hung);
  classes.push_back(gap_of_axes());
  classes.push_back(rejected_camera_vanishes());
  std::ranges::move(drive_fault_classes(), std::back_inserter(classes));
  return classes;
}

}  // namespace bevel::test
