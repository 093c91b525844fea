// SPDX-License-Identifier: MIT
// What some recordings share looks like recordings that differ, until it has a name; and what recordings differ by
// looks like noise, until they may.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include <bevel/diagnosis/inference/search.hpp>
#include <bevel/diagnosis/inference/settle.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// y = level + level_r + (slope_r + size g_r + of_pairs p_r) x + wave w(x) + white noise: g_r is -1 in one half of the
// recordings and 1 in the other, p_r in pairs of them, slope_r and level_r each recording's own, normal about zero; w a
// triangle that goes up to 1 and down to -1. What sets the halves apart is an effect's, or a curve's of the slope over
// g; that of the pairs a curve's over p, and the wave one's of the level over x.
class HalvesDiffer final : public testing::HeldSystem {
 public:
  static constexpr Index kReadings = 60;
  static constexpr double kSigma = 0.005;
  static double x(Index i) { return static_cast<double>(i) / (kReadings - 1); }
  static double hat(Index i, double at) { return std::max(0.0, 1 - std::abs(x(i) - at) / 0.25); }

  struct Truth {
    double size = 0, slope_sd = 0;
    double tail_degrees = 0;  // of Student's t, of the same standard deviation; 0: normal noise
    double level_sd = 0;      // 0: nor may they differ in it
    double wave = 0;          // 0: nor is there a curve of it
    double of_pairs = 0;      // the same
    bool mixed = false;       // whether there is a curve over what is nearly the mean of both
  };
  HalvesDiffer(std::size_t recordings, const Truth& truth, unsigned seed) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = 1;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (std::size_t r = 0; r < recordings; ++r) {
      std::vector<double> measured;
      const double slope = truth.slope_sd * normal(random) + truth.size * half_of(r) + truth.of_pairs * pair_of(r);
      const double level = truth.level_sd > 0 ? truth.level_sd * normal(random) : 0;
      for (Index i = 0; i < kReadings; ++i)
        measured.push_back(level + slope * x(i) + truth.wave * (hat(i, 0.25) - hat(i, 0.75)) +
                           kSigma * testing::draw_noise(random, normal, truth.tail_degrees));
      add_recording(measured, data_.frame_s);
    }
    base_ = {{.name = "level", .lower = -9, .upper = 9, .none = 0, .starts = {}, .prior = normal_prior(0, 1)}};
    effects_ = {
        {.name = "halves",
         .label = "halves",
         .parameters = {
             {.name = "size", .lower = -20, .upper = 20, .none = 0, .starts = {0.5}, .prior = normal_prior(0, 5)}}}};
    curves_ = {{.component = "slope", .unit = "1", .covariate = "half", .at = {-1, 0, 1}}};
    nuisances_ = {{"slope", 0}};
    groups_ = {{"slope", "1", {0, 0.03, 0.1, 0.3}}};
    if (truth.wave != 0)
      curves_.push_back({.component = "level", .unit = "1", .covariate = "x", .at = {0, 0.25, 0.5, 0.75, 1}});
    if (truth.of_pairs != 0)
      curves_.push_back({.component = "slope", .unit = "1", .covariate = "pair", .at = {-1, 0, 1}});
    if (truth.mixed) curves_.push_back({.component = "slope", .unit = "1", .covariate = "mixed", .at = {-1, 0, 1}});
    if (truth.level_sd == 0) return;
    nuisances_.push_back({"level", 1});
    groups_.push_back({"level", "1", {0, 0.1, 1}});
  }
  bool predict(const ModelSet& set, std::size_t r, const VectorXd& shared, const VectorXd& local, bool derivatives,
               Prediction& out) const override {
    VectorXd along(kReadings);
    for (Index i = 0; i < kReadings; ++i) along[i] = x(i);
    const double slope = local[0] + (set.empty() ? 0 : half_of(r) * shared[1]);
    const bool levels = local.size() > 1;
    out.reading = VectorXd::Constant(kReadings, shared[0] + (levels ? local[1] : 0)) + slope * along;
    if (!derivatives) return true;
    out.by_shared = MatrixXd::Ones(kReadings, shared.size());
    if (!set.empty()) out.by_shared.col(1) = half_of(r) * along;
    out.by_local = MatrixXd::Ones(kReadings, local.size());
    out.by_local.col(0) = along;
    return true;
  }
  MatrixXd by_curves(std::size_t r, const VectorXd&) const override {
    Index columns = 0;
    for (const Curve& curve : curves_) columns += static_cast<Index>(curve.at.size());
    MatrixXd out = MatrixXd::Zero(kReadings, columns);
    Index column = 0;
    for (const Curve& curve : curves_)
      for (const double at : curve.at) {
        const bool here = at == (curve.covariate == "half"   ? half_of(r)
                                 : curve.covariate == "pair" ? pair_of(r)
                                                             : mixed_of(r));
        for (Index i = 0; i < kReadings; ++i) out(i, column) = curve.covariate == "x" ? hat(i, at) : here ? x(i) : 0;
        ++column;
      }
    return out;
  }

 private:
  static double half_of(std::size_t r) { return r % 2 == 0 ? -1 : 1; }
  static double pair_of(std::size_t r) { return r / 2 % 2 == 0 ? -1 : 1; }
  static double mixed_of(std::size_t r) { return r == 3 ? 0 : 0.5 * (half_of(r) + pair_of(r)); }
};

