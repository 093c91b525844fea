// The needle behind the engine's interface, against differences and against the model itself.
#include <bevel/diagnosis/needle/needle_system.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include <bevel/diagnosis/inference/search.hpp>
#include <bevel/diagnosis/needle/curves.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::active;
using testing::record_case;
using testing::SimulatedRig;

std::size_t effect_named(const NeedleSystem& system, std::string_view label) {
  for (std::size_t e = 0; e < system.effects().size(); ++e)
    if (system.effects()[e].label == label) return e;
  throw std::invalid_argument(std::string(label));
}

struct Setting {
  inference::ModelSet set;
  VectorXd shared, local;
};

// A set away from every "none", with a recording that differs from the rest.
Setting setting_of(const NeedleSystem& system, const std::vector<std::string>& labels) {
  Setting out;
  for (const auto& label : labels) out.set = inference::with(out.set, effect_named(system, label));
  const inference::Layout layout(system, out.set);
  out.shared = layout.shared_start();
  for (auto i = static_cast<Index>(system.base().size()); i < out.shared.size(); ++i) {
    const auto& p = *layout.shared()[static_cast<std::size_t>(i)].parameter;
    out.shared[i] = p.starts[p.starts.size() / 2];
  }
  out.local = layout.local_start();
  out.local.head<kVariations>() << 0.04, 0.01, -0.008, 0.05, 0.2, -0.1;
  const auto nuisances = static_cast<Index>(system.nuisances().size());
  if (nuisances == kVariationsByHand) out.local.segment<3>(kEntryZ) << 0.3, 1e-4, -2e-4;
  for (Index i = nuisances; i < out.local.size(); ++i) out.local[i] = 2.03;
  return out;
}

class Derivatives : public ::testing::TestWithParam<std::vector<std::string>> {};

RecordedCase without_clock(const SimulatedRig& rig, std::uint64_t seed) {
  auto raw = record(rig, seed);
  for (auto& recording : raw) recording.has_clock = false;
  return make_case(std::move(raw));
}

void expect_derivatives(const SimulatedRig& rig, const std::vector<std::string>& labels, bool has_clock = true) {
  const NeedleSystem system(has_clock ? record_case(rig, 1) : without_clock(rig, 1), rig.needle);
  const Setting at = setting_of(system, labels);
  inference::Prediction here, up, down;
  ASSERT_TRUE(system.predict(at.set, 1, at.shared, at.local, true, here));
  ASSERT_EQ(here.by_shared.cols(), at.shared.size());
  ASSERT_EQ(here.by_local.cols(), at.local.size());
  const auto check = [&](bool shared, Index i, const VectorXd& column) {
    Setting more = at, less = at;
    const double value = shared ? at.shared[i] : at.local[i];
    const double step = 1e-5 * std::max(std::abs(value), 0.02);
    (shared ? more.shared : more.local)[i] += step;
    (shared ? less.shared : less.local)[i] -= step;
    ASSERT_TRUE(system.predict(at.set, 1, more.shared, more.local, false, up));
    ASSERT_TRUE(system.predict(at.set, 1, less.shared, less.local, false, down));
    const VectorXd difference = (up.reading - down.reading) / (2 * step);
    EXPECT_LT((column - difference).norm(), 2e-4 * difference.norm() + 1e-4) << (shared ? "shared " : "local ") << i;
  };
  for (Index i = 0; i < at.shared.size(); ++i) check(true, i, here.by_shared.col(i));
  for (Index i = 0; i < at.local.size(); ++i) check(false, i, here.by_local.col(i));
}

TEST_P(Derivatives, AreThoseOfDifferences) { expect_derivatives({}, GetParam()); }
TEST_P(Derivatives, AreThoseOfDifferencesWithHeadings) { expect_derivatives({.heading_sd_rad = 0.004}, GetParam()); }
TEST_P(Derivatives, AreThoseOfDifferencesInTheChangedGroup) {
  expect_derivatives({.heading_sd_rad = 0.004, .changed_from = 1}, GetParam());
}

