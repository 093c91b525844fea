// SPDX-License-Identifier: MIT
// The whole loop in one process: estimator, controller and stepper driver as they run live, over LCM in memory, against
// simulated drives on a bus, a needle, and a camera that is mocked at its message. Time is simulated, so a minute of
// steering takes seconds and every run is the same. With BEVEL_CAN=can0 (or vcan0) the frames go over a real SocketCAN
// interface instead, in real time.
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <string>

#include <bevel/drivers/can/memory_bus.hpp>
#include <bevel/nodes/controller_node.hpp>
#include <bevel/nodes/estimator_node.hpp>
#include <bevel/nodes/operator_heartbeat.hpp>
#include <bevel/nodes/rig_node.hpp>
#include <bevel/nodes/stepper_node.hpp>

namespace bevel::test {

// The needle of the rig differs from what the software believes, by 15 % of the curvature and more.
nodes::SystemConfig loop_config();

class SimulatedLoop {
 public:
  static constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;
  // What a camera says of the true tip, or nothing.
  using See = std::function<std::optional<tip_measurement_t>(const Eigen::Vector3d& tip_mm, std::int64_t utime, int)>;

  explicit SimulatedLoop(std::uint64_t seed, const nodes::SystemConfig& settings = loop_config());

  // Both axes at 30 Hz by two cameras with 0.2 mm of noise; `see` is this unless it is replaced.
  tip_measurement_t picture(const Eigen::Vector3d& tip, int which);
  void step_one_ms();
  // Runs for so long, or until `until`.
  bool run(
      double seconds, const std::function<bool()>& until = [] { return false; });
  // An operator's word, meant for the processes as they are now.
  void say(nodes::Word word, const Eigen::Vector3d& target = Eigen::Vector3d::Zero());
  steering_target_t word(nodes::Word word, const Eigen::Vector3d& target);
  // Runs until the axes can be armed, and are enabled; then starts. "" or what did not come about.
  std::string arm(const Eigen::Vector3d& target);
  std::string steer_to(const Eigen::Vector3d& target);

  // A process that is killed, or stands still, is one that is not there: reset() its pointer. Starting one again puts a
  // new one in its place.
  void start_estimator();
  void start_controller();
  void start_stepper();

  std::int64_t utime() const { return kStart_utime + clock_offset_us + ms * 1000; }
  std::int64_t ns() const { return start_ns + ms * 1'000'000; }
  nodes::Now now() const { return {ns(), utime()}; }
  const controller::Status& status() const { return controller->supervisor().status(); }
  controller::State state() const { return status().state; }
  controller::Reason reason() const { return status().reason; }
  Eigen::Vector3d tip() const { return rig->plant().tip().p_mm; }
  double speed(std::size_t axis) { return std::abs(rig->drive(axis).velocity_unit_s()); }
  bool at_rest() { return speed(0) < kRest_unit_s && speed(1) < kRest_unit_s; }
  // What the component sends passes through it from the start; idle until it is told to begin.
  nodes::FaultInjector* injector(nodes::Component component) {
    return injectors_.at(static_cast<std::size_t>(component));
  }
  // Newest of a process on PROCESS_STATUS; empty before the first.
  process_status_t said(const std::string& process) const;

  static constexpr double kRest_unit_s = 0.02;

  nodes::SystemConfig config;
  lcm::LCM lcm{"memq://"};
  nodes::LcmPort port{lcm};  // of operator, cameras and attackers
  can::MemoryNetwork network;
  std::unique_ptr<can::Bus> stepper_bus;
  std::array<std::unique_ptr<can::Bus>, 2> drive_buses;
  std::unique_ptr<nodes::RigNode> rig;
  std::unique_ptr<nodes::StepperNode> stepper;
  std::unique_ptr<nodes::EstimatorNode> estimator;
  std::unique_ptr<nodes::ControllerNode> controller;
  nodes::LcmPort camera_port{lcm};
  nodes::OperatorHeartbeat heartbeat{port};
  bool operator_hangs = false;  // it sends no heartbeat then
  See see;
  std::mt19937_64 rng;
  std::int64_t latency_us = 50'000;
  std::int64_t clock_offset_us = 0;
  std::int64_t heartbeat_ms = 0;  // of the newest heartbeat
  std::int64_t ms = 0, target_seq = 0, start_ns = 1'000'000'000;
  bool real_can = false;
  std::map<std::string, process_status_t> statuses;
  std::optional<needle_state_t> needle_state;
  motion_command_t sent{};                 // newest of the controller
  std::deque<controller::Rates> meant;     // by the controller, each millisecond within the delay of the axes
  std::deque<std::array<double, 2>> told;  // integral of what was sent, mm and rad, within what an axis may lag
  std::function<void()> each_ms;           // called at the end of each, if set

 private:
  void install_injector(nodes::Component component, nodes::LcmPort& port);

  std::array<nodes::FaultInjector*, 4> injectors_{};
  std::queue<std::pair<std::int64_t, tip_measurement_t>> in_flight_;  // by steady time of arrival, us
  std::array<std::int64_t, 2> camera_seq_{};
};

}  // namespace bevel::test
