// SPDX-License-Identifier: MIT
// An estimate that doubts its newest readings: the needle comes to rest by the ramp, and goes on by itself.
#include <gtest/gtest.h>

#include <cmath>

#include <bevel/controller/supervisor.hpp>

namespace bevel::controller {
namespace {

TEST(Unsure, ComesToRestByTheRampAndGoesOnWithoutAWord) {
  model::NeedleParameters needle;
  const ControllerConfig config;
  Supervisor supervisor(config, needle);
  std::int64_t now = 1'700'000'000'000'000;
  model::MotionCommand last;
  double insertion_mm = 0;
  const auto step = [&](bool unsure) {
    now += 20'000;
    insertion_mm += 0.02 * last.insertion_rate_mm_s;
    NeedleView view;
    view.utime = now;
    view.pose.p_mm.z() = insertion_mm;
    view.curvature_per_mm = 0.0047;
    view.position_variance_mm2 = 0.01;
    view.unsure = unsure;
    supervisor.set_needle(view);
    model::ActuatorState axes;
    axes.utime = now;
    axes.axis_status = {2, 2};
    axes.insertion_mm = insertion_mm;
    axes.insertion_rate_mm_s = last.insertion_rate_mm_s;
    axes.rotation_rate_rad_s = last.rotation_rate_rad_s;
    supervisor.set_actuator(axes);
    const model::MotionCommand command = supervisor.step(now, 0.02);
    const double most = config.limits.insertion_acceleration_mm_s2 * 0.02 + 1e-9;
    EXPECT_LE(std::abs(command.insertion_rate_mm_s - last.insertion_rate_mm_s), most) << "not dropped";
    last = command;
  };
  step(false);
  supervisor.request(Request::arm, Target{{0, -8, 100}, 0}, now);
  supervisor.request(Request::start, std::nullopt, now);
  ASSERT_EQ(supervisor.status().state, State::steering);
  for (int i = 0; i < 50; ++i) step(false);
  const double feed_mm_s = last.insertion_rate_mm_s;
  ASSERT_GT(feed_mm_s, 3);
  const int periods_to_rest =
      static_cast<int>(std::ceil(feed_mm_s / config.limits.insertion_acceleration_mm_s2 / 0.02));
  for (int i = 0; i < periods_to_rest; ++i) step(true);
  EXPECT_EQ(last.insertion_rate_mm_s, 0);
  EXPECT_EQ(last.mode, 1);
  for (int i = 0; i < 100; ++i) step(true);
  EXPECT_EQ(supervisor.status().state, State::steering) << "how long is for the estimator to say";
  EXPECT_EQ(last.insertion_rate_mm_s, 0);
  EXPECT_EQ(last.rotation_rate_rad_s, 0);
  for (int i = 0; i < 50; ++i) step(false);
  EXPECT_GT(last.insertion_rate_mm_s, 3);
}

}  // namespace
}  // namespace bevel::controller