INSTANTIATE_TEST_SUITE_P(Sets, Derivatives,
                         ::testing::Values(std::vector<std::string>{},
                                           std::vector<std::string>{"layer", "torsional_windup"},
                                           std::vector<std::string>{"lost_steps (rotation)", "camera_scale"},
                                           std::vector<std::string>{"tissue_motion", "entry_angle"},
                                           std::vector<std::string>{"relaxation", "drilling", "bevel_offset"},
                                           std::vector<std::string>{"stick_slip", "puncture"}));

TEST(NeedleDerivatives, OfWhatHeadingsShowAndOfWhatChanged) {
  expect_derivatives({.heading_sd_rad = 0.004}, {"sensor_tilt", "cutting_angle"});
  expect_derivatives({.changed_from = 1}, {"curvature_per_mm", "layer"});
  expect_derivatives({.changed_from = 1}, {"lambda1_per_rad", "lambda2"});
}

TEST(NeedleDerivatives, WhereDepthsWereReadByHand) {
  expect_derivatives({}, {"layer"}, false);
  expect_derivatives({.heading_sd_rad = 0.004, .changed_from = 1}, {"sensor_tilt"}, false);
}

// In the first group nothing acts, and a needle's change is what it says in the second.
TEST(TwoGroups, EffectsActInTheSecondAlone) {
  const SimulatedRig rig{.changed_from = 2};
  const NeedleSystem system(record_case(rig, 6), rig.needle);
  Setting at = setting_of(system, {"curvature_per_mm", "camera_scale"});
  const inference::Layout nothing(system, {});
  const auto none = nothing.shared_start();
  inference::Prediction plain, changed;
  ASSERT_TRUE(system.predict({}, 1, none, at.local, true, plain));
  ASSERT_TRUE(system.predict(at.set, 1, at.shared, at.local, true, changed));
  EXPECT_EQ(plain.reading, changed.reading);
  EXPECT_EQ(changed.by_shared.rightCols(2).norm(), 0);
  EXPECT_EQ(system.by_curves(1, none).norm(), 0);
  EXPECT_GT(system.by_curves(2, none).norm(), 0);

  at = setting_of(system, {"curvature_per_mm"});
  at.shared[at.shared.size() - 1] = 0.2;
  model::NeedleParameters bent = rig.needle;
  bent.curvature_per_mm *= 1.2;
  const NeedleSystem by_hand(record_case(rig, 6), bent);
  ASSERT_TRUE(system.predict(at.set, 2, at.shared, at.local, false, changed));
  VectorXd straight = none;
  straight[kCurvature] = bent.curvature_per_mm;
  ASSERT_TRUE(by_hand.predict({}, 2, straight, at.local, false, plain));
  EXPECT_LT((changed.reading - plain.reading).norm(), 1e-9);
}

// What all recordings share against depth is nobody's change.
TEST(TwoGroups, ACommonErrorIsTakenUpByTheReadings) {
  const SimulatedRig rig{.changed_from = 2};
  const NeedleSystem system(record_case(rig, 6), rig.needle);
  const inference::Layout nothing(system, {});
  VectorXd shared = nothing.shared_start();
  ASSERT_EQ(shared.size(), kBaseParameters + 3 * 8);
  inference::Prediction plain, shifted;
  ASSERT_TRUE(system.predict({}, 0, shared, nothing.local_start(), false, plain));
  shared.segment(kBaseParameters, 8).setConstant(0.7);  // of the first channel, at all depths
  ASSERT_TRUE(system.predict({}, 0, shared, nothing.local_start(), false, shifted));
  const auto by_channel = inference::by_channel(system.data().recordings[0], shifted.reading - plain.reading);
  EXPECT_LT((by_channel[0].array() - 0.7).abs().maxCoeff(), 1e-12);
  EXPECT_EQ(by_channel[1].norm() + by_channel[2].norm(), 0);
}

