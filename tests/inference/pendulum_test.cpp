// The engine on a system that is no needle: it names what is concealed, nothing where there is nothing, and a
// discrepancy where it is on no list.
#include <gtest/gtest.h>

#include "diagnosis/inference/posterior.hpp"
#include "tests/inference/pendulum.hpp"

namespace bevel::inference {
namespace {

using testing::Pendulum;
using testing::TruePendulum;

Noise white() {
  Noise noise;
  noise.sigma = {Pendulum::kSigma_rad};
  noise.frame_s = Pendulum::kFrame_s;
  return noise;
}

struct Found {
  ModelSet set;
  bool curve = false;
  double log_curve = 0;  // log odds of a discrepancy beside that set
  Fit fit;
};

Found find(const TruePendulum& truth, std::uint64_t seed) {
  const Pendulum system(truth, 6, seed);
  Search search(system, {});
  search.run(Readings(6), white());
  const Visited& best = search.best();
  const bool curve = best.log_with_curve > best.log_without_curve;
  return {best.set, curve, best.log_with_curve - best.log_without_curve,
          curve ? *best.at->fit_with_curve : best.at->fit};
}

TEST(PendulumTest, NothingIsMissing) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Found found = find({}, seed);
    EXPECT_EQ(found.set, ModelSet{}) << "seed " << seed;
    EXPECT_FALSE(found.curve) << "seed " << seed;
    EXPECT_NEAR(found.fit.shared[0], 0.5, 0.005);
  }
}

TEST(PendulumTest, OneEffectIsNamedWithItsSize) {
  TruePendulum truth;
  truth.dry_friction = 0.25;
  const Found friction = find(truth, 21);
  EXPECT_EQ(friction.set, ModelSet{Pendulum::kDryFriction});
  EXPECT_FALSE(friction.curve);
  EXPECT_NEAR(friction.fit.shared[2], 0.25, 0.03);
  truth = {};
  truth.scale = 1.06;
  const Found scale = find(truth, 22);
  EXPECT_EQ(scale.set, ModelSet{Pendulum::kSensorScale});
  EXPECT_NEAR(scale.fit.shared[2], 1.06, 0.01);
}

TEST(PendulumTest, AKnockIsFoundInTheRecordingsThatHaveIt) {
  TruePendulum truth;
  truth.knock_rad_s = 0.5;
  const Found found = find(truth, 31);
  EXPECT_EQ(found.set, ModelSet{Pendulum::kKnock});
  EXPECT_NEAR(found.fit.shared[2], 0.5, 0.05);
  for (std::size_t r = 0; r < 6; ++r) {
    const double at_s = found.fit.local[r][1];
    if (r % 3 == 1)
      EXPECT_NEAR(at_s, 2.3 + 0.4 * static_cast<double>(r), 0.1) << "recording " << r;
    else
      EXPECT_EQ(at_s, 0) << "recording " << r;
  }
}

TEST(PendulumTest, TwoEffects) {
  TruePendulum truth;
  truth.dry_friction = 0.3;
  truth.scale = 1.05;
  EXPECT_EQ(find(truth, 41).set, (ModelSet{Pendulum::kDryFriction, Pendulum::kSensorScale}));
}

TEST(PendulumTest, WhatIsOnNoListIsADiscrepancy) {
  TruePendulum truth;
  truth.magnet = 1.5;
  const Found found = find(truth, 51);
  EXPECT_TRUE(found.curve);
  EXPECT_GT(found.log_curve, 20);
  // At the magnet, 0.4 rad, it stands out from what is beside it: 0.3 rad against 0 and 0.6. (The far ends of the
  // swing are hardly visited, and the length takes its share.)
  ASSERT_EQ(found.fit.curve_values.size(), 9);
  EXPECT_GT(found.fit.curve_values[5], found.fit.curve_values[4] + 0.4) << found.fit.curve_values.transpose();
  EXPECT_GT(found.fit.curve_values[5], found.fit.curve_values[6] + 0.4) << found.fit.curve_values.transpose();
}

TEST(PendulumTest, ProbabilitiesAddUpAndHeldOutIsBetterWithWhatWasFound) {
  TruePendulum truth;
  truth.dry_friction = 0.25;
  const Pendulum system(truth, 6, 21);
  Search search(system, {});
  search.run(Readings(6), white());
  const Posterior posterior = posterior_of(search, 5);
  double sum = posterior.not_visited;
  for (const auto& one : posterior.sets) {
    sum += one.probability;
    EXPECT_LE(one.with_discrepancy, one.probability + 1e-12);
  }
  EXPECT_NEAR(sum, 1, 1e-9);
  EXPECT_GT(posterior.inclusion.at("dry_friction"), 0.5);
  for (const auto& [name, probability] : posterior.inclusion)
    if (name != "dry_friction") {
      EXPECT_LT(probability, 0.5) << name;
    }
  EXPECT_GT(posterior.inclusion.at("dry_friction"), 0.9);
  EXPECT_LT(posterior.discrepancy, 0.5);
  const auto found = leave_out_selection(search);
  ASSERT_EQ(found.size(), 6U);
  // Each recording is likelier than by the base alone at its likeliest noise.
  const Fit& base = search.visited().at({}).at->fit;
  const auto blocks = linearise(*base.likelihood, base, {});
  for (std::size_t r = 0; r < 6; ++r)
    EXPECT_GT(found[r].log_density, leave_out(base, blocks, {}, r).log_density) << "recording " << r;
}

}  // namespace
}  // namespace bevel::inference
