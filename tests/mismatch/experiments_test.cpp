// What to record next: motions within limits, and how far two explanations differ in them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "diagnosis/mismatch/experiments.hpp"
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

TEST(MotionScripts, KeepToTheDepthAndTheRatesStated) {
  for (const double depth_mm : {40.0, 70.0, 123.0}) {
    const double frame_s = 1.0 / 30;
    const auto scripts = motion_scripts(depth_mm, frame_s);
    EXPECT_GE(scripts.size(), 10U);
    EXPECT_LE(scripts.size(), 30U);
    std::set<std::string> texts;
    for (const auto& script : scripts) {
      texts.insert(script.text);
      const auto& nodes = script.motion.nodes;
      double deepest_mm = 0;
      for (std::size_t i = 1; i < nodes.size(); ++i) {
        const double dt_s = nodes[i].time_s - nodes[i - 1].time_s;
        ASSERT_GT(dt_s, 0) << script.text;
        ASSERT_LE(std::abs(nodes[i].insertion_mm - nodes[i - 1].insertion_mm) / dt_s, 10 * 1.001) << script.text;
        ASSERT_LE(std::abs(nodes[i].rotation_rad - nodes[i - 1].rotation_rad) / dt_s, 2 * std::numbers::pi * 1.001)
            << script.text;
        ASSERT_GE(nodes[i].insertion_mm, -1e-9) << script.text;
        deepest_mm = std::max(deepest_mm, nodes[i].insertion_mm);
      }
      EXPECT_LE(deepest_mm, depth_mm + 1e-6) << script.text;
      EXPECT_GT(deepest_mm, 0.8 * depth_mm) << script.text;
      const auto& at = script.motion.at;
      ASSERT_GT(at.size(), 30U) << script.text;
      for (std::size_t i = 1; i < at.size(); ++i)
        ASSERT_NEAR(nodes[at[i]].time_s - nodes[at[i - 1]].time_s, frame_s, 1e-5) << script.text;
    }
    EXPECT_EQ(texts.size(), scripts.size()) << "two scripts of one text";
  }
}

TEST(Separation, OfTwoThatSayTheSameIsNone) {
  const SimulatedRig rig{.effects = {active("drilling", {2.0})}};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  const Fit drilling = fit_of(evidence, {member("drilling")});
  for (const auto& script : motion_scripts(60, 0.1))
    EXPECT_NEAR(separation(evidence, script, drilling, drilling), 0, 1e-9) << script.text;
}

TEST(Separation, IsByHowMuchTheRivalRefittedIsWorse) {
  // Recordings without noise, the true effect small. The rival, without it, is fitted to them, and again to them and a
  // recording of the script: by so much its chi2 rises.
  SimulatedRig rig{.effects = {active("drilling", {0.3})}, .recordings = 2, .frame_s = 0.1};
  const Eigen::Vector3d sigma_mm = rig.sigma_mm;
  rig.sigma_mm *= 1e-9;
  auto raw = record(rig, 1);
  rig.sigma_mm = sigma_mm;
  auto recorded = make_case(raw);
  const Evidence evidence = evidence_of(recorded, rig);
  const Hypothesis with(rig.needle, {member("drilling")}, recorded);
  Fit truth(with);
  truth.values = with.start();
  truth.values[3] = 0.3;
  const Hypothesis without(rig.needle, {}, recorded);
  const Fit rival = fit(evidence, without, without.start(), {.tolerance = 1e-9, .held = {}});
  int compared = 0;
  for (const auto& script : motion_scripts(60, 0.1)) {
    const double expected = separation(evidence, script, truth, rival);
    RecordedCase longer = recorded;
    Recording more;
    more.motion = script.motion;
    model::OpenLoop path;
    ASSERT_TRUE(model::predict(with.make_needle(0, truth.values, false), script.motion, path));
    for (const auto& channel : recorded.channels) {
      Series series;
      for (std::size_t i = 0; i < path.position_mm.size(); ++i) {
        series.reading.push_back(i);
        series.time_s.push_back(script.motion.nodes[script.motion.at[i]].time_s);
        series.measured_mm.push_back(channel.axis.dot(path.position_mm[i]));
        series.relative_sd.push_back(1);
      }
      more.series.push_back(series);
    }
    longer.recordings.push_back(more);
    const Evidence longer_evidence = evidence_of(longer, rig);
    const Hypothesis again(rig.needle, {}, longer);
    const Fit refitted = fit(longer_evidence, again, rival.values, {.tolerance = 1e-9, .held = {}});
    const double rise = refitted.penalised - rival.penalised;
    EXPECT_NEAR(expected, rise, 0.1 * rise + 0.2) << script.text;
    if (rise > 2) ++compared;
  }
  EXPECT_GT(compared, 0);
}

TEST(BestExperiment, ForDrillingTurnsWhileInserting) {
  const SimulatedRig rig{.effects = {active("drilling", {2.0})}};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  const NextExperiment best =
      best_experiment(evidence, fit_of(evidence, {member("drilling")}), fit_of(evidence, {}), 60);
  EXPECT_THAT(best.script, ::testing::HasSubstr("spin"));
  EXPECT_EQ(best.separates[0], "drilling");
  EXPECT_EQ(best.separates[1], "nothing");
  EXPECT_GT(best.expected_gain, 25);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