// Where nobody measures a heading, or nobody knows the time, what needs them is no candidate.
TEST(NeedleSystem, LooksOnlyForWhatTheRecordingsCanShow) {
  const auto has = [](const NeedleSystem& system, std::string_view name) {
    return std::ranges::any_of(system.effects(), [&](const auto& effect) { return effect.name == name; });
  };
  SimulatedRig rig;
  EXPECT_FALSE(has(NeedleSystem(record_case(rig, 7), rig.needle), "sensor_tilt"));
  EXPECT_FALSE(has(NeedleSystem(record_case(rig, 7), rig.needle), "curvature_per_mm"));
  rig.heading_sd_rad = 0.004;
  EXPECT_TRUE(has(NeedleSystem(record_case(rig, 7), rig.needle), "sensor_tilt"));
  auto raw = testing::record(rig, 7);
  for (auto& one : raw) one.has_clock = false;
  const NeedleSystem stops(make_case(std::move(raw)), rig.needle);
  for (const char* name : {"camera_latency", "tissue_motion", "relaxation", "rate_dependence", "lost_steps"})
    EXPECT_FALSE(has(stops, name)) << name;
  EXPECT_TRUE(has(stops, "layer"));
  for (const auto& curve : stops.curves()) EXPECT_THAT(curve.covariate, ::testing::Not(::testing::HasSubstr("_s")));
}

// Without a retraction, backlash of the insertion is an offset of the depth, as an error of the registration is.
TEST(NeedleSystem, LooksForInsertionBacklashWhereTheNeedleIsRetracted) {
  const auto has_backlash = [](const SimulatedRig& rig) {
    const NeedleSystem system(record_case(rig, 7), rig.needle);
    return std::ranges::any_of(system.effects(),
                               [](const auto& effect) { return effect.name == "insertion_backlash"; });
  };
  SimulatedRig rig;
  const double least_sd_mm = rig.sigma_mm.minCoeff();
  EXPECT_TRUE(has_backlash(rig));
  const auto retracted_by = [&](double mm) {
    rig.script = [mm](int) { return model::testing::Script{{4, 10, 0}, {1, -mm, 1}, {4, 10, 1}}; };
    return has_backlash(rig);
  };
  EXPECT_FALSE(retracted_by(0));
  EXPECT_FALSE(retracted_by(0.9 * least_sd_mm)) << "less than the tracker's noise";
  EXPECT_TRUE(retracted_by(1.1 * least_sd_mm));
}

// Without rotation slip and curvature bend the path in one plane: lambda keeps the value of the model file.
TEST(NeedleSystem, HoldsLambdaWhereTheShaftNeverTurns) {
  SimulatedRig rig{.recordings = 4, .changed_from = 2};
  const auto has = [](const NeedleSystem& system, const std::string& name) {
    return std::ranges::any_of(system.effects(), [&](const auto& effect) { return effect.name == name; });
  };
  const NeedleSystem turns(record_case(rig, 1), rig.needle);
  EXPECT_TRUE(turns.determines_slip());
  EXPECT_TRUE(has(turns, "curvature_per_mm") && has(turns, "lambda1_per_rad") && has(turns, "lambda2"));
  EXPECT_GT(1 / std::sqrt(precision_of(turns.base()[kLambda2].prior)), 0.1);

  rig.script = [](int) { return model::testing::Script{{6, 10, 0}}; };
  const NeedleSystem straight(record_case(rig, 1), rig.needle);
  EXPECT_FALSE(straight.determines_slip());
  EXPECT_TRUE(has(straight, "curvature_per_mm"));
  EXPECT_FALSE(has(straight, "lambda1_per_rad") || has(straight, "lambda2"));
  for (const BaseParameter p : {kU, kLambda2}) EXPECT_LT(1 / std::sqrt(precision_of(straight.base()[p].prior)), 2e-3);
  EXPECT_GT(1 / std::sqrt(precision_of(straight.base()[kCurvature].prior)), 1e-3);
}

