// The whole loop in one process: estimator, controller and stepper driver as they run live, over LCM in memory, against
// simulated drives on a bus, a needle, and a camera that is mocked at its message. Time is simulated, so a minute of
// steering takes seconds and every run is the same. With BEVEL_CAN=can0 (or vcan0) the frames go over a real SocketCAN
// interface instead, in real time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <queue>
#include <random>

#include "drivers/can/memory_bus.hpp"
#include "drivers/can/open_bus.hpp"
#include "nodes/controller_node.hpp"
#include "nodes/estimator_node.hpp"
#include "nodes/rig_node.hpp"
#include "nodes/runtime.hpp"
#include "nodes/stepper_node.hpp"

namespace bevel {
namespace {

constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;
constexpr unsigned kSeed = 9;

// The camera, mocked at the interface that the loop sees: what it says of the true tip, or nothing.
class MockCamera {
 public:
  MOCK_METHOD(std::optional<tip_measurement_t>, see, (const Eigen::Vector3d& tip_mm, std::int64_t utime, int camera));
};

class Loop : public ::testing::Test {
 protected:
  void SetUp() override {
    config.needle.lambda1_per_rad = 0.49;
    config.needle.lambda2 = 0.22;
    config.estimator.prior.needle = config.needle;
    config.rig.truth = config.needle;
    config.rig.truth.curvature_per_mm *= 1.15;
    config.rig.truth.lambda1_per_rad *= 0.8;
    config.rig.roll_error_rad = 0.05;
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
    stepper = std::make_unique<nodes::StepperNode>(lcm, *stepper_bus, config.stepper);
    estimator = std::make_unique<nodes::EstimatorNode>(lcm, config.estimator);
    controller =
        std::make_unique<nodes::ControllerNode>(lcm, config.controller, config.needle, config.live_effects.active);
    ON_CALL(camera, see).WillByDefault([this](const Eigen::Vector3d& tip, std::int64_t utime, int which) {
      return picture(tip, utime, which);
    });
  }

  std::optional<tip_measurement_t> picture(const Eigen::Vector3d& tip, std::int64_t utime, int which) {
    tip_measurement_t m{};
    m.utime = utime;
    m.seq = seq++;
    m.camera = which;
    std::normal_distribution<double> noise(0, 0.2);
    for (const int axis : {which == 0 ? 1 : 0, 2}) {
      m.position_mm[axis] = tip[axis] + noise(rng);
      m.information_per_mm2[4 * axis] = 1 / (0.2 * 0.2);
    }
    return m;
  }

  void say(int request, const Eigen::Vector3d& target = Eigen::Vector3d::Zero()) {
    steering_target_t t{};
    t.utime = utime();
    t.seq = target_seq++;
    t.request = request;
    for (int i = 0; i < 3; ++i) t.position_mm[i] = target[i];
    port.publish(io::channel::kSteeringTarget, t);
    nodes::pump(lcm);
  }

  std::int64_t utime() const { return kStart_utime + ms * 1000; }
  controller::State state() const { return controller->supervisor().status().state; }
  controller::Reason reason() const { return controller->supervisor().status().reason; }
  Eigen::Vector3d tip() const { return rig->plant().tip().p_mm; }
  double speed() { return std::abs(rig->drive(0).velocity_unit_s()); }

  // Runs the loop for so long, or until `until`.
  bool run(
      double seconds, const std::function<bool()>& until = [] { return false; }) {
    for (const std::int64_t end = ms + static_cast<std::int64_t>(seconds * 1000); ms < end;) {
      ++ms;
      const std::int64_t ns = start_ns + ms * 1'000'000;
      while (real_can && nodes::now().ns < ns) {
      }
      rig->step(ns, utime());
      if (ms % 33 == 0) {
        for (const int which : {0, 1})
          if (const auto seen = camera.see(tip(), utime(), which)) in_flight.push({utime() + latency_us, *seen});
      }
      while (!in_flight.empty() && in_flight.front().first <= utime()) {
        port.publish(io::channel::kTipMeasurement, in_flight.front().second);
        in_flight.pop();
      }
      nodes::pump(lcm);
      if (ms % 10 == 0 && stepper_alive) stepper->step(ns, utime());
      nodes::pump(lcm);
      if (ms % 10 == 0) estimator->step(utime());
      nodes::pump(lcm);
      if (ms % 20 == 0 && controller_alive) controller->step(utime(), 0);
      nodes::pump(lcm);
      if (until()) return true;
    }
    return false;
  }

  void steer_to(const Eigen::Vector3d& target) {
    using enum stepper::DriverState;
    ASSERT_TRUE(run(5, [this] { return stepper->report().state == ready || stepper->report().state == stopped; }));
    run(0.3);
    say(1, target);
    ASSERT_EQ(state(), controller::State::armed) << controller::to_string(reason());
    ASSERT_TRUE(run(5, [this] { return stepper->report().state == stepper::DriverState::enabled; }));
    run(0.1);
    say(2);
    ASSERT_EQ(state(), controller::State::steering) << controller::to_string(reason());
  }

