// SPDX-License-Identifier: MIT
// What changed between two groups of recordings of a rig, and what headings add.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bevel/diagnosis/mismatch/diagnose.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::uint64_t kSeed = 11;

// Eight recordings, of which the last four are of the second group, made by the changed rig; `common` acts in all of
// them and is in nobody's model.
Findings what_changed(SimulatedRig before, const SimulatedRig& after) {
  before.recordings = 8;
  before.changed_from = 4;
  SimulatedRig second = after;
  second.recordings = 8;
  second.changed_from = 4;
  auto raw = record(before, kSeed), changed = record(second, kSeed + 1);
  for (std::size_t r = 4; r < raw.size(); ++r) raw[r] = std::move(changed[r]);
  return diagnose(make_case(std::move(raw)), model::testing::agar(), {});
}

const std::vector<model::ActiveEffect> kCommon{active("entry_angle", {0.02, -0.03}), active("camera_scale", {1.03})};

TEST(TwoGroups, WhatBothHaveAlikeIsNoChange) {
  const SimulatedRig rig{.effects = kCommon};
  const Findings found = what_changed(rig, rig);
  EXPECT_TRUE(found.two_groups);
  EXPECT_EQ(name_of(found.verdict, found.two_groups), "unchanged") << found.sentence;
  EXPECT_THAT(found.effects, IsEmpty());
  EXPECT_THAT(found.sentence, HasSubstr("Nothing changed"));
  EXPECT_FALSE(found.detectable.empty());
  EXPECT_EQ(found.held_out.recordings.size(), 4U) << "those of the second group";
}

TEST(TwoGroups, AnEffectThatCameIsNamedBesideWhatWasThere) {
  SimulatedRig after{.effects = kCommon};
  after.effects.push_back(active("torsional_windup", {0.6}));
  const Findings found = what_changed({.effects = kCommon}, after);
  EXPECT_EQ(name_of(found.verdict, found.two_groups), "changed") << found.sentence;
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].name, "torsional_windup");
  EXPECT_NEAR(found.effects[0].parameters[0].value, 0.6, 4 * found.effects[0].parameters[0].std_error);
  for (const Location& where : found.where)
    EXPECT_THAT(where.log, ::testing::AnyOf("rec5", "rec6", "rec7", "rec8")) << "of the second group";
  EXPECT_GT(found.held_out.gain, 3);  // odds of 20; by how much more hangs on which sets the others select
}

TEST(TwoGroups, ANeedleThatBendsMoreIsNamedByItsParameter) {
  SimulatedRig after{.effects = kCommon};
  after.needle.curvature_per_mm *= 1.25;
  const Findings found = what_changed({.effects = kCommon}, after);
  EXPECT_EQ(name_of(found.verdict, found.two_groups), "changed") << found.sentence;
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].name, "curvature_per_mm");
  EXPECT_EQ(found.effects[0].parameters[0].name, "change_relative");
  EXPECT_NEAR(found.effects[0].parameters[0].value, 0.25, 4 * found.effects[0].parameters[0].std_error);
}

// Registration: a shift of the second group alone looks like insertions that differ more, until it has a name.
TEST(TwoGroups, AShiftIsNotTakenForInsertionsThatDiffer) {
  SimulatedRig after{.effects = kCommon};
  after.effects.push_back(active("entry_point", {1.2, -0.6}));
  const Findings found = what_changed({.effects = kCommon}, after);
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].name, "entry_point");
}

// Lambda keeps the value of the model file, and a remark states it.
TEST(Beliefs, WithoutRotationLambdaIsReportedAsNotDetermined) {
  auto raw = record({.recordings = 4}, kSeed);
  for (auto& one : raw) {
    model::testing::Script straight{{8, 2.5, 0}};
    one.actuators = straight.actuators(0.02);
    std::vector<std::int64_t> utimes;
    for (auto& tip : one.tips) utimes.push_back(tip.utime);
    const auto path = model::testing::path_of(model::testing::agar(), {}, model::make_motion(one.actuators, utimes));
    for (std::size_t i = 0; i < path.size(); ++i) {
      const double noise_mm = 0.3 * std::sin(37.0 * static_cast<double>(i) + static_cast<double>(&one - raw.data()));
      one.tips[i].position_mm = path[i] + Eigen::Vector3d::Constant(noise_mm);
    }
  }
  const Findings found = diagnose(make_case(std::move(raw)), model::testing::agar(), {});
  EXPECT_THAT(found.remarks,
              ::testing::Contains(::testing::AllOf(HasSubstr("not determined"), HasSubstr("lambda1_per_rad"))));
  EXPECT_FALSE(found.needle.slip_determined);
  EXPECT_NEAR(found.needle.value.lambda2, model::testing::agar().lambda2, 1e-3);
}

// A sensor askew leaves the path alone: only its headings show it.
TEST(Headings, ASensorAskewIsNamed) {
  const SimulatedRig rig{.effects = {active("sensor_tilt", {0.02, -0.03})}, .heading_sd_rad = 0.004};
  const Findings found = diagnose(record_case(rig, kSeed), rig.needle, {});
  EXPECT_EQ(found.verdict, Verdict::effects_found) << found.sentence;
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].name, "sensor_tilt");
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_NEAR(found.effects[0].parameters[i].value, i == 0 ? 0.02 : -0.03,
                4 * found.effects[0].parameters[i].std_error);
  EXPECT_EQ(found.units.back(), "rad");
  // Errors are of positions: a heading's hundredth of a radian is no hundredth of a millimetre.
  EXPECT_NEAR(found.held_out.after.rmse_mm, 0.17, 0.03);
}

// A needle that cuts at an angle looks like one that entered at one, but for its heading and for turning.
TEST(Headings, ACuttingAngleIsNamed) {
  const SimulatedRig rig{.effects = {active("cutting_angle", {0.04})}, .heading_sd_rad = 0.004};
  const Findings found = diagnose(record_case(rig, kSeed), rig.needle, {});
  EXPECT_EQ(found.verdict, Verdict::effects_found) << found.sentence;
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].name, "cutting_angle");
  EXPECT_NEAR(found.effects[0].parameters[0].value, 0.04, 4 * found.effects[0].parameters[0].std_error);
}

// By hand, from stop to stop: effects of time are not looked for, and the verdict says so.
TEST(Stops, WhatNeedsAClockIsSaidToBeLeftOut) {
  auto raw = record({.effects = {active("layer", {30, 2})}, .recordings = 6, .frame_s = 0.06},
                    kSeed);  // where there are states
  for (auto& one : raw) {
    one.has_clock = false;
    std::vector<model::TipMeasurement> tips;
    std::vector<model::ActuatorState> states;
    for (const auto& tip : one.tips) {
      const auto state = std::ranges::find_if(one.actuators, [&](const auto& a) { return a.utime >= tip.utime; });
      if (state == one.actuators.end()) continue;
      tips.push_back(tip);
      states.push_back(*state);
      states.back().utime = tip.utime;
    }
    one.tips = tips;
    one.actuators = states;
  }
  const Findings found = diagnose(make_case(std::move(raw)), model::testing::agar(), {});
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].name, "layer");
  EXPECT_THAT(found.remarks, ::testing::Contains(::testing::AllOf(HasSubstr("no clock"), HasSubstr("tissue_motion"))));
  for (const TriedEffect& one : found.tried) EXPECT_NE(one.name, "tissue_motion");
}

}  // namespace
}  // namespace bevel::diagnosis::testing