// The density of an effect's parameter follows from the effect alone, not from what was recorded.
TEST(NeedleSystem, PriorsDoNotDependOnTheRecordings) {
  SimulatedRig rig{.recordings = 2};
  const NeedleSystem deep(record_case(rig, 1), rig.needle);
  rig.script = [](int) { return model::testing::Script{{1, 10, 0.5}, {1, 5, -0.5}, {0.2, -5, 0}}; };
  rig.frame_s = 0.1;
  const NeedleSystem shallow(record_case(rig, 1), rig.needle);
  ASSERT_EQ(deep.effects().size(), shallow.effects().size());
  for (std::size_t e = 0; e < deep.effects().size(); ++e)
    for (std::size_t p = 0; p < deep.effects()[e].parameters.size(); ++p) {
      const auto& one = deep.effects()[e].parameters[p];
      const auto& other = shallow.effects()[e].parameters[p];
      if (one.scope == inference::Scope::instant) continue;  // uniform over the recording
      for (const double value : {-0.3, 0.2, 1.0, 5.0, 40.0, 120.0})
        EXPECT_EQ(log_density(one.prior, value, 1e-3), log_density(other.prior, value, 1e-3))
            << deep.effects()[e].label << ' ' << one.name << ' ' << value;
    }
}

// With three effects, two curves and what differs between insertions there are as many as a needle carries.
TEST(NeedleSystem, HoldsAsManyKnownEffectsAsLeaveRoomForTheOthers) {
  const SimulatedRig rig;
  const auto known = [](std::size_t count) {
    KnownPhysics out;
    for (std::size_t i = 0; i < count; ++i) out.elsewhere.push_back(active("insertion_scale", {1.02}));
    return out;
  };
  EXPECT_NO_THROW(NeedleSystem(record_case(rig, 1), rig.needle, known(2)));
  EXPECT_THROW(NeedleSystem(record_case(rig, 1), rig.needle, known(3)), std::invalid_argument);
  EXPECT_NO_THROW(NeedleSystem(without_clock(rig, 1), rig.needle, known(1)));
  EXPECT_THROW(NeedleSystem(without_clock(rig, 1), rig.needle, known(2)), std::invalid_argument);
}

TEST(NeedleSystem, WithoutEffectsItIsTheModel) {
  const SimulatedRig rig;
  const NeedleSystem system(record_case(rig, 2), rig.needle);
  const inference::Layout layout(system, {});
  inference::Prediction prediction;
  ASSERT_TRUE(system.predict({}, 0, layout.shared_start(), layout.local_start(), false, prediction));
  model::OpenLoop path;
  ASSERT_TRUE(model::predict(model::AugmentedNeedle(rig.needle), system.recorded().recordings[0].motion, path));
  Index row = 0;
  for (std::size_t c = 0; c < system.recorded().channels.size(); ++c)
    for (const std::size_t reading : system.recorded().recordings[0].series[c].message)
      EXPECT_NEAR(prediction.reading[row++], system.recorded().channels[c].axis.dot(path.position_mm[reading]), 1e-9);
}

TEST(NeedleSystem, RegistrationShiftsEveryReading) {
  const SimulatedRig rig;
  const NeedleSystem system(record_case(rig, 2), rig.needle);
  const inference::Layout layout(system, {});
  inference::Prediction plain, shifted;
  VectorXd local = layout.local_start();
  ASSERT_TRUE(system.predict({}, 0, layout.shared_start(), local, false, plain));
  local[kEntryX] = 0.3, local[kEntryY] = -0.2;
  ASSERT_TRUE(system.predict({}, 0, layout.shared_start(), local, false, shifted));
  Index row = 0;
  for (std::size_t c = 0; c < system.recorded().channels.size(); ++c)
    for (std::size_t i = 0; i < system.data().recordings[0].series[c].time_s.size(); ++i, ++row)
      EXPECT_NEAR(shifted.reading[row] - plain.reading[row],
                  0.3 * system.recorded().channels[c].axis.x() - 0.2 * system.recorded().channels[c].axis.y(), 1e-12);
}

