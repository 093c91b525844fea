// Which names are given, on recordings of which the truth is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "diagnosis/mismatch/conclusions.hpp"
#include "diagnosis/mismatch/pairs.hpp"
#include "diagnosis/mismatch/selection.hpp"
#include "tests/mismatch/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

constexpr int kDraws = 200;

struct Selected {
  std::vector<std::string> names;
  bool nameless = false;
  std::string described;
};

// On evidence with the noise known; calibration has tests of its own.
Selected select(const SimulatedRig& rig, std::uint64_t seed) {
  const auto recorded = record_case(rig, seed);
  const Evidence evidence = evidence_of(recorded, rig);
  Selection selection(evidence, fit_of(evidence, {}), {.bootstrap_draws = kDraws, .seed = 1});
  Selected out;
  const EffectSet set = selection.select();
  out.described = describe(set);
  for (const Member& one : set) {
    if (is_correction(one))
      out.nameless = true;
    else
      out.names.emplace_back(one.effect->name());
  }
  return out;
}

TEST(Select, NothingWhereNothingIsMissing) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const SimulatedRig rig{.ar1 = seed % 2 == 0 ? 0.7 : 0.0};
    const auto found = select(rig, seed);
    EXPECT_THAT(found.names, IsEmpty()) << "seed " << seed;
    EXPECT_FALSE(found.nameless) << "seed " << seed;
  }
}

TEST(Select, NothingWhereOnlyTheModelFileIsWrong) {
  SimulatedRig rig;
  const auto recorded = record_case(rig, 5);
  rig.needle.curvature_per_mm *= 1.25;
  rig.needle.lambda1_per_rad += 0.2;
  const Evidence evidence = evidence_of(recorded, rig);
  Selection selection(evidence, fit_of(evidence, {}), {.bootstrap_draws = kDraws, .seed = 1});
  EXPECT_EQ(describe(selection.select()), "nothing");
}

TEST(Select, TorsionalWindup) {
  const auto found = select({.effects = {active("torsional_windup", {1.0})}, .ar1 = 0.5}, 1);
  EXPECT_THAT(found.names, UnorderedElementsAre("torsional_windup"));
  EXPECT_FALSE(found.nameless);
}

TEST(Select, DrillingAndRotationBacklash) {
  const auto found = select(
      {.effects = {active("drilling", {2.0}), active("rotation_backlash", {0.5})}, .frame_s = 0.1, .ar1 = 0.4}, 1);
  EXPECT_THAT(found.names, UnorderedElementsAre("drilling", "rotation_backlash"));
  EXPECT_FALSE(found.nameless);
}

// While the needle advances: at rest nothing shows when rotation is lost, only that it was.
TEST(Select, StepsLostInTwoRecordingsOfSix) {
  const SimulatedRig rig{.effects_in =
                             [](int r) {
                               return std::vector{active("lost_steps", {0.9, 0, r == 1 ? 3.87 : r == 4 ? 1.63 : 0})};
                             },
                         .recordings = 6,
                         .frame_s = 0.1};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  Selection selection(evidence, fit_of(evidence, {}), {.bootstrap_draws = kDraws, .seed = 1});
  const EffectSet set = selection.select();
  ASSERT_EQ(describe(set), "lost_steps");
  const Fit& fit = *selection.fit_of(set);
  EXPECT_NEAR(fit.hypothesis.parameter(fit.values, 0, 0), 0.9, 0.1);
  for (int r = 0; r < 6; ++r) {
    const double at_s = fit.hypothesis.parameter(fit.values, 0, 2, r);
    EXPECT_NEAR(at_s, r == 1 ? 3.87 : r == 4 ? 1.63 : 0, 0.2) << "recording " << r;
  }
}

// The insertion rattles: what is left is no noise, whatever is named.
TEST(Select, NoStepsLostWhileReadingsHangTogether) {
  SimulatedRig rig{
      .effects_in =
          [](int r) {
            return r % 3 == 0 ? std::vector{active("lost_steps", {0.3, 0, 3.0})} : std::vector<model::ActiveEffect>{};
          },
      .recordings = 6};
  EXPECT_THAT(select(rig, 1).names, Contains("lost_steps"));
  rig.true_motion = rattle(0.3);
  EXPECT_THAT(select(rig, 1).names, Not(Contains("lost_steps")));
}