constexpr double kNever = -std::numeric_limits<double>::infinity();

Noise white() {
  Noise noise;
  noise.sigma = {HalvesDiffer::kSigma};
  noise.frame_s = 1;
  return noise;
}

Search searched(const HalvesDiffer& system) {
  Search search(system, {.threads = 1});
  search.run(Readings(system.data().recordings.size()), white());
  return search;
}

TEST(HiddenInSpread, AnEffectIsLookedForWhereRecordingsDoNotDifferToo) {
  constexpr std::size_t kRecordings = 6;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const HalvesDiffer system(kRecordings, {.size = 0.1}, seed);
    const Search search = searched(system);
    const Visited& nothing = search.visited().at({});
    EXPECT_GT(nothing.at->fit.scales.nuisance_sd[0], 0);  // it passes for spread
    // Beside that spread it is not worth its prior odds.
    const Fit& fit = nothing.at->fit;
    const auto beside = search.proposals().beside(Marginal(*fit.likelihood, fit, {}), 1);
    ASSERT_EQ(beside.size(), 1U);
    EXPECT_LT(beside.front().log_bayes_factor, -search.log_prior_odds(0) - search.rules().window);
    EXPECT_EQ(search.best().set, ModelSet{0});
    EXPECT_EQ(search.best().at->fit.scales.nuisance_sd[0], 0);
  }
}

TEST(HiddenInSpread, ASetIsNotGivenUpWhileTheNoiseHoldsWhatRecordingsDifferBy) {
  constexpr std::size_t kRecordings = 6;
  int from_none = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const HalvesDiffer system(kRecordings, {.slope_sd = 0.1}, seed);
    const Likelihood likelihood(system, Readings(kRecordings), white());
    const Layout layout(system, {});
    const std::vector<VectorXd> local(kRecordings, layout.local_start());
    const auto evaluated = [&](const VectorXd& begins, double give_up_below) {
      return evaluate(likelihood, layout, layout.shared_start(), local, begins, give_up_below);
    };
    EXPECT_GT(evaluated(middle_nuisance_sd(system), kNever).fit.scales.nuisance_sd[0], 0);
    const Evaluated whole = evaluated(VectorXd::Zero(1), kNever);
    ASSERT_TRUE(whole.valid);
    // From no spread the noise may keep it for good: where a search begins is the middle.
    if (whole.fit.scales.nuisance_sd[0] == 0) continue;
    ++from_none;
    // As far below the likeliest as a search gives up; the noise to begin with is not quite the likeliest.
    constexpr double kDoubt = 12;
    EXPECT_NEAR(evaluated(VectorXd::Zero(1), whole.log_evidence - kDoubt).log_evidence, whole.log_evidence, 1e-6);
  }
  EXPECT_GE(from_none, 8);
}

// What passes for spread leaves some of it behind when it gets its name: beside none of it the effect promises too
// little.
void expect_effects_found(const HalvesDiffer::Truth& truth) {
  constexpr std::size_t kRecordings = 8;
  int likely = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const HalvesDiffer system(kRecordings, truth, seed);
    const Search search = searched(system);
    const Fit begin = carried_to(Layout(system, {0}), search.visited().at({}).at->fit);
    Evaluated there = evaluate(search.likelihood(), begin.layout, begin.shared, begin.local, begin.scales.nuisance_sd);
    ASSERT_TRUE(there.valid);
    add_discrepancy(search.likelihood(), search.discrepancy(), search.curve_rules(), there);
    const auto by_itself = std::make_shared<const Evaluated>(std::move(there));
    const double log_posterior = search.weighed({0}, search.log_prior({0}), by_itself).log_posterior();
    if (log_posterior < search.best().log_posterior() - search.rules().window) continue;
    ++likely;
    const auto found = search.visited().find({0});
    EXPECT_GT(found == search.visited().end() ? kNever : found->second.log_posterior(),
              log_posterior - search.rules().optimism);
  }
  EXPECT_GE(likely, 10);
}

TEST(HiddenInSpread, NoEffectThatByItselfIsLikelyIsLeftOut) {
  expect_effects_found({.size = 0.08, .slope_sd = 0.03, .tail_degrees = 4});
}

TEST(HiddenInSpread, NorIsOneThatIsLikelyBesideACurve) {
  expect_effects_found({.size = 0.08, .slope_sd = 0.03, .tail_degrees = 4, .wave = 0.02});
}

// With two curves nothing is left of it, and without any it is small beside what is.
TEST(HiddenInSpread, AnEffectIsLookedForInACurvesPlace) {
  expect_effects_found({.size = 0.3, .wave = 0.004});
  expect_effects_found({.size = 0.3, .slope_sd = 0.03, .wave = 0.01});
  expect_effects_found({.size = 1, .wave = 0.03});
}

