// SPDX-License-Identifier: MIT
// By how much one part of a model moves the tip, against closed forms.
#include <bevel/diagnosis/mismatch/moved_tip.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

struct MovedTip : ::testing::Test {
  // Without slip, which knows the direction of the entry: the path turns as a whole.
  NeedleSystem system{record_case({.needle = model::testing::bicycle(), .recordings = 3}, 5),
                      model::testing::bicycle()};

  std::size_t effect(const std::string& name, std::size_t parameters) const {
    for (std::size_t e = 0; e < system.effects().size(); ++e)
      if (system.effects()[e].name == name && system.effects()[e].parameters.size() == parameters) return e;
    throw std::invalid_argument(name);
  }
  std::vector<Eigen::VectorXd> nothing_of_their_own(const inference::Layout& layout) const {
    return std::vector(system.recorded().recordings.size(), layout.local_start());
  }
  // Of the named effect by these values, beside wind-up: what is taken away is taken from something.
  double moved_mm(const std::string& name, const std::vector<double>& values) const {
    const std::size_t e = effect(name, values.size()), windup = effect("torsional_windup", 1);
    const inference::Layout layout(system, inference::with({windup}, e));
    const std::size_t member = layout.set()[0] == e ? 0 : 1;
    Eigen::VectorXd shared = layout.shared_start();
    shared[layout.find_shared(1 - member, 0)] = 0.6;
    for (std::size_t p = 0; p < values.size(); ++p) shared[layout.find_shared(member, p)] = values[p];
    const auto local = nothing_of_their_own(layout);
    return moved_by_member_mm(system, {.layout = &layout, .shared = &shared, .local = &local}, member);
  }
  // Root mean square over the recordings of f(tip), at the deepest reading, with wind-up alone.
  template <class F>
  double rms_at_depth(F f) const {
    double sum = 0;
    for (const Recording& recording : system.recorded().recordings) {
      const auto path_mm =
          model::testing::path_of(system.model(), {active("torsional_windup", {0.6})}, recording.motion);
      std::size_t deepest = 0;
      for (std::size_t i = 0; i < path_mm.size(); ++i)
        if (recording.motion.nodes[recording.motion.at[i]].insertion_mm >
            recording.motion.nodes[recording.motion.at[deepest]].insertion_mm)
          deepest = i;
      sum += std::pow(f(path_mm[deepest]), 2);
    }
    return std::sqrt(sum / static_cast<double>(system.recorded().recordings.size()));
  }
};

TEST_F(MovedTip, AnEntryPointMovesItByAsMuch) {
  EXPECT_NEAR(moved_mm("entry_point", {0.3, -0.4}), 0.5, 1e-9);
  EXPECT_NEAR(moved_mm("entry_point", {0, 0}), 0, 1e-12);
}

TEST_F(MovedTip, AScaleByItsShareOfHeightAndDepth) {
  const double expected_mm =
      rms_at_depth([](const Eigen::Vector3d& tip_mm) { return 0.02 * std::hypot(tip_mm.y(), tip_mm.z()); });
  EXPECT_GT(expected_mm, 1);
  EXPECT_NEAR(moved_mm("camera_scale", {1.02}), expected_mm, 1e-6);
}

TEST_F(MovedTip, AnEntryAngleByTheChordOfItsTurn) {
  const double angle_rad = 0.03;
  const double expected_mm = rms_at_depth([&](const Eigen::Vector3d& tip_mm) {
    return 2 * std::sin(angle_rad / 2) * std::hypot(tip_mm.y(), tip_mm.z());  // about x
  });
  EXPECT_NEAR(moved_mm("entry_angle", {angle_rad, 0}), expected_mm, 1e-6);
}

TEST_F(MovedTip, AConstantDiscrepancyOfAReadingByAsMuch) {
  std::size_t curve = 0;
  while (system.curves()[curve].component != info_of(model::DiscrepancyComponent::y).meaning) ++curve;
  const inference::Layout layout(system, {effect("torsional_windup", 1)});
  Eigen::VectorXd shared = layout.shared_start();
  shared[layout.find_shared(0, 0)] = 0.6;
  const auto local = nothing_of_their_own(layout);
  const auto constant = [&](double value) {
    return inference::CurveValues{
        curve, Eigen::VectorXd::Constant(static_cast<Eigen::Index>(system.curves()[curve].at.size()), value)};
  };
  const std::vector<inference::CurveValues> one = {constant(-0.7)}, two = {constant(-0.7), constant(0.3)};
  const ModelledTip without{&layout, &shared, &local, {}};
  EXPECT_NEAR(apart_at_depth_mm(system, {&layout, &shared, &local, one}, without), 0.7, 1e-9);
  EXPECT_NEAR(apart_at_depth_mm(system, {&layout, &shared, &local, two}, without), 0.4, 1e-9);  // they add up
}

TEST_F(MovedTip, WhereATipCannotGoThereIsNoFigure) {
  const inference::Layout layout(system, {});
  const Eigen::VectorXd shared = layout.shared_start();
  Eigen::VectorXd impossible = shared;
  impossible[kLambda2] = 40;
  const auto local = nothing_of_their_own(layout);
  EXPECT_TRUE(std::isnan(apart_at_depth_mm(system, {&layout, &shared, &local}, {&layout, &impossible, &local})));
}

}  // namespace
}  // namespace bevel::diagnosis::testing