TEST(Select, NoNameForAnEffectThatIsOnNoList) {
  // The drive slips more and more as it warms: the tip's advance falls behind with time, not with depth.
  const auto slipping = [](std::vector<model::ActuatorState>& base) {
    double tip_mm = 0, before_mm = base.front().insertion_mm;
    for (auto& state : base) {
      const double time_s = 1e-6 * static_cast<double>(state.utime - base.front().utime);
      const double share = 1 - 0.09 * std::sin(1.3 * time_s);
      tip_mm += share * (state.insertion_mm - before_mm);
      before_mm = state.insertion_mm;
      state.insertion_mm = tip_mm;
    }
  };
  const auto found = select({.true_motion = slipping, .recordings = 6}, 1);
  EXPECT_TRUE(found.nameless) << found.described;
  EXPECT_THAT(found.names, IsEmpty());
}

// The recordings last 7 to 9 s: of a swing of 0.12 Hz they show one period.
TEST(Select, NoTissueMotionWhereNoPeriodShows) {
  const auto phase = [](int r) { return std::vector{active("tissue_motion", {0.8, 0.12, 0.5, 1.3 * r})}; };
  const auto found = select({.effects_in = phase, .frame_s = 0.1}, 1);
  EXPECT_NE(found.described, "nothing");
  EXPECT_THAT(found.names, Not(Contains("tissue_motion"))) << found.described;
}

// Either explains the path; entry_angle has a parameter more.
TEST(Select, OfTwoNamesForOneThingTheOneWithFewerParameters) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const auto found = select({.effects = {active("camera_rotation", {0.03})}, .frame_s = 0.1}, seed);
    EXPECT_THAT(found.names, UnorderedElementsAre("camera_rotation")) << "seed " << seed;
  }
}

// Slip and compression lose way; a camera may read too much or too little.
TEST(Select, ReadingsThatGrowAreTheCameras) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const auto found = select({.effects = {active("camera_scale", {1.02})}, .frame_s = 0.1}, seed);
    EXPECT_THAT(found.names, UnorderedElementsAre("camera_scale")) << "seed " << seed;
  }
}

// It holds the tip for a few frames: its start has to be near in depth.
TEST(Select, AMembraneOfAMillimetreInColouredNoise) {
  for (const double depth_mm : {21.37, 34.12}) {
    const auto found = select({.effects = {active("puncture", {depth_mm, 1.1})}, .frame_s = 1.0 / 30, .ar1 = 0.9}, 1);
    EXPECT_THAT(found.names, UnorderedElementsAre("puncture")) << depth_mm;
  }
}

// It holds the tip for a frame or two: a start of a millimetre would look elsewhere.
TEST(Select, AMembraneOfHalfAMillimetreInColouredNoise) {
  const auto found =
      select({.effects = {active("puncture", {27.86, 0.5})}, .recordings = 8, .frame_s = 1.0 / 30, .ar1 = 0.9}, 1);
  EXPECT_THAT(found.names, UnorderedElementsAre("puncture"));
}

TEST(Select, StepsLostInMoreThanHalfOfTheRecordings) {
  const SimulatedRig rig{.effects_in =
                             [](int r) {
                               return std::vector{active("lost_steps", {0, -1.2, r < 4 ? 1.37 + 0.71 * r : 0})};
                             },
                         .recordings = 6,
                         .frame_s = 0.1};
  EXPECT_THAT(select(rig, 1).names, UnorderedElementsAre("lost_steps"));
}

// A shaft that feeds itself as it turns, by so many mm a radian, is on no list.
Selected select_beside_a_screw(double pitch_mm_per_rad, const model::ActiveEffect& effect) {
  const auto screw = [pitch_mm_per_rad](std::vector<model::ActuatorState>& base) {
    const double start_rad = base.front().rotation_rad;
    for (auto& state : base) state.insertion_mm += pitch_mm_per_rad * (state.rotation_rad - start_rad);
  };
  return select({.effects = {effect}, .true_motion = screw}, 1);
}

TEST(Select, ANameBesideACurveWhereItLeavesNothingOver) {
  const auto found = select_beside_a_screw(0.08, active("insertion_backlash", {1.5}));
  EXPECT_TRUE(found.nameless) << found.described;
  EXPECT_THAT(found.names, UnorderedElementsAre("insertion_backlash")) << found.described;
}

// It explains a hundredth of what the screw does, and stands out all the same.
TEST(Select, ASmallNameBesideALargeCurveWhereOnlyNoiseIsLeft) {
  const auto found = select_beside_a_screw(0.4, active("camera_rotation", {0.01}));
  EXPECT_TRUE(found.nameless) << found.described;
  EXPECT_THAT(found.names, UnorderedElementsAre("camera_rotation")) << found.described;
}

// Slip along the tilt instead of the bevel, and a bevel that is followed late.
const SimulatedRig kTwoThatHideEachOther{
    .effects = {active("flip_transient", {5.0}), active("slip_direction", {})}, .recordings = 5, .frame_s = 0.1};

