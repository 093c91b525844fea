// SPDX-License-Identifier: MIT
#include "tests/loop/simulated_loop.hpp"

#include <cstdlib>

#include <bevel/drivers/can/open_bus.hpp>
#include <bevel/nodes/runtime.hpp>

namespace bevel::test {

nodes::SystemConfig loop_config() {
  nodes::SystemConfig config;
  config.needle.lambda1_per_rad = 0.49;
  config.needle.lambda2 = 0.22;
  config.estimator.prior.needle = config.needle;
  config.estimator.through_channel = config.controller.through_channel = true;  // as a system file has it
  config.rig.truth = config.needle;
  config.rig.truth.curvature_per_mm *= 1.15;
  config.rig.truth.lambda1_per_rad *= 0.8;
  config.rig.roll_error_rad = 0.05;
  return config;
}

SimulatedLoop::SimulatedLoop(std::uint64_t seed, const nodes::SystemConfig& settings) : config(settings), rng(seed) {
  if (const char* can = std::getenv("BEVEL_CAN")) {
    real_can = true;
    stepper_bus = can::open_bus(can, stepper::StepperDriver::listen_ids(config.stepper));
    drive_buses = {can::open_bus(can), can::open_bus(can)};
    start_ns = nodes::now().ns;
  } else {
    stepper_bus = network.attach();
    drive_buses = {network.attach(), network.attach()};
  }
  rig = std::make_unique<nodes::RigNode>(lcm, *drive_buses[0], *drive_buses[1], config, nullptr);
  install_injector(nodes::Component::camera, camera_port);
  start_stepper();
  start_estimator();
  start_controller();
  see = [this](const Eigen::Vector3d& tip, std::int64_t, int which) { return picture(tip, which); };
  port.subscribe<process_status_t>(io::channel::kProcessStatus,
                                   [this](const process_status_t& m) { statuses[m.process] = m; });
  port.subscribe<needle_state_t>(io::channel::kNeedleState, [this](const needle_state_t& m) { needle_state = m; });
  port.subscribe<motion_command_t>(io::channel::kMotionCommand, [this](const motion_command_t& m) { sent = m; });
}

void SimulatedLoop::install_injector(nodes::Component component, nodes::LcmPort& to) {
  auto injector = std::make_unique<nodes::FaultInjector>(component);
  injectors_.at(static_cast<std::size_t>(component)) = injector.get();
  to.inject(std::move(injector));
}

void SimulatedLoop::start_stepper() {
  stepper.reset();
  stepper = std::make_unique<nodes::StepperNode>(lcm, *stepper_bus, config.stepper);
  install_injector(nodes::Component::stepper, stepper->port());
}

void SimulatedLoop::start_estimator() {
  estimator.reset();
  estimator = std::make_unique<nodes::EstimatorNode>(lcm, config.estimator, nodes::motion_bounds(config.stepper));
  install_injector(nodes::Component::estimator, estimator->port());
}

void SimulatedLoop::start_controller() {
  controller.reset();
  controller = std::make_unique<nodes::ControllerNode>(lcm, config);
  install_injector(nodes::Component::controller, controller->port());
}

tip_measurement_t SimulatedLoop::picture(const Eigen::Vector3d& tip, int which) {
  tip_measurement_t m{};
  m.utime = utime();
  m.seq = camera_seq_.at(static_cast<std::size_t>(which))++;
  m.camera = which;
  std::normal_distribution<double> noise(0, 0.2);
  for (const int axis : {which == 0 ? 1 : 0, 2}) {
    m.position_mm[axis] = tip[axis] + noise(rng);
    m.information_per_mm2[std::ptrdiff_t{4} * axis] = 1 / (0.2 * 0.2);
  }
  return m;
}

steering_target_t SimulatedLoop::word(nodes::Word word, const Eigen::Vector3d& target) {
  steering_target_t t{};
  t.utime = utime();
  t.seq = target_seq++;
  t.request = static_cast<std::int32_t>(word);
  const char* const receivers[] = {"bevel-controller", "bevel-stepper", "bevel-estimator"};
  for (int i = 0; i < 3; ++i) t.session[i] = said(receivers[i]).session;
  for (int i = 0; i < 3; ++i) t.position_mm[i] = target[i];
  return t;
}

void SimulatedLoop::say(nodes::Word w, const Eigen::Vector3d& target) {
  port.publish(io::channel::kSteeringTarget, word(w, target));
  nodes::pump(lcm);
}

process_status_t SimulatedLoop::said(const std::string& process) const {
  const auto found = statuses.find(process);
  return found == statuses.end() ? process_status_t{} : found->second;
}

void SimulatedLoop::step_one_ms() {
  ++ms;
  while (real_can && nodes::now().ns < ns()) {
  }
  const nodes::Now at = now();
  port.tell_time(at);
  camera_port.tell_time(at);
  if (stepper) stepper->tell_time(at);
  if (estimator) estimator->tell_time(at);
  if (controller) controller->tell_time(at);
  if (!operator_hangs && heartbeat.beat()) heartbeat_ms = ms;
  rig->step(at);
  if (ms % 33 == 0)
    for (const int which : {0, 1})
      if (const auto seen = see(tip(), utime(), which)) in_flight_.push({ms * 1000 + latency_us, *seen});
  for (; !in_flight_.empty() && in_flight_.front().first <= ms * 1000; in_flight_.pop())
    camera_port.publish(io::channel::kTipMeasurement, in_flight_.front().second);
  nodes::pump(lcm);
  if (ms % 10 == 0) {
    if (stepper) stepper->step(at);
    nodes::pump(lcm);
    if (estimator) estimator->step(at);
    nodes::pump(lcm);
    if (ms % 20 == 0 && controller) controller->step(at, 0);
    nodes::pump(lcm);
  }
  if (controller) meant.push_back(controller->supervisor().commanded());
  while (static_cast<double>(meant.size()) > 1e3 * config.controller.safety.axis_delay_s) meant.pop_front();
  const std::array<double, 2> before = told.empty() ? std::array<double, 2>{} : told.back();
  told.push_back({before[0] + 1e-3 * sent.insertion_rate_mm_s, before[1] + 1e-3 * sent.rotation_rate_rad_s});
  while (static_cast<double>(told.size()) > 1e-6 * static_cast<double>(config.stepper.not_following_ns))
    told.pop_front();
  if (each_ms) each_ms();
}

bool SimulatedLoop::run(double seconds, const std::function<bool()>& until) {
  for (const std::int64_t end = ms + static_cast<std::int64_t>(seconds * 1000); ms < end;) {
    step_one_ms();
    if (until()) return true;
  }
  return false;
}

std::string SimulatedLoop::arm(const Eigen::Vector3d& target) {
  using enum stepper::DriverState;
  const auto why = [this] {
    return said("bevel-controller").reason + " / " + said("bevel-stepper").reason + " / " +
           said("bevel-estimator").reason;
  };
  const auto settled = [this] {
    const stepper::DriverState at = stepper->report().state;
    return at == ready || at == enabled || at == stopped || at == fault;
  };
  if (!run(5, settled)) return "axes not ready: " + why();
  run(0.3);
  say(nodes::Word::arm, target);
  if (state() != controller::State::armed) return "not armed: " + std::string(controller::to_string(reason()));
  if (!run(5, [this] { return stepper->report().state == enabled; })) return "axes not enabled: " + why();
  run(0.1);
  return "";
}

std::string SimulatedLoop::steer_to(const Eigen::Vector3d& target) {
  if (std::string failure = arm(target); !failure.empty()) return failure;
  say(nodes::Word::start, target);
  if (state() != controller::State::steering) return "not steering: " + std::string(controller::to_string(reason()));
  return "";
}

}  // namespace bevel::test
