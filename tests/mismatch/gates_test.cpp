// The gates: whiteness, foretelling, what remains.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "diagnosis/mismatch/gates.hpp"
#include "tests/mismatch/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

double chi2_of(const Evidence& evidence, const Hypothesis& hypothesis, std::size_t r, const Eigen::VectorXd& values) {
  Workspace workspace;
  EXPECT_TRUE(evaluate(evidence, hypothesis, r, values, false, workspace));
  return workspace.residuals.white.squaredNorm();
}

TEST(LeaveOneOut, IsAFitToTheOthersByHand) {
  const SimulatedRig rig{.effects = {active("drilling", {2.0})}, .recordings = 3};
  const auto recorded = record_case(rig, 4);
  const Evidence evidence = evidence_of(recorded, rig);
  const Fit whole = fit_of(evidence, {member("drilling")});
  const HeldOutFit held_out = leave_one_out(evidence, whole, 2);
  double total = 0;
  for (std::size_t r = 0; r < 3; ++r) {
    RecordedCase others = recorded;
    others.recordings.erase(others.recordings.begin() + static_cast<std::ptrdiff_t>(r));
    const Evidence other_evidence = evidence_of(others, rig);
    const Hypothesis hypothesis(rig.needle, {member("drilling")}, others);
    const Fit by_hand = fit(other_evidence, hypothesis, whole.values);
    EXPECT_EQ(held_out.values[r], by_hand.values) << r;
    EXPECT_EQ(held_out.chi2[r], chi2_of(evidence, whole.hypothesis, r, by_hand.values)) << r;
    EXPECT_EQ(held_out.count[r], whole.count_by_recording[r]);
    total += held_out.chi2[r];
  }
  EXPECT_DOUBLE_EQ(held_out.total(), total);
  EXPECT_GT(held_out.total(), whole.chi2) << "what is foretold is never better than what is fitted";
}

TEST(LeaveOneOut, FitsOnlyThePhaseOfTheRecordingHeldOut) {
  const double phases[] = {0.5, 2.2, 4.1};
  const SimulatedRig rig{.effects_in =
                             [&](int r) {
                               return std::vector{active("tissue_motion", {1.0, 0.4, 0.6, phases[r]})};
                             },
                         .recordings = 3};
  const auto recorded = record_case(rig, 4);
  const Evidence evidence = evidence_of(recorded, rig);
  const Hypothesis hypothesis(rig.needle, {member("tissue_motion")}, recorded);
  Eigen::VectorXd start = hypothesis.start();
  start.segment<3>(3) << 1.0, 0.4, 0.6;
  for (int r = 0; r < 3; ++r) start[6 + r] = phases[r];
  const Fit whole = fit(evidence, hypothesis, start);
  const HeldOutFit held_out = leave_one_out(evidence, whole, 1);
  for (std::size_t r = 0; r < 3; ++r) {
    const int own = hypothesis.find(0, 3, static_cast<int>(r));
    Evidence others = evidence;
    others.used = {true, true, true};
    others.used[r] = false;
    Eigen::VectorXd expected = fit(others, hypothesis, whole.values).values;
    Eigen::VectorXd found = held_out.values[r];
    expected[own] = found[own] = 0;
    EXPECT_EQ(found, expected) << "all else is of the others";
    // No phase of a fine grid is better.
    double least = 1e300;
    for (int i = 0; i < 2000; ++i) {
      Eigen::VectorXd trial = held_out.values[r];
      trial[own] = 2 * std::numbers::pi * i / 2000;
      least = std::min(least, chi2_of(evidence, hypothesis, r, trial));
    }
    EXPECT_LT(held_out.chi2[r], least + 0.05);
  }
}

TEST(LeaveOneOut, ARecordingThatLeavesTheDomainIsNotForetold) {
  // Two short straight insertions, and readings that say next to nothing: the fit stays where the belief is, and there
  // the third recording turns past where the slip law is defined.
  SimulatedRig rig{.recordings = 3};
  auto raw = record(rig, 4);
  for (std::size_t r = 0; r < 2; ++r)
    for (auto& state : raw[r].actuators) state.insertion_mm *= 0.05, state.rotation_rad = 0;
  const auto recorded = make_case(raw);
  rig.needle.lambda1_per_rad = 0.3;
  rig.needle.lambda2 = 0.9;
  Evidence evidence = evidence_of(recorded, rig);
  for (double& sigma_mm : evidence.noise.sigma_mm) sigma_mm = 1e4;
  Fit whole(Hypothesis(rig.needle, {}, recorded));
  whole.values = whole.hypothesis.start();
  Workspace workspace;
  ASSERT_FALSE(evaluate(evidence, whole.hypothesis, 2, whole.values, false, workspace));
  const HeldOutFit held_out = leave_one_out(evidence, whole, 1);
  EXPECT_EQ(held_out.count[2], 3 * recorded.recordings[2].series[0].time_s.size());
  EXPECT_GT(held_out.chi2[2], 1e3 * static_cast<double>(held_out.count[2]));
}