// Where depths were read by hand, along the axis too; of the tip's path as of the readings.
TEST(NeedleSystem, RegistrationAlongTheAxisWhereDepthsWereReadByHand) {
  const SimulatedRig rig;
  EXPECT_EQ(NeedleSystem(record_case(rig, 2), rig.needle).nuisances().size(), kVariations);
  const NeedleSystem system(without_clock(rig, 2), rig.needle);
  ASSERT_EQ(system.nuisances()[kEntryZ].name, "entry_z_mm");
  const inference::Layout layout(system, {});
  inference::Prediction plain, shifted;
  VectorXd local = layout.local_start();
  model::OpenLoop path, shifted_path;
  const auto& motion = system.recorded().recordings[0].motion;
  ASSERT_TRUE(system.predict({}, 0, layout.shared_start(), local, false, plain));
  ASSERT_TRUE(system.tip_path({}, motion, 0, layout.shared_start(), local, {}, path));
  local[kEntryZ] = 0.4;
  ASSERT_TRUE(system.predict({}, 0, layout.shared_start(), local, false, shifted));
  ASSERT_TRUE(system.tip_path({}, motion, 0, layout.shared_start(), local, {}, shifted_path));
  Index row = 0;
  for (std::size_t c = 0; c < system.recorded().channels.size(); ++c)
    for (std::size_t i = 0; i < system.data().recordings[0].series[c].time_s.size(); ++i, ++row)
      EXPECT_NEAR(shifted.reading[row] - plain.reading[row], 0.4 * system.recorded().channels[c].axis.z(), 1e-12);
  for (std::size_t i = 0; i < path.position_mm.size(); ++i)
    EXPECT_LT((shifted_path.position_mm[i] - path.position_mm[i] - Eigen::Vector3d(0, 0, 0.4)).norm(), 1e-12);
}

// A bicycle that does not bend by itself: headings lean by g s^2 / 2, the tip is off by g s^3 / 6, whatever its roll.
TEST(NeedleSystem, BendsMoreTheDeeperItIsWhereItWasGuidedByHand) {
  const SimulatedRig rig{.heading_sd_rad = 0.004};
  const NeedleSystem system(without_clock(rig, 2), rig.needle);
  ASSERT_EQ(system.nuisances().size(), kVariationsByHand);
  const inference::Layout layout(system, {});
  VectorXd shared = layout.shared_start(), local = layout.local_start();
  shared[kCurvature] = 0, shared[kU] = 0, shared[kLambda2] = 0;
  local[kRoll] = 1.1;
  model::Motion motion{.nodes = {}, .at = {}};
  for (int i = 0; i <= 200; ++i) {
    motion.nodes.push_back({.time_s = 0.1 * i, .insertion_mm = 0.5 * i, .rotation_rad = 0});
    motion.at.push_back(static_cast<std::size_t>(i));
  }
  model::OpenLoop path;
  local[kBendX] = 2e-4, local[kBendY] = -1e-4;
  ASSERT_TRUE(system.tip_path({}, motion, -1, shared, local, {}, path));
  for (const std::size_t i : {50U, 120U, 200U}) {
    const double s_mm = motion.nodes[i].insertion_mm;
    const Eigen::Vector2d gradient_per_mm2(2e-6, -1e-6);
    EXPECT_LT((path.position_mm[i].head(2) - std::pow(s_mm, 3) / 6 * gradient_per_mm2).norm(), 1e-4) << s_mm;
    EXPECT_LT((path.heading[i].head(2) - s_mm * s_mm / 2 * gradient_per_mm2).norm(), 1e-5) << s_mm;
  }
}

TEST(NeedleSystem, KindsOfOneEffectAreNeverTogether) {
  const SimulatedRig rig;
  const NeedleSystem system(record_case(rig, 3), rig.needle);
  const auto rotation = effect_named(system, "lost_steps (rotation)"),
             insertion = effect_named(system, "lost_steps (insertion)");
  EXPECT_TRUE(system.allows({rotation}));
  EXPECT_FALSE(system.allows(inference::with({rotation}, insertion)));
}

