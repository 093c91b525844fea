// SPDX-License-Identifier: MIT
// What to record next: motions within limits, and how far two explanations differ in them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include <bevel/diagnosis/mismatch/experiments.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

TEST(MotionScripts, AreMotionsHoweverShallow) {
  for (const double depth_mm : {3.0, 8.0, 10.0})
    for (const auto& script : motion_scripts(depth_mm, 1.0 / 30)) EXPECT_GT(script.motion.at.size(), 1U) << script.text;
}

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

// A system with fits of it by the noise of its rig, insertions alike.
struct Known {
  NeedleSystem system;
  std::shared_ptr<const inference::Likelihood> likelihood;

  Known(RecordedCase recorded, const SimulatedRig& rig) : system(std::move(recorded), rig.needle) {
    inference::Noise noise;
    noise.sigma = {rig.sigma_mm[0], rig.sigma_mm[1], rig.sigma_mm[2]};
    noise.frame_s = rig.frame_s;
    likelihood = std::make_shared<const inference::Likelihood>(
        system, inference::Readings(system.data().recordings.size()), noise);
  }
  std::size_t effect(std::string_view label) const {
    for (std::size_t e = 0; e < system.effects().size(); ++e)
      if (system.effects()[e].label == label) return e;
    throw std::invalid_argument(std::string(label));
  }
  inference::Fit fit(const inference::ModelSet& set) const {
    const inference::Layout layout(system, set);
    Eigen::VectorXd shared = layout.shared_start();
    for (std::size_t i = kBaseParameters; i < layout.shared().size(); ++i)
      shared[static_cast<Eigen::Index>(i)] = layout.shared()[i].parameter->starts.front();
    const std::vector<Eigen::VectorXd> local(system.data().recordings.size(), layout.local_start());
    const auto groups = static_cast<Eigen::Index>(system.nuisance_groups().size());
    auto out = inference::fit(*likelihood, layout, shared, local,
                              {.nuisance_sd = Eigen::VectorXd::Zero(groups), .curves = {}}, {}, {.tolerance = 1e-9});
    out.likelihood = likelihood;
    return out;
  }
  Imagined imagine(const inference::Fit& fit) const {
    const ChosenModel model{.fit = &fit, .curve = {}, .blocks = linearise(*likelihood, fit, {})};
    return imagined(fit, model);
  }
};

TEST(Separation, OfTwoThatSayTheSameIsNone) {
  const SimulatedRig rig{.effects = {active("drilling", {2.0})}};
  const Known known(record_case(rig, 1), rig);
  const auto fit = known.fit({known.effect("drilling")});
  const Imagined drilling = known.imagine(fit);
  const Experiments experiments(known.system, known.likelihood->noise());
  for (std::size_t s = 0; s < experiments.scripts().size(); ++s)
    EXPECT_NEAR(experiments.separation(s, drilling, drilling), 0, 1e-9) << experiments.scripts()[s].text;
}

TEST(Separation, IsByHowMuchTheRivalRefittedIsWorse) {
  // Recordings without noise, the true effect small. The rival, without it, is fitted to them, and again to them and a
  // recording of the script: by so much its cost rises.
  SimulatedRig rig{.effects = {active("drilling", {0.3})}, .recordings = 2, .frame_s = 0.1};
  const Eigen::Vector3d sigma_mm = rig.sigma_mm;
  rig.sigma_mm *= 1e-9;
  auto raw = record(rig, 1);
  rig.sigma_mm = sigma_mm;
  const RecordedCase recorded = make_case(raw);
  const Known known(recorded, rig);
  const std::size_t effect = known.effect("drilling");
  inference::Fit truth = known.fit({effect});
  const inference::Layout nothing(known.system, {});
  truth.shared.head<kBaseParameters>() = nothing.shared_start();
  truth.shared[kBaseParameters] = 0.3;
  const auto rival = known.fit({});
  const Imagined true_one = known.imagine(truth), rival_one = known.imagine(rival);
  const Experiments experiments(known.system, known.likelihood->noise());
  int compared = 0;
  for (std::size_t s = 0; s < experiments.scripts().size(); ++s) {
    const auto& script = experiments.scripts()[s];
    const double expected = experiments.separation(s, true_one, rival_one);
    RecordedCase longer = recorded;
    Recording more;
    more.motion = script.motion;
    model::OpenLoop path;
    ASSERT_TRUE(known.system.tip_path(truth.layout.set(), script.motion, -1, truth.shared, true_one.local, {}, path));
    for (const auto& channel : recorded.channels) {
      Series series;
      for (std::size_t i = 0; i < path.position_mm.size(); ++i) {
        series.message.push_back(i);
        series.time_s.push_back(script.motion.nodes[script.motion.at[i]].time_s);
        series.measured.push_back(channel.axis.dot(path.position_mm[i]));
        series.relative_sd.push_back(1);
      }
      more.series.push_back(series);
    }
    longer.recordings.push_back(more);
    const double rise = Known(longer, rig).fit({}).cost - rival.cost;
    EXPECT_NEAR(expected, rise, 0.1 * rise + 0.2) << script.text;
    if (rise > 2) ++compared;
  }
  EXPECT_GT(compared, 0);
}

TEST(BestExperiment, ForDrillingTurnsWhileInserting) {
  const SimulatedRig rig{.effects = {active("drilling", {2.0})}};
  const Known known(record_case(rig, 1), rig);
  const auto with = known.fit({known.effect("drilling")}), without = known.fit({});
  const Experiments experiments(known.system, known.likelihood->noise());
  const NextExperiment best = experiments.best(known.imagine(with), known.imagine(without));
  EXPECT_THAT(best.script, ::testing::HasSubstr("spin"));
  EXPECT_EQ(best.separates[0], "drilling");
  EXPECT_EQ(best.separates[1], "nothing");
  EXPECT_GT(best.expected_gain, 25);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
