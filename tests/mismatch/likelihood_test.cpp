// The likelihood: its derivatives, what a fit makes of known parameters, bounds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "tests/mismatch/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

struct Hypothetical {
  std::string what;
  EffectSet set;
  std::vector<std::vector<double>> shared;  // per member: values of all its parameters
  // Of the parameter that recordings have for themselves, if there is one.
  std::vector<double> local{};
};

Eigen::VectorXd values_of(const Hypothesis& hypothesis, const Hypothetical& of) {
  Eigen::VectorXd values = hypothesis.start();
  values[kUnknownU] += 0.05;
  for (std::size_t i = kBaseUnknowns; i < hypothesis.unknowns().size(); ++i) {
    const Unknown& u = hypothesis.unknowns()[i];
    values[static_cast<Eigen::Index>(i)] =
        u.recording >= 0 ? of.local[static_cast<std::size_t>(u.recording)]
                         : of.shared[static_cast<std::size_t>(u.member)][static_cast<std::size_t>(u.parameter)];
  }
  return values;
}

class Jacobian : public ::testing::TestWithParam<Hypothetical> {};

TEST_P(Jacobian, IsThatOfFiniteDifferences) {
  const SimulatedRig rig{.ar1 = 0.6};
  const auto recorded = record_case(rig, 7);
  const Evidence evidence = evidence_of(recorded, rig);
  const Hypothesis hypothesis(rig.needle, GetParam().set, recorded);
  const Eigen::VectorXd values = values_of(hypothesis, GetParam());
  Workspace workspace;
  for (std::size_t r = 0; r < recorded.recordings.size(); ++r) {
    ASSERT_TRUE(evaluate(evidence, hypothesis, r, values, true, workspace));
    const Residuals at = workspace.residuals;
    const auto& columns = hypothesis.columns(r);
    ASSERT_EQ(at.jacobian.cols(), static_cast<Eigen::Index>(columns.size()));
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const Unknown& u = hypothesis.unknowns()[static_cast<std::size_t>(columns[i])];
      const auto column = at.jacobian.col(static_cast<Eigen::Index>(i));
      if (u.recording >= 0 && !u.periodic && values[columns[i]] == 0) {
        EXPECT_EQ(column.norm(), 0) << "an instant that is not in this recording moves nothing";
        continue;
      }
      const double step = 1e-6 * std::max(std::abs(values[columns[i]]), 1e-2);
      const auto residual_at = [&](double sign) {
        Eigen::VectorXd moved = values;
        moved[columns[i]] += sign * step;
        evaluate(evidence, hypothesis, r, moved, false, workspace);
        return workspace.residuals.white;
      };
      const Eigen::VectorXd difference = (residual_at(1) - residual_at(-1)) / (2 * step);
      EXPECT_LT((column - difference).norm(), 1e-4 * difference.norm() + 1e-3)
          << "recording " << r << ", unknown " << columns[i] << " of " << describe(hypothesis.set());
    }
  }
}

// No round numbers: where a gap just closes at the end of a leg there is no derivative.
INSTANTIATE_TEST_SUITE_P(
    Sets, Jacobian,
    ::testing::Values(Hypothetical{"nothing", {}, {}},
                      Hypothetical{"windup_drilling_latency",
                                   {member("torsional_windup"), member("drilling"), member("camera_latency")},
                                   {{0.6}, {1.3}, {0.09}}},
                      Hypothetical{"backlashes_relaxation_scale",
                                   {member("rotation_backlash"), member("insertion_backlash"), member("relaxation"),
                                    member("camera_scale")},
                                   {{0.287}, {0.813}, {0.9, 4.0, 3.7}, {1.03}}},
                      Hypothetical{
                          "layer_rate_flip_entry",
                          {member("layer"), member("rate_dependence"), member("flip_transient"), member("entry_angle")},
                          {{31.3, 0.7}, {0.2}, {6.0}, {0.03, -0.02}}},
                      Hypothetical{"lost_rotation_bias",
                                   {member("lost_steps", 0b101), member("lateral_bias")},
                                   {{0.8, 0, 0}, {0.0008, -0.0005}},
                                   {0, 3.011, 0, 5.207}},
                      Hypothetical{"lost_insertion_refraction",
                                   {member("lost_steps", 0b110), member("refraction"), member("insertion_scale")},
                                   {{0, -2.5, 0}, {0.02, 40}, {0.93}},
                                   {2.513, 0, 0, 4.017}},
                      Hypothetical{"tissue_motion_offset",
                                   {member("tissue_motion"), member("bevel_offset")},
                                   {{0.7, 0.31, 1.1, 0}, {0.2}},
                                   {0.4, 1.9, 3.3, 5.8}}),
    [](const auto& of) { return of.param.what; });