TEST(HiddenInSpread, NorIsOneThatIsLikelyBesideTwoCurvesOnly) {
  expect_effects_found({.size = 0.2, .slope_sd = 0.03, .wave = 0.1, .of_pairs = 2});
}

// The likeliest curve of the slope by itself, from every spread, brings no more log evidence than what was found says;
// beside the wave's curve, where there is one.
void expect_curves_found(const HalvesDiffer::Truth& truth) {
  constexpr std::size_t kRecordings = 8;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const HalvesDiffer system(kRecordings, truth, seed);
    const Search search = searched(system);
    const Evaluated& nothing = *search.visited().at({}).at;
    std::vector<CurvePrior> beside;
    const Fit* fit = &nothing.fit;
    if (truth.wave != 0) {
      ASSERT_TRUE(nothing.fit_with_curve);
      fit = &*nothing.fit_with_curve;
      beside = {fit->scales.curves.front()};
      ASSERT_EQ(beside.front().curve, 1U);
    }
    const auto settled = [&](double sd, const std::vector<CurvePrior>& curves) {
      VectorXd from = fit->scales.nuisance_sd;
      from[0] = sd;
      return settle(search.likelihood(), &search.discrepancy(), fit->layout, fit->shared, fit->local,
                    {.nuisance_sd = from, .curves = curves}, nuisance_grid(system), kNever)
          .over.log_mean;
    };
    const auto curves = search.discrepancy().scan(Marginal(search.likelihood(), nothing.fit, {}));
    ASSERT_FALSE(curves.empty());
    double most = kNever, before = nothing.log_evidence;
    for (const double sd : system.nuisance_groups()[0].standard_deviations) {
      if (!beside.empty()) before = std::max(before, settled(sd, beside));
      for (const CurveFactor& one : curves) {
        auto with_one = beside;
        with_one.push_back(one.prior);
        if (one.prior.curve == 0) most = std::max(most, settled(sd, with_one));
      }
    }
    EXPECT_GT(most - before, 5);
    ASSERT_EQ(nothing.log_factors.size(), beside.size() + 1);
    // Of all its scales and lengths one is the likeliest.
    EXPECT_GT(nothing.log_factors.back(), most - before - std::log(static_cast<double>(curves.size())));
  }
}

// The curve stands out only beside less spread than there is; fitted from no spread, its noise would keep what is left.
TEST(HiddenInSpread, ACurveIsFittedWhereNoiseWouldKeepTheSpread) {
  expect_curves_found({.size = 0.2, .slope_sd = 0.03, .tail_degrees = 4});
}

// In the one way recordings do differ, in the other they seem to.
TEST(HiddenInSpread, ACurveIsLookedForBesideLessSpreadOfOneKind) {
  expect_curves_found({.size = 0.2, .slope_sd = 0.03, .level_sd = 0.1});
}

TEST(HiddenInSpread, NorIsACurveBesideAnotherLeftOut) {
  expect_curves_found({.size = 0.2, .slope_sd = 0.03, .tail_degrees = 4, .wave = 0.02});
}

// By itself the curve over the mixture is likeliest; together the two that there are, without it.
TEST(HiddenInSpread, TheLikeliestPairOfCurvesNeedNotBeginWithTheLikeliest) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const HalvesDiffer system(24, {.size = 0.36, .of_pairs = 0.24, .mixed = true}, seed);
    const Search search = searched(system);
    const Evaluated& nothing = *search.visited().at({}).at;
    EXPECT_EQ(nothing.curves.front().prior.curve, 2U);
    ASSERT_TRUE(nothing.fit_with_curve);
    const auto& curves = nothing.fit_with_curve->scales.curves;
    ASSERT_EQ(curves.size(), 2U);
    EXPECT_EQ(std::max(curves[0].curve, curves[1].curve), 1U);
    // What is added up is the evidence of these two, and of their scales and lengths.
    const double all = std::log(static_cast<double>(search.discrepancy().choices()));
    const double gain = nothing.log_factors[0] + nothing.log_factors[1];
    const Fit& fit = *nothing.fit_with_curve;
    const Settled both = settle(search.likelihood(), &search.discrepancy(), fit.layout, fit.shared, fit.local,
                                fit.scales, nuisance_grid(system), kNever);
    EXPECT_LE(gain, both.over.log_mean - nothing.log_evidence + 0.1);
    EXPECT_GE(gain, both.over.log_mean - nothing.log_evidence - 2 * all);
  }
}

// The wave is bounded, and passes for normal noise until it has a curve.
TEST(HiddenInSpread, TailsThatASetHidesAreFoundBesideItsCurve) {
  int hidden = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const HalvesDiffer system(8, {.slope_sd = 0.03, .tail_degrees = 4, .wave = 0.05}, seed);
    const Search search = searched(system);
    const Evaluated& nothing = *search.visited().at({}).at;
    ASSERT_TRUE(nothing.fit_with_curve);
    EXPECT_GT(nothing.fit_with_curve->likelihood->noise().tails.degrees, 0);
    if (nothing.fit.likelihood->noise().tails.degrees == 0) ++hidden;
  }
  EXPECT_GE(hidden, 10);
}

}  // namespace
}  // namespace bevel::inference