TEST(BestPairs, BeginWithTheTwoThatAreThere) {
  const auto recorded = record_case(kTwoThatHideEachOther, 1);
  const Evidence evidence = evidence_of(recorded, kTwoThatHideEachOther);
  const Fit base = fit_of(evidence, {});
  const Ground ground = make_ground(evidence, base);
  const auto candidates = make_dictionary(evidence, base, ground, members_of_library({}), 2);
  const auto pairs = best_pairs(candidates, ground, 5);
  ASSERT_EQ(pairs.size(), 5U);
  std::vector<std::string> names;
  for (const std::size_t i : pairs.front()) names.emplace_back(candidates[i].member.effect->name());
  EXPECT_THAT(names, UnorderedElementsAre("flip_transient", "slip_direction"));
  for (const auto& [one, other] : pairs) EXPECT_NE(one, other);
}

TEST(Select, TwoThatHideEachOther) {
  const auto found = select(kTwoThatHideEachOther, 1);
  EXPECT_THAT(found.names, UnorderedElementsAre("flip_transient", "slip_direction")) << found.described;
  EXPECT_FALSE(found.nameless);
}

// Bitwise the same, in everything that is reported of the trials.
TEST(Select, IsThatOfItsSeedWhateverTheThreads) {
  const SimulatedRig rig{.effects = {active("torsional_windup", {0.6})}, .recordings = 2, .frame_s = 0.1};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  const auto everything = [&](int threads) {
    Selection selection(evidence, fit_of(evidence, {}), {.bootstrap_draws = 50, .seed = 9, .threads = threads});
    const EffectSet set = selection.select();
    std::vector<std::pair<std::string, std::vector<double>>> out = {{describe(set), {}}};
    for (const auto& [visited, gain] : selection.visited()) out.emplace_back(describe(visited), std::vector{gain});
    for (const Trial& trial : selection.additions({})) {
      std::vector<double> numbers = {trial.gain, trial.chance, trial.threshold, trial.evidence};
      if (trial.fit) numbers.insert(numbers.end(), trial.fit->values.begin(), trial.fit->values.end());
      out.emplace_back(describe(trial.set), numbers);
    }
    return out;
  };
  const auto one = everything(1);
  EXPECT_EQ(one, everything(2));
  EXPECT_EQ(one, everything(1));
}

TEST(Additions, AreRankedByPreferenceAndHaveTheirThresholds) {
  const SimulatedRig rig{.effects = {active("layer", {31, 0.7})}};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  Selection selection(evidence, fit_of(evidence, {}), {.bootstrap_draws = kDraws, .seed = 1});
  const auto& trials = selection.additions({});
  ASSERT_GT(trials.size(), 19U);
  EXPECT_EQ(describe(trials.front().set), "layer");
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Trial& trial = trials[i];
    if (i > 0) {
      EXPECT_GE(trials[i - 1].preference, trial.preference);
    }
    EXPECT_GT(trial.threshold, trial.chance);
    // But for the one without an amplitude, which cannot be nothing.
    if (describe(trial.set) != "slip_direction") {
      EXPECT_GE(trial.gain, -0.1) << describe(trial.set);
    }
  }
}

TEST(BestCorrection, BesideASetThatLeavesItNoRoomIsNone) {
  const SimulatedRig rig{.recordings = 2};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  Selection selection(evidence, fit_of(evidence, {}), {.bootstrap_draws = kDraws, .seed = 1});
  // 3 of the needle and 10: a curve of four knots would make 17.
  const EffectSet full = {member("tissue_motion"), member("entry_angle"), member("lateral_bias"), member("refraction")};
  EXPECT_EQ(selection.best_correction(full).fit, nullptr);
}

TEST(ProbabilityOf, IsTheShareOfTheSetsThatHaveIt) {
  const Member a = member("drilling"), b = member("layer");
  // Preference is twice a log-probability.
  const std::vector<std::pair<EffectSet, double>> visited = {{{}, 0}, {{a}, 30}, {{b}, 30}, {{a, b}, 30}};
  EXPECT_NEAR(probability_of(visited, a), 2.0 / 3, 1e-6);
  EXPECT_NEAR(probability_of({{{}, 0}, {{a}, 0}}, a), 0.5, 1e-12);
  EXPECT_NEAR(probability_of({{{}, 0}, {{a}, 2 * std::log(19.0)}}, a), 0.95, 1e-12);
  EXPECT_LT(probability_of({{{}, 0}, {{a}, -10}}, a), 0.01);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
