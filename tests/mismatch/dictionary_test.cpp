// What effects would look like: promises against full fits, absorption, visible sizes, and what chance brings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "diagnosis/mismatch/addition.hpp"
#include "diagnosis/mismatch/dictionary.hpp"
#include "diagnosis/mismatch/selection.hpp"
#include "tests/mismatch/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

// Tissue that is softer than thought, as an effect: exactly what k stands for.
class Softness final : public model::Effect {
 public:
  explicit Softness(double start)
      : Effect({.name = "softness",
                .meaning = "the curvature is another",
                .covariate = model::Covariate::depth_mm,
                .parameters = {{.name = "ratio", .lower = 0, .upper = 2, .none = 1, .starts = {start}}}}) {}
  void curvature(model::Parameters p, const model::LegView& /*leg*/, model::EffectMemory& /*memory*/,
                 model::Dual2& kappa_per_mm) const override {
    for (auto& k : kappa_per_mm) k = k * p[0];
  }
};

// A case, its base fit and what follows from it, which point to one another.
struct Prepared {
  Prepared(const SimulatedRig& rig, std::uint64_t seed)
      : recorded(record_case(rig, seed)),
        evidence(evidence_of(recorded, rig)),
        base(fit_of(evidence, {})),
        ground(make_ground(evidence, base)) {}
  Prepared(const Prepared&) = delete;
  std::vector<Candidate> dictionary(const std::vector<Member>& members) const {
    return make_dictionary(evidence, base, ground, members, 2);
  }
  RecordedCase recorded;
  Evidence evidence;
  Fit base;
  Ground ground;
};

