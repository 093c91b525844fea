// SPDX-License-Identifier: MIT
// Which targets are accepted and at what cost, what is reported of the miss on the way, and the outcome.
#include <gmock/gmock.h>

#include <algorithm>
#include <ctime>
#include <iostream>
#include <numbers>
#include <random>
#include <vector>

#include "tests/controller/supervisor_fixture.hpp"

namespace bevel::controller {
namespace {

using testing::HasSubstr;

// Processor time of this thread, which other work on the machine does not lengthen.
double processor_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

const std::vector<Eigen::Vector3d> kOutside{{0, 0, 300},    {0, 0, 1e3}, {0, 0, 1e5},  {3, -4, 1e9}, {0, 0, 1e300},
                                            {0, 0, 140.01}, {0, 0, -10}, {70, 0, 100}, {0, 1e6, 100}};

class ArrivalTest : public SupervisorTest {
 protected:
  void begin(double bending_mm = 0) {
    config.shaft = {bending_mm, 15};
    supervisor = Supervisor(config, agar());
    last = {};
    now += 1'000'000;
    supervisor.set_needle(view(now));
    supervisor.set_actuator(axes(now));
  }
  void expect_refused_within_a_period(double began_s, const std::string& what) {
    const double took_s = processor_s() - began_s;
    worst_s = std::max(worst_s, took_s);
    EXPECT_LT(took_s, config.period_s) << what;
    EXPECT_EQ(supervisor.status().state, State::stopped) << what;
    EXPECT_EQ(supervisor.status().reason, Reason::target_outside) << what;
    EXPECT_THAT(describe(supervisor.status()), HasSubstr("allowed")) << what;
    EXPECT_THAT(describe(supervisor.status()), HasSubstr("controller.safety.")) << what;
  }
  // The needle at the depth of its target, off by so much, known to within sd_mm.
  void come_to_rest_off_by(double off_mm, double sd_mm, double target_tolerance_mm = 0) {
    begin();
    supervisor.request(Request::arm, Target{{2, -8, 100}, target_tolerance_mm}, now);
    supervisor.request(Request::start, std::nullopt, now);
    ASSERT_EQ(supervisor.status().state, State::steering) << describe(supervisor.status());
    for (int i = 0; i < 40 && supervisor.status().state != State::stopped; ++i) {
      now += 20'000;
      NeedleView v = view(now);
      v.pose.p_mm = {2 + off_mm, -8, 100.001};
      v.position_variance_mm2 = sd_mm * sd_mm;
      supervisor.set_needle(v);
      model::ActuatorState a = axes(now, last);
      a.insertion_mm = 101;
      supervisor.set_actuator(a);
      last = supervisor.step(now, 0.02);
      if (i == 0) {
        EXPECT_EQ(supervisor.status().reason, Reason::coming_to_rest);
      }
    }
    EXPECT_EQ(supervisor.status().state, State::hold) << describe(supervisor.status());
    EXPECT_NEAR(supervisor.status().miss.distance_mm, off_mm, 0.01);
    EXPECT_NEAR(supervisor.status().miss.sd_mm, sd_mm, 1e-9);
  }
  // From 26 to 20 mm before the target's depth, the target off_mm aside of the line of the shaft.
  void step_20_mm_before(double off_mm, double last_z_mm = 80) {
    begin();
    supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
    supervisor.request(Request::start, std::nullopt, now);
    ASSERT_EQ(supervisor.status().state, State::steering) << describe(supervisor.status());
    for (double z_mm = 74; z_mm <= last_z_mm && supervisor.status().state == State::steering; ++z_mm) {
      now += 20'000;
      NeedleView v = view(now);
      v.pose.p_mm = {2 + off_mm, -8, z_mm};
      supervisor.set_needle(v);
      model::ActuatorState a = axes(now, last);
      a.insertion_mm = z_mm + 1;
      supervisor.set_actuator(a);
      last = supervisor.step(now, 0.02);
    }
  }
  double worst_s = 0;
};

TEST_F(ArrivalTest, ALoneTargetOutsideTheWorkspaceIsRefusedBeforeAnythingIsComputedFromIt) {
  for (const double bending_mm : {0.0, 40.0})
    for (const Eigen::Vector3d& target : kOutside) {
      begin(bending_mm);
      const double began_s = processor_s();
      supervisor.request(Request::arm, Target{target, 0}, now);
      expect_refused_within_a_period(began_s, "target at z = " + std::to_string(target.z()));
      supervisor.request(Request::start, std::nullopt, now);
      EXPECT_EQ(good_step().mode, 0);
    }
  begin();
  supervisor.request(Request::arm, Target{{0, 0, 300}, 0}, now);
  EXPECT_THAT(describe(supervisor.status()), HasSubstr("z is 300 mm; allowed -2 to 140 mm"));
  begin();
  supervisor.request(Request::arm, Target{{70, 0, 100}, 0}, now);
  EXPECT_THAT(describe(supervisor.status()), HasSubstr("distance from the z axis is 70 mm; allowed 0 to 60 mm"));
  std::cout << "worst time of a refusal " << 1e6 * worst_s << " us of processor time\n";
}

TEST_F(ArrivalTest, AWayPointOutsideIsRefusedWhenItIsCommandedAndByTheArmThatFollows) {
  for (const Eigen::Vector3d& point : kOutside) {
    begin();
    const double began_s = processor_s();
    supervisor.request(Request::way_point, Target{point, 1}, now);
    expect_refused_within_a_period(began_s, "way-point");
    supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
    expect_refused_within_a_period(began_s, "arm after it");
    supervisor.request(Request::stop, std::nullopt, now);
    supervisor.request(Request::arm, Target{{2, -8, 100}, 0}, now);
    EXPECT_EQ(supervisor.status().state, State::armed) << "a stop forgets it";
  }
}

TEST_F(ArrivalTest, AMovedTargetOutsideStopsTheNeedleWhenASecondPositionConfirmsIt) {
  for (const Eigen::Vector3d& position : kOutside) {
    begin();
    start();
    EXPECT_EQ(good_step().mode, 1);
    supervisor.request(Request::follow, Target{position, 0}, now);
    EXPECT_EQ(good_step().mode, 1) << "one position is a slip";
    supervisor.request(Request::follow, Target{{2, -8, 100}, 0}, now);
    supervisor.request(Request::follow, Target{position, 0}, now);
    EXPECT_EQ(good_step().mode, 1) << "not in a row";
    const double began_s = processor_s();
    supervisor.request(Request::follow, Target{position, 0}, now);
    expect_refused_within_a_period(began_s, "moved target");
  }
}

TEST_F(ArrivalTest, ARetractionDepthOutsideIsRefusedWithTheAllowedRange) {
  for (const double to_mm : {-1.0, 81.0, 1e5, 1e300}) {
    step_20_mm_before(0);
    const double began_s = processor_s();
    supervisor.request(Request::retract, Target{{0, 0, to_mm}, 0}, now);
    EXPECT_LT(processor_s() - began_s, config.period_s);
    if (to_mm == 81.0) continue;
    EXPECT_EQ(supervisor.status().reason, Reason::retraction_refused);
    EXPECT_THAT(describe(supervisor.status()), HasSubstr("allowed 0 to 81 mm"));
  }
}

TEST(PredictedMiss, CostsNoMoreForATargetFarAway) {
  double worst_s = 0;
  for (const double bending_mm : {0.0, 40.0})
    for (double z_mm = 10; z_mm < 1e12; z_mm *= 3)
      for (const double aside_mm : {0.0, 0.1, 1.0}) {
        const double began_s = processor_s();
        const ArcGeometry g = arc_geometry({}, agar(), {bending_mm, 15}, {aside_mm * z_mm, 0, z_mm});
        worst_s = std::max(worst_s, processor_s() - began_s);
        EXPECT_FALSE(g.in_domain && z_mm > 1000 && arc_miss_mm(g) == 0) << "beyond the steps there is no prediction";
      }
  std::cout << "worst time of a prediction " << 1e6 * worst_s << " us of processor time\n";
  EXPECT_LT(worst_s, 5e-3);
}

TEST_F(ArrivalTest, IsReportedWithItsUncertaintyAndOutsideTheToleranceItIsAMiss) {
  come_to_rest_off_by(0.3, 0.1);
  EXPECT_EQ(supervisor.status().reason, Reason::arrived);
  EXPECT_EQ(describe(supervisor.status()), "arrived: 0.30 +- 0.10 mm from the target; tolerance 1.00 mm");
  come_to_rest_off_by(1.7, 0.1);
  EXPECT_EQ(supervisor.status().reason, Reason::missed);
  EXPECT_EQ(describe(supervisor.status()), "missed the target: 1.70 +- 0.10 mm from the target; tolerance 1.00 mm");
  come_to_rest_off_by(0.3, 0.5);
  EXPECT_EQ(supervisor.status().reason, Reason::missed) << "an estimate that may be 1.3 mm off shows no arrival";
}

TEST_F(ArrivalTest, TheTargetsOwnToleranceComesBeforeTheConfiguredOne) {
  come_to_rest_off_by(0.3, 0.1, 0.4);
  EXPECT_EQ(supervisor.status().reason, Reason::missed);
  come_to_rest_off_by(1.7, 0.1, 2.0);
  EXPECT_EQ(supervisor.status().reason, Reason::arrived);
}

TEST_F(ArrivalTest, ATargetThatLeavesTheReachableSetIsReportedOrStopsTheNeedle) {
  step_20_mm_before(0.5);  // 20 mm on, the needle bends by 0.9 mm
  EXPECT_FALSE(supervisor.status().target_lost);
  EXPECT_EQ(describe(supervisor.status()), "");
  step_20_mm_before(4);
  EXPECT_EQ(supervisor.status().state, State::steering);
  EXPECT_TRUE(supervisor.status().target_lost);
  EXPECT_THAT(describe(supervisor.status()), HasSubstr("left the reachable set: predicted "));
  step_20_mm_before(8, 78);
  EXPECT_EQ(supervisor.status().state, State::steering) << "not for 5 mm yet";
  step_20_mm_before(8);
  EXPECT_EQ(supervisor.status().state, State::stopped) << "above target_miss_max_mm";
  EXPECT_EQ(supervisor.status().reason, Reason::target_unreachable);
  config.safety.target_lost = TargetLost::stop;
  step_20_mm_before(0.5);
  EXPECT_EQ(supervisor.status().state, State::steering);
  step_20_mm_before(4);
  EXPECT_EQ(supervisor.status().state, State::stopped);
  EXPECT_EQ(supervisor.status().reason, Reason::target_unreachable);
  EXPECT_THAT(describe(supervisor.status()), HasSubstr("allowed 0 to 1 mm"));
}

TEST_F(ArrivalTest, EveryHoldHasAReason) {
  start();
  good_step();
  supervisor.request(Request::hold, std::nullopt, now);
  EXPECT_EQ(describe(supervisor.status()), "held by the operator");
  supervisor.request(Request::start, std::nullopt, now);
  EXPECT_EQ(describe(supervisor.status()), "") << "it goes on";
  EXPECT_EQ(supervisor.status().state, State::steering);
}

// Half way, from poses that the law has brought about, to targets within reach and beyond: what is predicted there is
// what the law comes to on a needle that is the model.
TEST(PredictedMiss, IsWhatTheLawComesTo) {
  constexpr unsigned kSeed = 60;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const Law law : {Law::arcs, Law::flip}) {
    ControllerConfig config;
    config.law = law;
    std::vector<double> off_mm;
    int beyond = 0;
    for (int i = 0; i < 200; ++i) {
      const double turn_rad = 2 * std::numbers::pi * uniform(random), side_rad = 2 * std::numbers::pi * uniform(random);
      model::Pose tip;
      tip.R = model::exp_so3({0, 0, turn_rad});
      model::advance(tip, {40, 0, {agar().curvature_per_mm, 0}}, model::slip_parameters(agar()));
      const double ahead_mm = 30 + 30 * uniform(random), reach_mm = 0.5 * agar().curvature_per_mm * ahead_mm * ahead_mm;
      const double aside_mm = 1.6 * reach_mm * uniform(random);
      const Eigen::Vector3d target =
          tip.p_mm + tip.R * Eigen::Vector3d(aside_mm * std::cos(side_rad), aside_mm * std::sin(side_rad), ahead_mm);
      const double predicted_mm = arc_miss_mm(arc_geometry(tip, agar(), {}, target), law == Law::flip);
      if (predicted_mm > 0.5) ++beyond;
      ArcLaw arcs;
      Rates rates;
      double rotation_rad = 0, inserted_mm = 40;
      for (int step = 0; step < 5000; ++step) {
        const ArcGeometry g = arc_geometry(tip, agar(), {}, target);
        if (g.ahead_mm <= 0) break;
        rates = ramp(rates, arcs.step(g, rotation_rad, inserted_mm, config.gains.tolerance_mm, config), config.period_s,
                     config.limits);
        const double mm = rates.insertion_mm_s * config.period_s, rad = rates.rotation_rad_s * config.period_s;
        model::advance(tip, {mm, rad, {agar().curvature_per_mm, 0}}, model::slip_parameters(agar()));
        rotation_rad += rad, inserted_mm += mm;
      }
      off_mm.push_back(std::abs((tip.p_mm - target).norm() - predicted_mm));
    }
    std::ranges::sort(off_mm);
    std::cout << "seed " << kSeed << (law == Law::arcs ? ", arcs" : ", flip") << ": " << beyond
              << " of 200 beyond reach; miss against prediction: median " << off_mm[100] << " mm, 95 % " << off_mm[190]
              << " mm, worst " << off_mm.back() << " mm\n";
    EXPECT_GT(beyond, 40);
    EXPECT_LT(off_mm[100], 0.15);
    EXPECT_LT(off_mm[190], 0.6);
  }
}

}  // namespace
}  // namespace bevel::controller
