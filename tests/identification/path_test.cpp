// SPDX-License-Identifier: MIT
// The path and its Jacobian, and the making of insertions from axis and camera samples.
#include <bevel/diagnosis/identification/path.hpp>

#include <gtest/gtest.h>

#include <iostream>
#include <numbers>

#include <bevel/error.hpp>
#include "tests/identification/simulated_insertion.hpp"

namespace bevel::diagnosis {
namespace {

model::NeedleParameters agar() {
  model::NeedleParameters needle;
  needle.lambda1_per_rad = 0.49;
  needle.lambda2 = 0.22;
  return needle;
}

TEST(Path, LegsAndInterpolationAgreeWithFineSteps) {
  std::mt19937_64 random(1);
  for (const double turn : {0.0, 9.0}) {
    SimulatedInsertion plan;
    plan.spatial = true;
    plan.sigma_mm = 1e-9;
    plan.rotation_rad = turn;
    const Insertion insertion = simulate_insertion(agar(), plan, random);
    EXPECT_LT(insertion.legs.size(), insertion.observations.size());
    Path path;
    ASSERT_TRUE(integrate(insertion, agar(), Entry::Zero(), false, path));
    double largest = 0;
    for (std::size_t i = 0; i < path.position_mm.size(); ++i)
      largest = std::max(largest, (path.position_mm[i] - insertion.observations[i].position_mm).norm());
    // Times are whole microseconds: 1e-5 mm at 20 mm/s. While turning, a leg follows the axes to 1e-3 rad.
    std::cout << "largest difference " << largest << " mm, turn " << turn << " rad\n";
    EXPECT_LT(largest, turn == 0 ? 2e-5 : 2e-3) << "turn " << turn;
  }
}

TEST(Path, JacobianAgreesWithPerturbation) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 12; ++trial) {
    model::NeedleParameters needle = agar();
    needle.curvature_per_mm *= 1 + 0.2 * uniform(random);
    needle.slip = trial % 2 == 0 ? model::SlipDirection::isotropic : model::SlipDirection::bevel_plane;
    needle.front_wheel = trial % 4 < 2 ? model::FrontWheel::published : model::FrontWheel::nonslip;
    SimulatedInsertion plan;
    plan.spatial = true;
    plan.rotation_rad = 3 * uniform(random);
    const Insertion insertion = simulate_insertion(needle, plan, random);
    Entry entry;
    entry << 0.05 * uniform(random), 0.05 * uniform(random), uniform(random), uniform(random), uniform(random), 0.5;
    Path path;
    ASSERT_TRUE(integrate(insertion, needle, entry, true, path));
    for (int column = 0; column < kPathColumns; ++column) {
      const double h = column == kNeedleCurvature ? 1e-7 : 1e-5;
      const auto moved = [&](double by) {
        auto n = needle;
        Entry e = entry;
        if (column == kNeedleCurvature) n.curvature_per_mm += by;
        if (column == kNeedleLambda1) n.lambda1_per_rad += by;
        if (column == kNeedleLambda2) n.lambda2 += by;
        if (column == kNeedleWheelbase) n.wheelbase_mm += by;
        if (column >= kNeedleParameters) e(column - kNeedleParameters) += by;
        Path p;
        EXPECT_TRUE(integrate(insertion, n, e, false, p));
        return p;
      };
      const Path plus = moved(h);
      const Path minus = moved(-h);
      double error = 0;
      double size = 1e-12;
      for (std::size_t i = 0; i < path.position_mm.size(); ++i) {
        const Eigen::Vector3d numeric = (plus.position_mm[i] - minus.position_mm[i]) / (2 * h);
        error = std::max(error, (path.jacobian[i].col(column) - numeric).norm());
        size = std::max(size, numeric.norm());
      }
      EXPECT_LT(error, 0.01 * size) << "column " << column;
    }
  }
}

