// SPDX-License-Identifier: MIT
// A supervisor that is given good readings, until a test gives it others.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>

#include <bevel/controller/supervisor.hpp>
#include "tests/controller/agar.hpp"

namespace bevel::controller {

class SupervisorTest : public ::testing::Test {
 protected:
  NeedleView view(std::int64_t utime) {
    NeedleView v;
    v.utime = utime;
    v.curvature_per_mm = 0.0047;
    v.lambda1_per_rad = 0.49;
    v.lambda2 = 0.22;
    v.position_variance_mm2 = 0.01;
    return v;
  }
  model::ActuatorState axes(std::int64_t utime, const model::MotionCommand& following = {}) {
    model::ActuatorState a;
    a.utime = utime;
    a.axis_status = {2, 2};
    a.insertion_mm = 0;
    a.insertion_rate_mm_s = following.insertion_rate_mm_s;
    a.rotation_rate_rad_s = following.rotation_rate_rad_s;
    return a;
  }
  void start() {
    supervisor.set_needle(view(now));
    supervisor.set_actuator(axes(now));
    supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
    ASSERT_EQ(supervisor.status().state, State::armed);
    supervisor.request(Request::start, std::nullopt, now);
    ASSERT_EQ(supervisor.status().state, State::steering);
  }
  // How long it stays armed with axes that report this, given a period of so much; 10 s at most.
  double wait_while_armed(model::ActuatorState reported, double period_s) {
    double waited_s = 0;
    for (; waited_s < 10 && supervisor.status().state == State::armed; waited_s += period_s) {
      now += std::llround(1e6 * period_s);
      supervisor.set_needle(view(now));
      reported.utime = now;
      supervisor.set_actuator(reported);
      supervisor.step(now, period_s);
    }
    return waited_s;
  }
  // One good period; its command.
  model::MotionCommand good_step() {
    now += 20'000;
    supervisor.set_needle(view(now));
    supervisor.set_actuator(axes(now, last));
    last = supervisor.step(now, 0.02);
    return last;
  }
  void expect_stopped(Reason reason) {
    const auto command = supervisor.step(now, 0.02);
    EXPECT_EQ(supervisor.status().reason, reason) << to_string(supervisor.status().reason);
    EXPECT_EQ(command.mode, 0);
    EXPECT_EQ(command.insertion_rate_mm_s, 0);
    EXPECT_EQ(command.rotation_rate_rad_s, 0);
    // Good input does not bring motion back; nor does start without a new arm.
    EXPECT_EQ(good_step().mode, 0);
    supervisor.request(Request::start, std::nullopt, now);
    EXPECT_EQ(good_step().mode, 0);
    EXPECT_EQ(supervisor.status().reason, reason) << "the first reason stays";
    start();
    EXPECT_EQ(good_step().mode, 1);
  }
  ControllerConfig config;
  Supervisor supervisor{config, agar()};
  model::MotionCommand last;
  std::int64_t now = 1'700'000'000'000'000;
};

}  // namespace bevel::controller