TEST(NeedleSystem, KindsOfOneEffectShareItsPriorOdds) {
  const SimulatedRig rig;
  const NeedleSystem system(record_case(rig, 3), rig.needle);
  const inference::Search search(system, {.log_prior_odds_effect = -5});
  std::map<std::string, double> odds;
  for (std::size_t e = 0; e < system.effects().size(); ++e)
    odds[system.effects()[e].name] += std::exp(search.log_prior({e}));
  for (const auto& [name, sum] : odds) EXPECT_NEAR(sum, std::exp(-5), 1e-12) << name;
  const auto about_x = effect_named(system, "camera_rotation (about_x)"),
             both = effect_named(system, "camera_rotation (about_x) (about_y)"), layer = effect_named(system, "layer");
  EXPECT_NEAR(search.log_prior({about_x}), -5 - std::log(3), 1e-12);
  EXPECT_NEAR(search.log_prior(inference::with({both}, layer)), -10 - std::log(3), 1e-12);
}

// A jump's length is no amplitude: between two of the grid's starts, readings are no multiple of either's.
TEST(NeedleSystem, StartsOfAJumpAreTakenAsTheyStand) {
  const SimulatedRig rig;
  const NeedleSystem system(record_case(rig, 3), rig.needle);
  const auto& jump = system.effects()[effect_named(system, "stick_slip")].parameters[0];
  EXPECT_TRUE(jump.shape);
  EXPECT_EQ(jump.none, 0);
  // To half a jump at the end of 90 mm, from 0.3 mm on.
  EXPECT_NEAR(jump.starts.front(), 0.3, 1e-9);
  for (std::size_t i = 1; i < jump.starts.size(); ++i)
    EXPECT_LT(90 / jump.starts[i - 1] - 90 / jump.starts[i], 0.51) << jump.starts[i];
}

// Only a jump makes much of where the base is, and then as much as half of itself.
TEST(NeedleSystem, AJumpIsAsUncertainAsTheBase) {
  const double jump_mm = 2.345;
  SimulatedRig rig;
  const NeedleSystem system(record_case(rig, 3), rig.needle);
  const Setting smooth = setting_of(system, {"insertion_scale"});
  EXPECT_EQ(system.by_inputs(smooth.set, 0, smooth.shared, smooth.local).size(), 0);
  Setting at = setting_of(system, {"stick_slip"});
  at.shared[at.shared.size() - 1] = jump_mm;
  int doubtful = 0, readings = 0;
  for (std::size_t r = 0; r < 4; ++r) {
    const VectorXd sd = system.by_inputs(at.set, r, at.shared, at.local);
    const auto& nodes = system.recorded().recordings[r].motion;
    ASSERT_EQ(sd.size(), system.data().recordings[r].rows());
    const auto& series = system.data().recordings[r].series[2];  // along z
    for (std::size_t i = 0; i < series.message.size(); ++i) {
      const double here = sd[sd.size() - static_cast<Index>(series.message.size() - i)];
      const double gone_mm = nodes.nodes[nodes.at[series.message[i]]].insertion_mm;
      const double to_jump_mm = std::abs(std::remainder(gone_mm, jump_mm));
      ++readings;
      if (here > 0.1) ++doubtful;
      if (here > 0.1 && gone_mm > 1) {
        EXPECT_LT(here, 0.51 * jump_mm);
      }
      // On the way in for the first time, where jumps are due at whole multiples.
      if (i < 10 && r % 3 == 0) {
        EXPECT_EQ(here > 0.1, to_jump_mm < 0.02 && gone_mm > 1) << gone_mm;
      }
    }
  }
  EXPECT_GT(doubtful, 0);
  EXPECT_LT(doubtful, readings / 10);
}