TEST(Hypothesis, FindsItsUnknownsAndCarriesValuesOver) {
  const auto recorded = record_case({}, 1);
  const Hypothesis one(SimulatedRig{}.needle, {member("drilling")}, recorded);
  const Hypothesis two(SimulatedRig{}.needle, {member("lost_steps", 0b101), member("drilling")}, recorded);
  EXPECT_EQ(one.size(), 4);
  EXPECT_EQ(two.size(), 3 + 1 + 4 + 1);
  EXPECT_EQ(two.find(0, 1), -1) << "the axis that does not stall is not fitted";
  EXPECT_NE(two.find(0, 2, 1), two.find(0, 2, 3));
  Eigen::VectorXd values = one.start();
  values << 0.003, 0.4, 0.1, 2.5;
  const Eigen::VectorXd carried = two.start_from(one, values);
  EXPECT_EQ(carried.head<3>(), values.head<3>());
  EXPECT_EQ(two.parameter(carried, 1, 0), 2.5);
  EXPECT_EQ(two.parameter(carried, 0, 0), 0) << "rotation that is lost: none";
  EXPECT_NEAR(one.needle(values).lambda1_per_rad, 0.4 + 0.01 / 6.283185307, 1e-9);
}

TEST(Hypothesis, HoldsItsBounds) {
  const auto recorded = record_case({}, 1);
  const Hypothesis hypothesis(SimulatedRig{}.needle, {member("rotation_backlash"), member("bevel_offset")}, recorded);
  Eigen::VectorXd values = hypothesis.start();
  values[hypothesis.find(0, 0)] = -0.2;
  values[hypothesis.find(1, 0)] = 4.0;
  values[kUnknownU] = -1;
  hypothesis.clamp(values);
  EXPECT_EQ(values[hypothesis.find(0, 0)], 0);
  EXPECT_NEAR(values[hypothesis.find(1, 0)], 4.0 - 2 * std::numbers::pi, 1e-12);
  EXPECT_GT(values[kUnknownU], 0);
}

TEST(Hypothesis, ADirectionPastItsEndsIsTheSameSwing) {
  const auto recorded = record_case({.recordings = 2}, 1);
  const Hypothesis hypothesis(model::testing::agar(), {member("tissue_motion")}, recorded);
  const auto set = [&](double direction_rad) {
    Eigen::VectorXd values = hypothesis.start();
    values[hypothesis.find(0, 0)] = 0.7;
    values[hypothesis.find(0, 1)] = 0.3;
    values[hypothesis.find(0, 2)] = direction_rad;
    values[hypothesis.find(0, 3, 0)] = 1.0;
    values[hypothesis.find(0, 3, 1)] = 5.0;
    return values;
  };
  model::OpenLoop path, turned_path;
  for (const double direction_rad : {-0.2, 3.3, -3.5, 7.0}) {
    Eigen::VectorXd turned = set(direction_rad);
    hypothesis.clamp(turned);
    EXPECT_GE(turned[hypothesis.find(0, 2)], 0);
    EXPECT_LE(turned[hypothesis.find(0, 2)], std::numbers::pi);
    for (std::size_t r = 0; r < 2; ++r) {
      const auto& motion = recorded.recordings[r].motion;
      ASSERT_TRUE(model::predict(hypothesis.make_needle(r, set(direction_rad), false), motion, path));
      ASSERT_TRUE(model::predict(hypothesis.make_needle(r, turned, false), motion, turned_path));
      for (std::size_t i = 0; i < path.position_mm.size(); ++i)
        ASSERT_LT((path.position_mm[i] - turned_path.position_mm[i]).norm(), 1e-12) << direction_rad;
    }
  }
}

TEST(Hypothesis, AFrequencyIsOneThatTheReadingsShow) {
  const auto recorded = record_case({.recordings = 2, .frame_s = 0.4}, 1);
  const Hypothesis hypothesis(model::testing::agar(), {member("tissue_motion")}, recorded);
  const Unknown& frequency = hypothesis.unknowns()[static_cast<std::size_t>(hypothesis.find(0, 1))];
  EXPECT_NEAR(frequency.upper, 1.0, 1e-9) << "two and a half readings a period";
  const double longest_s = std::max(recorded.recordings[0].duration_s(), recorded.recordings[1].duration_s());
  EXPECT_NEAR(frequency.lower, 1.5 / longest_s, 1e-9) << "one and a half periods in the longest";
}

TEST(Hypothesis, OfTooManyUnknownsIsRefused) {
  const auto recorded = record_case({}, 1);
  const EffectSet many = {member("tissue_motion"), member("entry_angle"), member("lateral_bias"), member("relaxation"),
                          member("refraction"),    member("layer"),       member("puncture")};
  EXPECT_FALSE(can_be_fitted(many));
  EXPECT_TRUE(can_be_fitted({many.begin(), many.end() - 2})) << "16 of 16";
  try {
    const Hypothesis hypothesis(SimulatedRig{}.needle, many, recorded);
    FAIL() << "taken";
  } catch (const std::invalid_argument& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("at most 16"));
  }
}

