// SPDX-License-Identifier: MIT
// The engine on a system that is no needle: it names what is concealed, nothing where there is nothing, and a
// discrepancy where it is on no list.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include <bevel/diagnosis/inference/posterior.hpp>
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

// Whether the noise has heavy tails is asked beside the likeliest set: a knock's readings are none.
TEST(PendulumTest, HeavyTailsAreOfTheNoise) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Found nothing = find({.tail_degrees = 3}, seed);
    EXPECT_EQ(nothing.set, ModelSet{}) << "seed " << seed;
    EXPECT_FALSE(nothing.curve) << "seed " << seed;
    EXPECT_GT(nothing.fit.likelihood->noise().tails.degrees, 0) << "seed " << seed;
  }
  const Found friction = find({.dry_friction = 0.25, .tail_degrees = 3}, 21);
  EXPECT_EQ(friction.set, ModelSet{Pendulum::kDryFriction});
  EXPECT_GT(friction.fit.likelihood->noise().tails.degrees, 0);
  EXPECT_NEAR(friction.fit.shared[2], 0.25, 0.03);
  EXPECT_EQ(find({.knock_rad_s = 0.5}, 31).fit.likelihood->noise().tails.degrees, 0);
}

TEST(PendulumTest, TwoEffects) {
  TruePendulum truth;
  truth.dry_friction = 0.3;
  truth.scale = 1.05;
  EXPECT_EQ(find(truth, 41).set, (ModelSet{Pendulum::kDryFriction, Pendulum::kSensorScale}));
}

TEST(PendulumTest, OnceTheStepsAreSpentOnlyTheLikeliestIsLookedAround) {
  TruePendulum truth;
  truth.dry_friction = 0.3;
  truth.scale = 1.05;
  const Pendulum system(truth, 6, 41);
  struct Looked {
    int around = 0;
    std::size_t at = 0;
  };
  const auto looked = [&](long most_steps, double window) {
    Search search(system, {.window = window, .most_steps = most_steps});
    Looked out;
    search.run(Readings(6), white(), [&](const std::string&) { ++out.around; });
    EXPECT_EQ(search.best().set, (ModelSet{Pendulum::kDryFriction, Pendulum::kSensorScale}));
    out.at = search.visited().size();
    return out;
  };
  constexpr double kWide = 30;
  const long most = SearchRules{}.most_steps;
  const Looked all = looked(most, kWide), few = looked(1, kWide), narrow = looked(1, 0);
  EXPECT_GE(few.around, 1);
  EXPECT_LT(few.around, all.around);
  // Nor is anything fitted but what promises to be the likeliest, however wide the window.
  EXPECT_EQ(few.at, narrow.at);
  EXPECT_LT(few.at, all.at);
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

// Beside nothing a curve is sought, but where one effect is far more than any; what is named is the same.
TEST(PendulumTest, NoCurveIsSoughtWhereOneEffectIsFarMore) {
  const auto sought = [](const TruePendulum& truth, const ModelSet& named) {
    const Pendulum system(truth, 6, 22);
    Search search(system, {});
    search.run(Readings(6), white());
    EXPECT_EQ(search.best().set, named);
    return search.visited().at({}).at->with_discrepancy;
  };
  EXPECT_FALSE(sought({.dry_friction = 0.6}, {Pendulum::kDryFriction}));
  EXPECT_TRUE(sought({.scale = 1.1}, {Pendulum::kSensorScale}));
  EXPECT_TRUE(sought({}, {}));
}

// By the projection itself, in one dense system of all readings and all unknowns, priors as readings of their own.
TEST(PendulumTest, WhatOfACurveNothingElseTakesOverIsTheRestOfAProjection) {
  TruePendulum truth;
  truth.magnet = 1.5;
  const Pendulum system(truth, 6, 51);
  Search search(system, {});
  search.run(Readings(6), white());
  const Fit& fit = *search.visited().at({}).at->fit_with_curve;
  const CurveColumns curve = curve_of(search, fit);
  const Eigen::Index shared = fit.shared.size(), own = static_cast<Eigen::Index>(free_locals(fit.layout).size());
  Eigen::MatrixXd A(0, shared + 6 * own), C(0, fit.curve_values.size());
  for (std::size_t r = 0; r < 6; ++r) {
    LinearRecording one;
    ASSERT_TRUE(linearise(*fit.likelihood, fit, curve, r, one));
    const Eigen::Index before = A.rows();
    A.conservativeResize(before + one.L.rows(), Eigen::NoChange);
    A.bottomRows(one.L.rows()).setZero();
    A.block(before, 0, one.L.rows(), shared) = one.Z.leftCols(shared);
    A.block(before, shared + static_cast<Eigen::Index>(r) * own, one.L.rows(), own) = one.L;
    C.conservativeResize(A.rows(), Eigen::NoChange);
    C.bottomRows(one.L.rows()) = curve.columns[r];
  }
  Eigen::MatrixXd normal = A.transpose() * A;
  normal.topLeftCorner(shared, shared) +=
      pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance).precision.topLeftCorner(shared, shared);
  for (Eigen::Index r = 0; r < 6; ++r)
    normal.diagonal().segment(shared + r * own, own) += local_precision_of(fit.layout, fit.scales);
  const Eigen::MatrixXd across = A.transpose() * C;
  const Eigen::MatrixXd square = C.transpose() * C - across.transpose() * normal.ldlt().solve(across);
  const double rest = fit.curve_values.dot(square * fit.curve_values);
  EXPECT_GT(rest, 25);
  EXPECT_NEAR(visible_sigmas_of_curve(search, fit), std::sqrt(rest), 1e-4 * std::sqrt(rest));
  // What is known of the values says how likely it is that it counts, by draws of them.
  const Eigen::MatrixXd covariance = (square + curve.covariance.inverse()).inverse();
  const Eigen::MatrixXd root = covariance.llt().matrixL();
  std::mt19937_64 random(52);
  std::normal_distribution<double> draw;
  std::vector<double> sizes;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::VectorXd values =
        fit.curve_values + root * Eigen::VectorXd::NullaryExpr(root.rows(), [&] { return draw(random); });
    sizes.push_back(std::sqrt(values.dot(square * values)));
  }
  for (const double from_sigmas : {std::sqrt(rest) - 1, std::sqrt(rest), std::sqrt(rest) + 1}) {
    const auto above = std::ranges::count_if(sizes, [&](double size) { return size > from_sigmas; });
    EXPECT_NEAR(probability_visible(search, *search.visited().at({}).at, from_sigmas),
                static_cast<double>(above) / 20000, 0.015)
        << from_sigmas;
  }
}