TEST(Insertion, MeasurementsThatCannotBeUsedAreCounted) {
  std::mt19937_64 random(3);
  SimulatedRecording r = simulate(agar(), {}, random);
  r.tips[3].status = 2;
  r.tips[5].information_per_mm2.setZero();
  r.tips.back().utime += 10'000'000;
  const Insertion insertion = make_insertion("r", r.actuators, r.tips);
  EXPECT_EQ(insertion.skipped, 3U);
  EXPECT_EQ(insertion.observations.size(), r.tips.size() - 3);
  EXPECT_EQ(insertion.observations[0].rank, 2);  // the camera sees y and z
  for (auto& tip : r.tips) tip.status = 1;
  EXPECT_THROW(make_insertion("r", r.actuators, r.tips), bevel::ArgumentError);
  EXPECT_THROW(make_insertion("r", {r.actuators[0]}, r.tips), bevel::ArgumentError);
}

// An axis that turned for days before the recording: only the rest of a turn is a motion of the needle.
TEST(Insertion, WholeTurnsBeforeTheFirstSampleChangeNothing) {
  std::mt19937_64 random(5);
  SimulatedRecording r = simulate(agar(), {}, random);
  for (auto& a : r.actuators) a.rotation_rad += 0.4;
  const Insertion still = make_insertion("r", r.actuators, r.tips);
  for (auto& a : r.actuators) a.rotation_rad += 2 * std::numbers::pi * 16'000;
  const Insertion turned = make_insertion("r", r.actuators, r.tips);
  ASSERT_EQ(turned.legs.size(), still.legs.size());
  Path path_still, path_turned;
  ASSERT_TRUE(integrate(still, agar(), Entry::Zero(), false, path_still));
  ASSERT_TRUE(integrate(turned, agar(), Entry::Zero(), false, path_turned));
  for (std::size_t i = 0; i < path_still.position_mm.size(); ++i)
    EXPECT_LT((path_turned.position_mm[i] - path_still.position_mm[i]).norm(), 1e-6);
}

TEST(Insertion, RetractionAndRestsKeepTheirPlace) {
  // In to 20 mm, rest, back to 10 mm: the measurement at 15 mm on the way back is in a leg that retracts.
  std::vector<model::ActuatorState> actuators;
  const std::array<double, 5> at_mm{0, 20, 20, 20, 10};
  for (std::size_t i = 0; i < at_mm.size(); ++i) {
    model::ActuatorState a;
    a.utime = static_cast<std::int64_t>(i + 1) * 1'000'000;
    a.insertion_mm = at_mm[i];
    actuators.push_back(a);
  }
  std::vector<model::TipMeasurement> tips(3);
  tips[0].utime = 1'500'000;
  tips[1].utime = 3'300'000;
  tips[2].utime = 4'500'000;
  for (auto& tip : tips) tip.information_per_mm2.setIdentity();
  const Insertion insertion = make_insertion("r", actuators, tips);
  ASSERT_EQ(insertion.observations.size(), 3U);
  EXPECT_DOUBLE_EQ(insertion.observations[0].insertion_mm, 10);
  EXPECT_DOUBLE_EQ(insertion.observations[1].insertion_mm, 20);
  EXPECT_DOUBLE_EQ(insertion.observations[2].insertion_mm, 15);
  Path path;
  ASSERT_TRUE(integrate(insertion, model::NeedleParameters{}, Entry::Zero(), false, path));
  const double r = 1 / model::NeedleParameters{}.curvature_per_mm;  // the bicycle's circle
  for (std::size_t i = 0; i < 3; ++i) {
    const double s = insertion.observations[i].insertion_mm;
    EXPECT_NEAR(path.position_mm[i].y(), -r * (1 - std::cos(s / r)), 1e-7);
    EXPECT_NEAR(path.position_mm[i].z(), r * std::sin(s / r), 1e-7);
  }
}

}  // namespace
}  // namespace bevel::diagnosis