TEST(Ground, IsOrthogonalToTheNeedlesOwnParameters) {
  const Prepared made({.effects = {active("drilling", {2.0})}, .ar1 = 0.5}, 1);
  const auto& Q = made.ground.Q;
  EXPECT_EQ(Q.cols(), 3);
  EXPECT_LT((Q.transpose() * Q - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_LT((Q.transpose() * made.ground.residual).norm(), 1e-9 * made.ground.residual.norm());
  Workspace workspace;
  for (std::size_t r = 0; r < made.recorded.recordings.size(); ++r) {
    evaluate(made.evidence, made.base.hypothesis, r, made.base.values, true, workspace);
    EXPECT_EQ(made.ground.rows[r + 1] - made.ground.rows[r], workspace.residuals.white.size());
  }
  // The three columns of sensitivities of all recordings lie in Q.
  Eigen::MatrixXd J(Q.rows(), 3);
  for (std::size_t r = 0; r < made.recorded.recordings.size(); ++r) {
    evaluate(made.evidence, made.base.hypothesis, r, made.base.values, true, workspace);
    J.middleRows(made.ground.rows[r], workspace.residuals.white.size()) = workspace.residuals.jacobian;
  }
  EXPECT_LT((J - Q * (Q.transpose() * J)).norm(), 1e-9 * J.norm());
}

TEST(Absorption, OfASignatureOfTheNeedlesOwnIsWhole) {
  const Prepared made({}, 1);
  const Softness softness(0.999);
  const auto dictionary = made.dictionary({{&softness, ~0U}, member("insertion_scale")});
  ASSERT_EQ(dictionary[0].signatures.size(), 1U);
  EXPECT_GT(absorbed_share(dictionary[0]), 0.99999);
  EXPECT_LT(absorbed_share(dictionary[1]), 0.5);
  // What a change of k by 0.1 % does is of some size; what is visible of it is none.
  const Hypothesis hypothesis(made.evidence.belief, {{&softness, ~0U}}, made.recorded);
  Workspace workspace;
  evaluate(made.evidence, hypothesis, 0, hypothesis.start_from(made.base.hypothesis, made.base.values), true,
           workspace);
  EXPECT_LT(visible_per_unit(dictionary[0], 0), 0.01 * workspace.residuals.jacobian.col(3).norm());
}

TEST(Absorption, IsTheShareThatRefittingTheNeedleTakes) {
  // Without noise, of a small effect: chi2 with the needle held, and with it refitted.
  SimulatedRig rig{.effects = {active("insertion_scale", {0.998})}};
  const Eigen::Vector3d sigma_mm = rig.sigma_mm;
  rig.sigma_mm *= 1e-9;
  auto raw = record(rig, 1);
  rig.sigma_mm = sigma_mm;
  const auto recorded = make_case(raw);
  Evidence evidence = evidence_of(recorded, rig);
  evidence.curvature_width_share = evidence.lambda1_width_per_rad = evidence.lambda2_width = 1e6;  // no belief
  const Hypothesis nothing(rig.needle, {}, recorded);
  const Fit held = fit(evidence, nothing, nothing.start(), {.held = {0, 1, 2}});
  const Fit refitted = fit(evidence, nothing, nothing.start(), {.tolerance = 1e-9, .held = {}});
  const auto ground = make_ground(evidence, held);
  const auto dictionary = make_dictionary(evidence, held, ground, {member("insertion_scale")}, 1);
  EXPECT_NEAR(absorbed_share(dictionary[0]), 1 - refitted.chi2 / held.chi2, 0.02);
}

class PromiseOf : public ::testing::TestWithParam<std::pair<std::string, std::vector<double>>> {};

TEST_P(PromiseOf, IsWhatTheFullFitGains) {
  const auto& [name, values] = GetParam();
  const Prepared made({.effects = {active(name, values)}, .ar1 = 0.3}, 5);
  const auto dictionary = made.dictionary({member(name)});
  const auto promises = best_promises(dictionary[0], made.ground, 1);
  ASSERT_EQ(promises.size(), 1U);
  const auto fitted = fit_addition(made.evidence, made.base, dictionary[0], promises);
  ASSERT_TRUE(fitted);
  const double gain = made.base.penalised - fitted->penalised;
  std::cout << name << ": promised " << promises[0].gain << ", gained " << gain << '\n';
  EXPECT_GT(gain, 25);
  EXPECT_NEAR(promises[0].gain, gain, 0.1 * gain + 1);
  for (std::size_t p = 0; p < values.size(); ++p) {
    const double found = fitted->hypothesis.parameter(fitted->values, 0, p);
    const int unknown = fitted->hypothesis.find(0, p);
    const double sd = std::sqrt(fitted->covariance()(unknown, unknown));
    EXPECT_NEAR(promises[0].parameters[p], found, 2 * sd);
    EXPECT_NEAR(found, values[p], 4 * sd);
  }
}
INSTANTIATE_TEST_SUITE_P(SmallEffects, PromiseOf,
                         ::testing::Values(std::pair{std::string("insertion_scale"), std::vector{0.9965}},
                                           std::pair{std::string("camera_scale"), std::vector{1.003}},
                                           std::pair{std::string("camera_rotation"), std::vector{0.005}},
                                           std::pair{std::string("entry_angle"), std::vector{0.002, -0.0012}},
                                           std::pair{std::string("bevel_offset"), std::vector{0.03}},
                                           std::pair{std::string("lateral_bias"), std::vector{0.00004, -0.00004}},
                                           std::pair{std::string("depth_dependence"), std::vector{0.5}},
                                           std::pair{std::string("drilling"), std::vector{0.4}}),
                         [](const auto& of) { return of.param.first; });

TEST(Promise, OfAnEffectThatCannotBeNegativeIsNoneWhereItWouldBe) {
  // The needle bends more where it is turned while inserted: drilling of the wrong sign.
  SimulatedRig rig;
  rig.effects = {active("drilling", {1.5})};
  const Prepared with(rig, 2);
  auto dictionary = with.dictionary({member("drilling")});
  ASSERT_EQ(dictionary[0].signatures.size(), 1U);
  EXPECT_GT(promise_of(dictionary[0], dictionary[0].signatures[0], with.ground, with.ground.residual).gain, 25);
  EXPECT_EQ(promise_of(dictionary[0], dictionary[0].signatures[0], with.ground, -with.ground.residual).gain, 0);
}

// What happens in every recording is no accident: a fit does not begin there.
TEST(Promise, OfInstantsIsOfThreeRecordingsInFour) {
  const SimulatedRig rig{.effects_in =
                             [](int r) {
                               return std::vector{active("lost_steps", {1.0, 0, 1.5 + 0.3 * r})};
                             },
                         .recordings = 4};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  const Fit base = fit_of(evidence, {});
  const Ground ground = make_ground(evidence, base);
  const auto dictionary = make_dictionary(evidence, base, ground, {member("lost_steps", 0b101)}, 2);
  const auto promises = best_promises(dictionary[0], ground, 3);
  ASSERT_FALSE(promises.empty());
  for (const Promise& promise : promises) {
    ASSERT_EQ(promise.local_by_recording.size(), 4U);
    EXPECT_LE(std::count_if(promise.local_by_recording.begin(), promise.local_by_recording.end(),
                            [](double at_s) { return at_s > 0; }),
              3);
  }
  EXPECT_GT(promises.front().gain, 100);
}

TEST(VisiblePerUnit, FiveDeviationsGainTwentyFive) {
  for (const auto& [name, none] : {std::pair{"insertion_scale", 1.0}, {"camera_rotation", 0.0}}) {
    const Prepared clean({.recordings = 3, .ar1 = 0.5}, 1);
    const auto dictionary = clean.dictionary({member(name)});
    const double size = 5 / visible_per_unit(dictionary[0], 0);
    constexpr int kReplicates = 80;
    double sum = 0;
    for (std::uint64_t i = 0; i < kReplicates; ++i) {
      const SimulatedRig rig{.effects = {active(name, {none + size})}, .recordings = 3, .ar1 = 0.5};
      const auto recorded = record_case(rig, 2000 + i);
      const Evidence evidence = evidence_of(recorded, rig);
      sum += fit_of(evidence, {}).penalised - fit_of(evidence, {member(name)}).penalised;
    }
    // Noncentral chi2 of one degree: mean 1 + 25, variance 2 (1 + 2 * 25). 99.9 %, and 5 % for the signature's bend.
    std::cout << name << " of " << size << " gains " << sum / kReplicates << " (seeds 2000 to 2079)\n";
    EXPECT_NEAR(sum / kReplicates, 26, 3.3 * std::sqrt(102.0 / kReplicates) + 1.3) << name;
  }
}

TEST(VisiblePerUnit, OfWhatIsNotExcitedIsNothing) {
  // Straight in, at one speed: no turn, no reversal, no change of speed.
  SimulatedRig rig;
  auto raw = record(rig, 1);
  for (auto& recording : raw)
    for (auto& state : recording.actuators) {
      state.rotation_rad = 0;
      state.insertion_mm = 10e-6 * static_cast<double>(state.utime - recording.actuators.front().utime);
    }
  const auto recorded = make_case(raw);
  const Evidence evidence = evidence_of(recorded, rig);
  const Hypothesis nothing(rig.needle, {}, recorded);
  const Fit base = fit(evidence, nothing, nothing.start());
  const auto ground = make_ground(evidence, base);
  const auto dictionary = make_dictionary(
      evidence, base, ground,
      {member("rotation_backlash"), member("torsional_windup"), member("drilling"), member("bevel_offset")}, 1);
  for (std::size_t e = 0; e < 3; ++e)
    EXPECT_EQ(visible_per_unit(dictionary[e], 0), 0) << dictionary[e].member.effect->name();
  EXPECT_GT(visible_per_unit(dictionary[3], 0), 0);
}

TEST(Chance, ExceedsTheThresholdOnceInAHundred) {
  const Prepared made({.recordings = 4, .frame_s = 0.1}, 1);
  const auto dictionary = made.dictionary(members_of_library({}));
  ASSERT_GT(dictionary.size(), 19U);
  constexpr int kDraws = 1000;
  const NullGains null_gains = bootstrap_null(dictionary, made.ground, kDraws, 17, 2);
  // Other draws, made here.
  std::mt19937_64 random(71);
  std::normal_distribution<double> normal;
  int exceeded = 0;
  std::vector<double> mean(dictionary.size(), 0);
  for (int d = 0; d < kDraws; ++d) {
    Eigen::VectorXd noise(made.ground.residual.size());
    for (double& x : noise) x = normal(random);
    noise -= made.ground.Q * (made.ground.Q.transpose() * noise).eval();
    bool any = false;
    for (std::size_t e = 0; e < dictionary.size(); ++e) {
      double best = 0;
      for (const auto& signature : dictionary[e].signatures)
        best = std::max(best, promise_of(dictionary[e], signature, made.ground, noise).gain);
      any = any || best > null_gains.threshold[e];
      mean[e] += best / kDraws;
    }
    if (any) ++exceeded;
  }
  std::cout << "seeds 17 and 71: exceeded in " << exceeded << " of " << kDraws << '\n';
  // Binomial of both: the threshold is a quantile of 1000 draws itself. Variance 10 + 10; 99.9 %.
  EXPECT_GE(exceeded, 1);
  EXPECT_LE(exceeded, 25);
  for (std::size_t e = 0; e < dictionary.size(); ++e) {
    const auto& parameters = dictionary[e].member.effect->parameters();
    EXPECT_NEAR(mean[e], null_gains.mean[e], 0.15 * null_gains.mean[e] + 0.2) << dictionary[e].member.effect->name();
    // One amplitude of either sign, one start: chi2 of one degree.
    if (parameters.size() == 1 && dictionary[e].signatures.size() == 1 && parameters[0].none > parameters[0].lower) {
      EXPECT_NEAR(null_gains.mean[e], 1, 4 * std::sqrt(2.0 / kDraws)) << dictionary[e].member.effect->name();
    }
  }
}

TEST(Chance, IsThatOfItsSeedWhateverTheThreads) {
  const Prepared made({.recordings = 2, .frame_s = 0.1}, 1);
  const auto dictionary = made.dictionary({member("drilling"), member("layer"), member("lost_steps", 0b101)});
  const auto one = bootstrap_null(dictionary, made.ground, 50, 3, 1);
  const auto two = bootstrap_null(dictionary, made.ground, 50, 3, 2);
  const auto other = bootstrap_null(dictionary, made.ground, 50, 4, 2);
  EXPECT_EQ(one.mean, two.mean);
  EXPECT_EQ(one.threshold, two.threshold);
  EXPECT_NE(one.threshold, other.threshold);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