TEST(PendulumTest, ProbabilitiesAddUpAndHeldOutIsBetterWithWhatWasFound) {
  TruePendulum truth;
  truth.dry_friction = 0.25;
  const Pendulum system(truth, 6, 21);
  Search search(system, {});
  search.run(Readings(6), white());
  const Posterior posterior = posterior_of(search, 5);
  double sum = 0;
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
    EXPECT_GT(found[r].log_density, leave_out(base, blocks, {}, r)->log_density) << "recording " << r;
}

// The steps are spent before anything is fitted: what was predicted to be likely is fitted after all, as far as it
// holds more of the probability than may be in models that were not.
TEST(PendulumTest, FitsWhatWasLeftForWantOfSteps) {
  const Pendulum system({}, 4, 5);
  const auto searched = [&](long further_steps) {
    auto search = std::make_unique<Search>(system, SearchRules{.most_steps = 0,
                                                               .log_prior_odds_effect = 0.5,
                                                               .most_not_fitted = 0.01,
                                                               .further_steps = further_steps,
                                                               .at_once = 1});
    search->run(Readings(4), white());
    return search;
  };
  const auto none = searched(0), more = searched(5000);
  EXPECT_GT(none->share_not_visited(), none->rules().most_not_fitted);
  EXPECT_LE(more->share_not_visited(), more->rules().most_not_fitted);
  EXPECT_GT(more->visited().size(), none->visited().size());
  double sum = 0;
  for (const SetShare& one : posterior_of(*none, 3).sets) sum += one.probability;
  EXPECT_NEAR(sum, 1, 1e-9) << "of the fitted models";
}

// Measurements that ask for a size beyond the bound at which the effect vanishes: no start can be evaluated, and its
// log Bayes factor is minus infinity.
TEST(PendulumTest, WhatCannotBeEvaluatedHasNoPrediction) {
  constexpr double kNever = -std::numeric_limits<double>::infinity();
  bool found = false;
  for (std::uint64_t seed = 1; seed <= 6 && !found; ++seed) {
    const Pendulum system({}, 4, seed);
    Search search(system, {});
    search.run(Readings(4), white());
    const auto beside = search.proposals().beside(search.base_marginal(), 1);
    for (const Proposal& one : beside) {
      if (one.effect != Pendulum::kDryFriction) continue;
      found = found || one.log_bayes_factor == kNever;
      EXPECT_TRUE(one.log_bayes_factor == kNever || one.log_bayes_factor > -100) << one.log_bayes_factor;
    }
  }
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace bevel::inference