  nodes::SystemConfig config;
  lcm::LCM lcm{"memq://"};
  nodes::LcmPort port{lcm};
  can::MemoryNetwork network;
  std::unique_ptr<can::Bus> stepper_bus;
  std::array<std::unique_ptr<can::Bus>, 2> drive_buses;
  std::unique_ptr<nodes::RigNode> rig;
  std::unique_ptr<nodes::StepperNode> stepper;
  std::unique_ptr<nodes::EstimatorNode> estimator;
  std::unique_ptr<nodes::ControllerNode> controller;
  ::testing::NiceMock<MockCamera> camera;
  std::queue<std::pair<std::int64_t, tip_measurement_t>> in_flight;
  std::mt19937_64 rng{kSeed};
  std::int64_t latency_us = 50'000;
  std::int64_t ms = 0, seq = 0, target_seq = 0, start_ns = 1'000'000'000;
  bool real_can = false, stepper_alive = true, controller_alive = true;
};

TEST_F(Loop, SteersToATargetAndHoldsThere) {
  const Eigen::Vector3d target(6, -9, 100);
  steer_to(target);
  ASSERT_TRUE(run(60, [this] { return state() != controller::State::steering; }));
  EXPECT_EQ(state(), controller::State::hold) << controller::to_string(reason());
  run(0.5);
  const auto& estimate = estimator->estimator().estimate(utime());
  const double miss = (tip() - target).norm();
  const double estimate_error = (estimate.state.pose.p_mm - tip()).norm();
  std::cout << "seed " << kSeed << ": tip to target " << miss << " mm, estimate to tip " << estimate_error
            << " mm, lambda " << estimate.state.lambda1_per_rad << ", " << estimate.state.lambda2 << "\n";
  EXPECT_LT(miss, 0.8);
  EXPECT_LT(estimate_error, 0.6);
  EXPECT_LT(speed(), 0.01);
}

TEST_F(Loop, ACameraThatFallsSilentStopsTheNeedleAndNothingRestartsByItself) {
  steer_to({6, -9, 100});
  run(4);
  ASSERT_GT(speed(), 1.0);
  ON_CALL(camera, see).WillByDefault(::testing::Return(std::nullopt));
  const std::int64_t silent_since = ms;
  ASSERT_TRUE(run(2, [this] { return speed() < 0.01; }));
  std::cout << "at rest " << ms - silent_since << " ms after the last picture was taken\n";
  EXPECT_LT(ms - silent_since, 200);
  EXPECT_EQ(reason(), controller::Reason::state_unhealthy);
  const Eigen::Vector3d stopped = tip();
  ON_CALL(camera, see).WillByDefault([this](const Eigen::Vector3d& t, std::int64_t u, int w) {
    return picture(t, u, w);
  });
  run(1);
  EXPECT_EQ(state(), controller::State::stopped);
  EXPECT_LT((tip() - stopped).norm(), 0.05);
}

TEST_F(Loop, AControllerThatDiesStopsTheNeedleWithin200ms) {
  steer_to({6, -9, 100});
  run(4);
  controller_alive = false;
  const std::int64_t died = ms;
  ASSERT_TRUE(run(2, [this] { return speed() < 0.01; }));
  std::cout << "at rest " << ms - died << " ms after the controller's last period\n";
  EXPECT_LT(ms - died, 200);
}

TEST_F(Loop, ADriverThatDiesLeavesItToTheDrives) {
  steer_to({6, -9, 100});
  run(4);
  stepper_alive = false;
  const std::int64_t died = ms;
  ASSERT_TRUE(run(2, [this] { return speed() < 0.01; }));
  std::cout << "at rest " << ms - died << " ms after the driver's last step\n";
  EXPECT_LT(ms - died, 200);
}

TEST_F(Loop, ADriveFaultStopsBothAxesAndTheControllerKnows) {
  steer_to({6, -9, 100});
  run(4);
  rig->drive(1).raise_fault(0x2310);
  ASSERT_TRUE(run(2, [this] { return speed() < 0.01; }));
  run(0.2);
  EXPECT_EQ(state(), controller::State::stopped);
  EXPECT_EQ(reason(), controller::Reason::axes_not_enabled);
  EXPECT_EQ(stepper->report().state, stepper::DriverState::fault);
}

TEST_F(Loop, OperatorStopIsLatchedUntilArmedAgain) {
  steer_to({6, -9, 100});
  run(4);
  say(0);
  ASSERT_TRUE(run(0.3, [this] { return speed() < 0.01; }));
  say(2);
  run(0.5);
  EXPECT_LT(speed(), 0.01);
  steer_to({6, -9, 100});
  run(1);
  EXPECT_GT(speed(), 1.0);
}

TEST_F(Loop, ATargetOutOfReachIsRefusedBeforeTheNeedleMoves) {
  ASSERT_TRUE(run(5, [this] { return stepper->report().state == stepper::DriverState::ready; }));
  run(0.3);
  say(1, {0, 50, 60});
  EXPECT_EQ(reason(), controller::Reason::target_unreachable);
}

}  // namespace
}  // namespace bevel