// A tip that is catching up after a membrane is anywhere on its way.
TEST(NeedleSystem, ATipThatCatchesUpIsAsUncertainAsItsWay) {
  const double depth_mm = 14.2, indentation_mm = 3;
  const SimulatedRig rig;
  const NeedleSystem system(record_case(rig, 3), rig.needle);
  Setting at = setting_of(system, {"puncture"});
  at.shared.tail(2) << depth_mm, indentation_mm;
  int catching_up = 0;
  for (std::size_t r = 0; r < 4; ++r) {
    const VectorXd sd = system.by_inputs(at.set, r, at.shared, at.local);
    inference::Prediction with, without;
    ASSERT_TRUE(system.predict(at.set, r, at.shared, at.local, false, with));
    at.shared.tail(1) << 0;
    ASSERT_TRUE(system.predict(at.set, r, at.shared, at.local, false, without));
    at.shared.tail(1) << indentation_mm;
    const auto rows = static_cast<Index>(system.data().recordings[r].series[2].message.size());  // along z
    bool held = false;
    for (Index i = sd.size() - rows; i < sd.size(); ++i) {
      const double behind_mm = without.reading[i] - with.reading[i];
      held = held || behind_mm > 0.2;
      if (sd[i] < 0.15) continue;
      ++catching_up;
      EXPECT_TRUE(held);
      // Through with a probability of the share of the way that is done.
      const double share = 1 - behind_mm / indentation_mm;
      EXPECT_NEAR(sd[i], indentation_mm * std::sqrt(std::max(0.0, share * (1 - share))), 0.35 * indentation_mm);
      EXPECT_LT(sd[i], 0.51 * (indentation_mm + 0.2));
    }
  }
  EXPECT_GT(catching_up, 0);
}

// End to end on the simulated rig: nothing, one effect, and one that is on no list.
struct Said {
  std::string set;
  bool curve;
};
Said say(const SimulatedRig& rig, std::uint64_t seed) {
  const NeedleSystem system(record_case(rig, seed), testing::SimulatedRig{}.needle);
  inference::Noise noise;
  noise.sigma = {0.15, 0.15, 0.2};
  noise.frame_s = rig.frame_s;
  inference::Search search(system, {});
  search.run(inference::Readings(system.data().recordings.size()), noise);
  const auto& best = search.best();
  return {describe(system, best.set), best.log_with_curve > best.log_without_curve};
}

TEST(NeedleSearch, NothingOneAndUnlisted) {
  EXPECT_EQ(say({}, 11).set, "nothing");
  SimulatedRig scaled;
  scaled.effects = {active("insertion_scale", {0.93})};
  const Said named = say(scaled, 12);
  EXPECT_EQ(named.set, "insertion_scale");
  EXPECT_FALSE(named.curve);
  SimulatedRig sticking;
  sticking.effects = {active("stick_slip", {1.234})};
  EXPECT_EQ(say(sticking, 14).set, "stick_slip");
  SimulatedRig drifting;
  drifting.true_motion = [](std::vector<model::ActuatorState>& states) {
    for (auto& s : states) s.insertion_mm += 1.5 * std::sin(0.11 * s.insertion_mm) * std::sin(0.11 * s.insertion_mm);
  };
  EXPECT_TRUE(say(drifting, 13).curve);
}

// A lead screw that is off by a hundredth of a millimetre: not so much as a frame is sure of its jump.
TEST(NeedleSearch, AJumpIsNotTakenForLostSteps) {
  SimulatedRig uneven;
  uneven.recordings = 6;
  uneven.frame_s = 1.0 / 30;
  uneven.effects = {active("stick_slip", {2.345})};
  uneven.true_motion = [](std::vector<model::ActuatorState>& states) {
    for (auto& s : states) s.insertion_mm += 0.01 * std::sin(std::numbers::pi * s.insertion_mm);
  };
  const Said said = say(uneven, 17);
  EXPECT_EQ(said.set, "stick_slip");
  EXPECT_FALSE(said.curve);
}

}  // namespace
}  // namespace bevel::diagnosis