// z-scores of fitted against true parameters. The belief in the needle counts as data: it is drawn too.
TEST(Fit, RecoversWhatIsTrueWithinItsErrors) {
  constexpr int kReplicates = 60;
  const std::vector<double> truth = {0.6, 0.05, 0.96};
  const EffectSet set = {member("torsional_windup"), member("camera_latency"), member("insertion_scale")};
  double chi2 = 0, count = 0;
  std::vector<double> sum(4, 0), squares(4, 0);
  for (int i = 0; i < kReplicates; ++i) {
    SimulatedRig rig{.effects = {active("torsional_windup", {truth[0]}), active("camera_latency", {truth[1]}),
                                 active("insertion_scale", {truth[2]})},
                     .recordings = 3,
                     .ar1 = 0.5};
    const auto recorded = record_case(rig, 1000 + static_cast<std::uint64_t>(i));
    const Evidence evidence = evidence_of(recorded, rig);
    const Fit found = fit_of(evidence, set);
    ASSERT_TRUE(found.valid);
    const Eigen::MatrixXd covariance = found.covariance();
    chi2 += found.chi2;
    count += static_cast<double>(found.count()) - static_cast<double>(found.hypothesis.size());
    for (std::size_t p = 0; p < 4; ++p) {
      const int at = p == 3 ? static_cast<int>(kUnknownK) : found.hypothesis.find(p, 0);
      const double z =
          (found.values[at] - (p == 3 ? rig.needle.curvature_per_mm : truth[p])) / std::sqrt(covariance(at, at));
      sum[p] += z, squares[p] += z * z;
    }
  }
  // 99.9 % for each.
  const char* names[] = {"lag_at_100mm_rad", "latency_s", "ratio", "k"};
  for (std::size_t p = 0; p < 4; ++p) {
    std::cout << names[p] << ": mean z " << sum[p] / kReplicates << ", mean z^2 " << squares[p] / kReplicates << '\n';
    EXPECT_LT(std::abs(sum[p] / std::sqrt(kReplicates)), 3.3) << names[p];
    EXPECT_GT(squares[p] / kReplicates, 0.50) << names[p];  // chi2 of 60: 0.1 % and 99.9 %
    EXPECT_LT(squares[p] / kReplicates, 1.66) << names[p];
  }
  EXPECT_NEAR(chi2 / count, 1, 3.3 * std::sqrt(2 / count)) << count << " readings";
}

TEST(Fit, OfAnEffectThatIsNotThereStopsAtItsBoundOrNearIt) {
  int at_bound = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    const SimulatedRig rig{.recordings = 3};
    const auto recorded = record_case(rig, seed);
    const Evidence evidence = evidence_of(recorded, rig);
    const Fit found = fit_of(evidence, {member("drilling")});
    const int unknown = found.hypothesis.find(0, 0);
    EXPECT_GE(found.values[unknown], 0);
    if (found.values[unknown] > 0) continue;
    ++at_bound;
    // At the bound it is the fit without the effect.
    EXPECT_NEAR(found.penalised, fit_of(evidence, {}).penalised, 0.02);
  }
  // Half of the time: 99.9 % of a fair coin thrown 24 times.
  EXPECT_GE(at_bound, 4);
  EXPECT_LE(at_bound, 20);
}

TEST(Fit, HoldsWhatItIsToldTo) {
  const SimulatedRig rig{.effects = {active("drilling", {2.0})}};
  const auto recorded = record_case(rig, 3);
  const Evidence evidence = evidence_of(recorded, rig);
  const Hypothesis hypothesis(rig.needle, {member("drilling")}, recorded);
  Eigen::VectorXd start = hypothesis.start();
  start[3] = 0.7;
  const Fit held = fit(evidence, hypothesis, start, {.held = {3}});
  EXPECT_EQ(held.values[3], 0.7);
  start[3] = 2.0;
  EXPECT_GT(held.penalised, fit(evidence, hypothesis, start).penalised);
}

TEST(Fit, LeavesOutRecordingsThatAreNotUsed) {
  const SimulatedRig rig;
  const auto recorded = record_case(rig, 3);
  Evidence evidence = evidence_of(recorded, rig);
  evidence.used = {true, false, true, true};
  RecordedCase fewer = recorded;
  fewer.recordings.erase(fewer.recordings.begin() + 1);
  const Fit a = fit_of(evidence, {});
  const Fit b = fit_of(evidence_of(fewer, rig), {});
  EXPECT_EQ(a.values, b.values);
  EXPECT_EQ(a.chi2, b.chi2);
  EXPECT_EQ(a.count(), b.count());
}

}  // namespace
}  // namespace bevel::diagnosis::testing