// Only the first recording goes deeper than 30 mm: what the others do not tell of a curve must not be made up.
TEST(LeaveOneOut, OfACurveThatOnlyOneRecordingSeesInFull) {
  const SimulatedRig rig{.effects = {active("depth_dependence", {1.5})}};
  auto raw = record(rig, 4);
  for (std::size_t r = 1; r < raw.size(); ++r) {
    const auto deep = std::find_if(raw[r].actuators.begin(), raw[r].actuators.end(),
                                   [](const auto& state) { return state.insertion_mm > 30; });
    const auto end_utime = deep->utime;
    raw[r].actuators.erase(deep, raw[r].actuators.end());
    std::erase_if(raw[r].tips, [&](const auto& tip) { return tip.utime >= end_utime; });
  }
  const auto recorded = make_case(raw);
  const Evidence evidence = evidence_of(recorded, rig);
  const CorrectionLibrary library(recorded);
  const Fit whole = fit_of(evidence, {curve(library, "correction of the curvature toward the bevel by depth_mm")});
  const double without_curve = leave_one_out(evidence, fit_of(evidence, {}), 1).chi2[0];
  EXPECT_LT(leave_one_out(evidence, whole, 1).chi2[0], without_curve);
  // Left to the others alone, it is worse than none.
  Evidence others = evidence;
  others.used = {false, true, true, true};
  const Fit left_alone = fit(others, whole.hypothesis, whole.values);
  EXPECT_GT(chi2_of(evidence, whole.hypothesis, 0, left_alone.values), without_curve);
}

TEST(Remains, OfATrueModelAreNoise) {
  int outside = 0, rejected = 0, structured = 0;
  constexpr int kReplicates = 40;
  for (std::uint64_t seed = 1; seed <= kReplicates; ++seed) {
    const SimulatedRig rig{.ar1 = 0.5};
    const auto recorded = record_case(rig, seed);
    const Evidence evidence = evidence_of(recorded, rig);
    const Remains remains = examine_remains(evidence, fit_of(evidence, {}));
    if (remains.chi2_per_dof < remains.band[0] || remains.chi2_per_dof > remains.band[1]) ++outside;
    if (remains.ljung_box_p < 0.01) ++rejected;
    if (remains.structure_sigmas > 3) ++structured;
  }
  // One in a hundred of each is expected; four of forty come about once in a thousand.
  EXPECT_LE(outside, 3);
  EXPECT_LE(rejected, 3);
  EXPECT_LE(structured, 3);
}

TEST(Remains, ShowPhysicsThatIsLeftOut) {
  const SimulatedRig rig{.effects = {active("layer", {30, 0.6})}, .ar1 = 0.5};
  const auto recorded = record_case(rig, 2);
  const Evidence evidence = evidence_of(recorded, rig);
  const Fit base = fit_of(evidence, {});
  const Remains before = examine_remains(evidence, base);
  EXPECT_GT(before.chi2_per_dof, before.band[1]);
  EXPECT_GT(before.structure_sigmas, 10);
  EXPECT_TRUE(before.has_structure());
  const Hypothesis hypothesis(rig.needle, {member("layer")}, recorded);
  Eigen::VectorXd start = hypothesis.start();
  start.tail<2>() << 30, 0.7;
  const Fit layer = fit(evidence, hypothesis, start);
  const Remains after = examine_remains(evidence, layer);
  EXPECT_LT(after.structure_sigmas, 3);
  EXPECT_FALSE(after.has_structure());
  // What the layer explains of chi2 was slow structure.
  EXPECT_NEAR(before.structure_energy - after.structure_energy, base.chi2 - layer.chi2, 0.1 * (base.chi2 - layer.chi2));
}

}  // namespace
}  // namespace bevel::diagnosis::testing
