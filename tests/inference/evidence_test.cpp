// SPDX-License-Identifier: MIT
// The evidence against closed forms: of a model linear in everything it is a normal density of all readings together.
#include <gtest/gtest.h>

#include <Eigen/QR>

#include <bevel/diagnosis/inference/error_spread.hpp>
#include <bevel/diagnosis/inference/evidence.hpp>
#include <bevel/diagnosis/inference/log_sum.hpp>
#include <bevel/diagnosis/inference/posterior.hpp>
#include <bevel/diagnosis/inference/proposals.hpp>
#include "tests/inference/linear_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::all_readings;
using testing::covariance_of;
using testing::LinearSystem;
using testing::log_normal;
using testing::white;

Evaluated evaluate_set(const LinearSystem& system, const ModelSet& set, const Discrepancy* discrepancy = nullptr) {
  const Likelihood likelihood(system, Readings(system.data().recordings.size()), white(system));
  const Layout layout(system, set);
  const std::vector<VectorXd> local(system.data().recordings.size(), layout.local_start());
  Evaluated out = evaluate(likelihood, layout, layout.shared_start(), local, VectorXd::Constant(1, 0.2));
  if (discrepancy) add_discrepancy(likelihood, *discrepancy, {.log_prior_odds = -4, .log_prior_odds_more = -4}, out);
  return out;
}

// Of a grid of two: recordings do not differ at all with one half, else each of the two is as likely.
constexpr double kNone = 0.75;

TEST(Evidence, OfALinearModelIsTheNormalDensityOfAllReadings) {
  for (const double nuisance_sd : {0.0, 0.2})
    for (const ModelSet& set : {ModelSet{}, ModelSet{0}, ModelSet{0, 1}}) {
      const LinearSystem system(4, 7, 0.3, nuisance_sd, 0);
      const Evaluated at = evaluate_set(system, set);
      ASSERT_TRUE(at.valid);
      const Noise& noise = at.fit.likelihood->noise();
      const VectorXd y = all_readings(system);
      const double none = log_normal(y, covariance_of(system, set, noise, 0.0)) + std::log(kNone);
      const double some = log_normal(y, covariance_of(system, set, noise, 0.2)) + std::log(1 - kNone);
      // Over the grid of two; what lies elsewhere counts for no more than the best.
      EXPECT_NEAR(at.log_evidence, std::max(none, some) + std::log1p(std::exp(-std::abs(none - some))),
                  0.01)  // what a fit leaves to gain
          << describe(system, set) << ", nuisance " << nuisance_sd;
      if (!set.empty()) {
        EXPECT_EQ(at.fit.scales.nuisance_sd[0] > 0, nuisance_sd > 0);
      }
    }
}

TEST(Evidence, TheNoiseIsTheLikeliest) {
  const LinearSystem system(6, 11, 0, 0.2, 0);
  const Evaluated at = evaluate_set(system, {});
  const Noise& noise = at.fit.likelihood->noise();
  const VectorXd y = all_readings(system);
  const auto log_at = [&](double share, double further) {
    Noise other = noise;
    other.sigma[0] *= share;
    other.ar1 += further;
    return log_normal(y, covariance_of(system, {}, other, 0.2));
  };
  // Found from what the mode leaves: short of the readings' own degrees of freedom, 8 of 360.
  EXPECT_GT(log_at(1, 0), log_at(0.93, 0));
  EXPECT_GT(log_at(1, 0), log_at(1.07, 0));
  EXPECT_GT(log_at(1, 0), log_at(1, 0.12));
}

TEST(Evidence, OfADiscrepancyIsTheRatioOfTwoNormalDensities) {
  const LinearSystem system(4, 3, 0, 0.2, 0.4);
  const Likelihood likelihood(system, Readings(4), white(system));
  const Layout layout(system, {});
  const std::vector<VectorXd> local(4, layout.local_start());
  Fit base =
      fit(likelihood, layout, layout.shared_start(), local, {.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}});
  base.likelihood = std::make_shared<const Likelihood>(likelihood);
  const Discrepancy discrepancy(likelihood, base);
  const auto factors = discrepancy.scan(Marginal(likelihood, base, {}));
  ASSERT_EQ(factors.size(), discrepancy.choices());
  const VectorXd y = all_readings(system);
  const double without = log_normal(y, covariance_of(system, {}, white(system), 0.2));
  for (const CurveFactor& one : factors) {
    const MatrixXd covariance = discrepancy.columns(likelihood, {&one.prior, 1}).covariance;
    const double with = log_normal(y, covariance_of(system, {}, white(system), 0.2, covariance));
    EXPECT_NEAR(one.log_bayes_factor, with - without, 1e-3 * std::abs(with - without) + 0.02)  // in float
        << "scale " << one.prior.scale << ", length " << one.prior.length;
  }
  EXPECT_GT(factors.front().log_bayes_factor, 5);  // a bump of 4 sigma, 0.7 s wide
  for (std::size_t i = 1; i < factors.size(); ++i)
    EXPECT_GE(factors[i - 1].log_bayes_factor, factors[i].log_bayes_factor);
}

TEST(Evidence, ADiscrepancyScaleIsTheSizeOfItsVisiblePart) {
  const LinearSystem system(4, 3, 0, 0.2, 0.4);
  const Likelihood likelihood(system, Readings(4), white(system));
  const Layout layout(system, {});
  const std::vector<VectorXd> local(4, layout.local_start());
  const Fit base =
      fit(likelihood, layout, layout.shared_start(), local, {.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}});
  const Discrepancy discrepancy(likelihood, base);
  // Drawn from the prior of scale 2: in the mean twice the noise, squared.
  const CurvePrior prior{.curve = 0, .scale = 2, .length = 0.2};
  const MatrixXd root = discrepancy.columns(likelihood, {&prior, 1}).covariance.llt().matrixL();
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  double square = 0;
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    const VectorXd values = root * VectorXd::NullaryExpr(6, [&] { return normal(random); });
    square += std::pow(discrepancy.visible_size({&prior, 1}, values), 2) / kDraws;
  }
  EXPECT_NEAR(square, 4, 0.2);
}

TEST(Evidence, ACurveOfWhichTheBaseAbsorbsAllButRoundingSaysNothing) {
  LinearSystem system(4, 3, 0, 0.2, 0.4);
  const auto scan_of = [](const LinearSystem& seen) {
    const Likelihood likelihood(seen, Readings(4), white(seen));
    const Layout layout(seen, {});
    const std::vector<VectorXd> local(4, layout.local_start());
    const Fit base = fit(likelihood, layout, layout.shared_start(), local,
                         {.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}});
    const Discrepancy discrepancy(likelihood, base);
    return discrepancy.scan(Marginal(likelihood, base, {}));
  };
  const auto alone = scan_of(system);
  system.add_still_curve();
  std::vector<CurveFactor> moving;
  for (const CurveFactor& one : scan_of(system)) {
    if (one.prior.curve == 0) {
      moving.push_back(one);
      continue;
    }
    EXPECT_EQ(one.log_bayes_factor, 0) << "scale " << one.prior.scale << ", length " << one.prior.length;
    EXPECT_EQ(one.visible.mean(), 0);
  }
  ASSERT_EQ(moving.size(), alone.size());
  for (std::size_t i = 0; i < alone.size(); ++i)
    EXPECT_NEAR(moving[i].log_bayes_factor, alone[i].log_bayes_factor, 1e-6);
}

// Two curves: a parabola in time, and a wave along a sawtooth.
struct TwoCurves {
  LinearSystem system{4, 3, 1.5, 0.2, 0, 0.5};
  Likelihood likelihood{system, Readings(4), white(system)};
  Evaluated at = evaluate_set(system, {});
  Discrepancy discrepancy{likelihood, at.fit};

  // Of both curves' values, at their places among all: zero where a curve is not among these.
  MatrixXd covariance(const std::vector<CurvePrior>& curves) const {
    MatrixXd out = MatrixXd::Zero(12, 12);
    for (const CurvePrior& one : curves) {
      const auto first = static_cast<Index>(6 * one.curve);
      out.block(first, first, 6, 6) += discrepancy.columns(likelihood, {&one, 1}).covariance;
    }
    return out;
  }
  // Of all readings, over the standard deviations of what differs.
  double log_evidence(const Noise& noise, const std::vector<CurvePrior>& curves) const {
    std::vector<double> logs;
    for (const double sd : {0.0, 0.2})
      logs.push_back(log_normal(all_readings(system), covariance_of(system, {}, noise, sd, covariance(curves))) +
                     std::log(sd == 0 ? kNone : 1 - kNone));
    return log_sum(logs);
  }
};

TEST(TwoCurves, TheNextIsWeighedBesideTheFirstAsTwoNormalDensitiesSay) {
  const TwoCurves made;
  const CurvePrior first{.curve = 0, .scale = 2, .length = 0.2};
  Scales scales{.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {first}};
  const Layout layout(made.system, {});
  const auto columns = made.discrepancy.columns(made.likelihood, scales.curves);
  const Fit beside = fit(made.likelihood, layout, layout.shared_start(), std::vector<VectorXd>(4, layout.local_start()),
                         scales, columns);
  const VectorXd y = all_readings(made.system);
  const auto log_density = [&](const std::vector<CurvePrior>& curves) {
    return log_normal(y, covariance_of(made.system, {}, white(made.system), 0.2, made.covariance(curves)));
  };
  const double without = log_density({first});
  const auto factors = made.discrepancy.scan(Marginal(made.likelihood, beside, columns));
  ASSERT_EQ(factors.size(), made.discrepancy.choices());
  for (const CurveFactor& one : factors) {
    const double expected = log_density({first, one.prior}) - without;
    EXPECT_NEAR(one.log_bayes_factor, expected, 1e-3 * std::abs(expected) + 0.02)
        << "curve " << one.prior.curve << ", scale " << one.prior.scale << ", length " << one.prior.length;
  }
  EXPECT_EQ(factors.front().prior.curve, 1U);
}

TEST(TwoCurves, AreAddedOneAfterTheOtherByTheRatiosOfNormalDensities) {
  const TwoCurves made;
  Evaluated one = evaluate_set(made.system, {}), both = one;
  add_discrepancy(made.likelihood, made.discrepancy, {.log_prior_odds = -4, .log_prior_odds_more = -4, .most = 1}, one);
  add_discrepancy(made.likelihood, made.discrepancy, {.log_prior_odds = -4, .log_prior_odds_more = -4, .most = 2},
                  both);
  ASSERT_EQ(one.log_factors.size(), 1U);
  ASSERT_EQ(both.log_factors.size(), 2U);
  // What a first is worth does not depend on whether there may be a second.
  EXPECT_EQ(both.log_factors[0], one.log_factors[0]);
  EXPECT_EQ(one.log_bayes_factor_curve, one.log_factors[0]);
  const auto& curves = both.fit_with_curve->scales.curves;
  ASSERT_EQ(curves.size(), 2U);
  EXPECT_EQ(curves[0], one.fit_with_curve->scales.curves[0]);
  EXPECT_NE(curves[0].curve, curves[1].curve);
  // Which scale and length the second has is integrated over by the linear model, relative to the likeliest.
  std::vector<double> logs;
  const auto beside = made.discrepancy.columns(made.likelihood, one.fit_with_curve->scales.curves);
  for (const CurveFactor& other : made.discrepancy.scan(Marginal(made.likelihood, *one.fit_with_curve, beside)))
    if (other.prior.curve == curves[1].curve) logs.push_back(other.log_bayes_factor);
  const double spread = log_sum(logs) - logs.front() - std::log(static_cast<double>(logs.size()));
  const double expected = made.log_evidence(both.fit_with_curve->likelihood->noise(), curves) -
                          made.log_evidence(one.fit_with_curve->likelihood->noise(), {curves[0]}) + spread;
  EXPECT_GT(expected, 20);
  EXPECT_NEAR(both.log_factors[1], expected, 0.05);
  // Over the number of curves, by their prior odds.
  EXPECT_NEAR(both.log_bayes_factor_curve, both.log_factors[0] + std::log1p(std::exp(both.log_factors[1] - 4)), 1e-9);
  // The values are those of generalised least squares.
  const MatrixXd K = made.covariance(curves), C = made.system.by_curves(0, {});
  const VectorXd y = all_readings(made.system);
  const Fit& fit = *both.fit_with_curve;
  MatrixXd all(y.size(), 12);
  for (Index r = 0; r < 4; ++r) all.middleRows(r * LinearSystem::kCount, LinearSystem::kCount) = C;
  const VectorXd values =
      K * all.transpose() *
      covariance_of(made.system, {}, fit.likelihood->noise(), fit.scales.nuisance_sd[0], K).lu().solve(y);
  const auto places = made.discrepancy.places(curves);
  VectorXd off = fit.curve_values;
  for (std::size_t i = 0; i < 2; ++i)
    off.segment(places[i], 6) -= values.segment(6 * static_cast<Index>(curves[i].curve), 6);
  // Constants of both and the offset are one: to what can be seen of them, in standard deviations.
  EXPECT_LT(made.discrepancy.visible_size(curves, off), 0.05);
  EXPECT_GT(made.discrepancy.visible_size(curves, fit.curve_values), 1);
}

TEST(TwoCurves, WhereOneIsEnoughThereIsOne) {
  for (const std::uint64_t seed : {3U, 4U, 5U, 6U, 7U}) {
    // Hardly anything depends on the sawtooth: the curve is there to be chosen.
    const LinearSystem system(4, seed, 0, 0.2, 0.4, 1e-6);
    const Likelihood likelihood(system, Readings(4), white(system));
    Evaluated at = evaluate_set(system, {});
    const Discrepancy discrepancy(likelihood, at.fit);
    add_discrepancy(likelihood, discrepancy, {.log_prior_odds = -4, .log_prior_odds_more = -4}, at);
    ASSERT_TRUE(at.fit_with_curve.has_value()) << "seed " << seed;
    EXPECT_EQ(at.fit_with_curve->scales.curves.size(), 1U) << "seed " << seed;
    EXPECT_EQ(at.log_bayes_factor_curve, at.log_factors[0]);
  }
}

TEST(TwoCurves, TheVisibleSizeIsThatOfTheirSum) {
  const TwoCurves made;
  const std::vector<CurvePrior> curves = {{.curve = 1, .scale = 2, .length = 0.2},
                                          {.curve = 0, .scale = 1, .length = 1}};
  VectorXd values(12);
  values << 0.3, -0.1, 0.2, 0.5, -0.4, 0.1, 1, 0.6, -0.2, -0.5, 0.1, 0.4;
  VectorXd in_order(12);  // as the columns are
  in_order << values.tail(6), values.head(6);
  const VectorXd sum = made.system.by_curves(0, {}) * in_order / made.system.sigma;
  const MatrixXd X = LinearSystem::design({});
  const VectorXd left = sum - X * X.colPivHouseholderQr().solve(sum);
  const double expected = std::sqrt(left.squaredNorm() / LinearSystem::kCount);
  EXPECT_NEAR(made.discrepancy.visible_size(curves, values), expected, 1e-5 * expected);
  EXPECT_GT(std::abs(expected - std::hypot(made.discrepancy.visible_size(1, values.head(6)),
                                           made.discrepancy.visible_size(0, values.tail(6)))),
            0.01 * expected);  // they are not at right angles
}

// Each round of fit and noise is likelier than the last, until none is; and it is more than what the fit leaves.
TEST(NoiseBeside, IsTheLikeliestWithAllElseIntegratedOut) {
  for (const std::uint64_t seed : {2U, 3U, 4U}) {
    const LinearSystem system(2, seed, 0.3, 0.2, 0);
    const ModelSet set{0, 1};
    const Layout layout(system, set);
    const std::vector<VectorXd> local(2, layout.local_start());
    const VectorXd y = all_readings(system);
    const auto log_density = [&](const Noise& noise) { return log_normal(y, covariance_of(system, set, noise, 0.2)); };
    Noise noise = white(system);
    noise.sigma[0] = 0.04, noise.ar1 = 0.6;
    double before = log_density(noise), squares = 0;
    for (int round = 0; round < 60; ++round) {
      const auto likelihood = std::make_shared<const Likelihood>(system, Readings(2), noise);
      Fit at = fit(*likelihood, layout, layout.shared_start(), local,
                   {.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}}, {});
      at.likelihood = likelihood;
      squares = 0;
      for (std::size_t r = 0; r < 2; ++r)
        squares += likelihood->errors(layout, r, at.shared, at.local[r]).squaredNorm();
      noise = noise_beside(at, {}).noise;
      const double now = log_density(noise);
      EXPECT_GT(now, before - 2e-3) << "seed " << seed << ", round " << round;  // the search for ar1 ends at 0.002
      before = now;
    }
    for (const double factor : {0.97, 1.03}) {
      Noise other = noise;
      other.sigma[0] *= factor;
      EXPECT_LT(log_density(other), before) << "seed " << seed;
      other = noise;
      other.ar1 = std::max(0.0, noise.ar1 + factor - 1);
      EXPECT_LT(log_density(other), before + 1e-3) << "seed " << seed;
    }
    EXPECT_GT(noise.sigma[0], std::sqrt(squares / static_cast<double>(y.size()))) << "seed " << seed;
  }
}

// A fit that was left on its way, an offset of ten standard deviations off: by the errors of where it would go, the
// next fit, which does not get there, would be by far too sure.
TEST(NoiseBeside, OfAFitOnItsWayIsThatOfTheErrorsItHas) {
  const LinearSystem system(2, 5, 0, 0, 0);
  const Layout layout(system, {});
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(2), white(system));
  Fit at = fit(*likelihood, layout, layout.shared_start(), std::vector<VectorXd>(2, layout.local_start()),
               {.nuisance_sd = VectorXd::Zero(1), .curves = {}}, {});
  at.likelihood = likelihood;
  EXPECT_NEAR(noise_beside(at, {}).noise.sigma[0], 0.1, 0.02);
  at.shared[0] += 1;
  at.cost = cost_at(*likelihood, at, {});
  EXPECT_GT(noise_beside(at, {}).noise.sigma[0], 0.5);
}

TEST(HeldOut, OfALinearModelIsTheConditionalDensity) {
  const LinearSystem system(4, 7, 0.3, 0.2, 0);
  const Evaluated at = evaluate_set(system, {0});
  const auto blocks = linearise(*at.fit.likelihood, at.fit, {});
  const Noise& noise = at.fit.likelihood->noise();
  const double sd = at.fit.scales.nuisance_sd[0];
  const VectorXd y = all_readings(system);
  const MatrixXd covariance = covariance_of(system, {0}, noise, sd);
  for (std::size_t r = 0; r < 4; ++r) {
    std::vector<Index> others;
    for (Index i = 0; i < y.size(); ++i)
      if (i / LinearSystem::kCount != static_cast<Index>(r)) others.push_back(i);
    const double without = log_normal(y(others), covariance(others, others));
    // The same about a fit of the others alone.
    Fit refitted = at.fit;
    refitted.shared = leave_out(at.fit, blocks, {}, r)->shared;
    const auto predictive = predictive_of(refitted, linearise(*refitted.likelihood, refitted, {}), {}, r);
    EXPECT_NEAR(predictive->log_density, log_normal(y, covariance) - without, 1e-6);
    EXPECT_NEAR(predictive->chi2, leave_out(at.fit, blocks, {}, r)->chi2, 1e-6);
    EXPECT_NEAR(leave_out(at.fit, blocks, {}, r)->log_density, log_normal(y, covariance) - without, 1e-6);
    // And the parameters: generalised least squares of the others.
    MatrixXd X(y.size(), 3);
    for (Index k = 0; k < 4; ++k)
      X.middleRows(k * LinearSystem::kCount, LinearSystem::kCount) = LinearSystem::design({0});
    const MatrixXd V = covariance_of(system, {0}, noise, sd)(others, others), Xo = X(others, Eigen::all);
    const VectorXd prior = (VectorXd(3) << 1, 1, 0.25).finished();
    const VectorXd expected = prior.asDiagonal() * Xo.transpose() * V.lu().solve(VectorXd(y(others)));
    EXPECT_LT((leave_out(at.fit, blocks, {}, r)->shared - expected).norm(), 1e-6);
  }
}

TEST(Proposals, OfALinearModelAreExact) {
  const LinearSystem system(4, 7, 0.3, 0.2, 0);
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(4), white(system));
  const Layout layout(system, {});
  const std::vector<VectorXd> local(4, layout.local_start());
  const Fit base =
      fit(*likelihood, layout, layout.shared_start(), local, {.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}});
  const Proposals proposals(*likelihood, base);
  const auto found = proposals.beside(Marginal(*likelihood, base, {}), 1);
  ASSERT_EQ(found.size(), 2U);
  const VectorXd y = all_readings(system);
  const double without = log_normal(y, covariance_of(system, {}, white(system), 0.2));
  for (const Proposal& one : found) {
    const double with = log_normal(y, covariance_of(system, {one.effect}, white(system), 0.2));
    EXPECT_NEAR(one.log_bayes_factor, with - without, 1e-3 * std::abs(with - without) + 2e-3)
        << system.effects()[one.effect].name;
  }
  EXPECT_EQ(system.effects()[found.front().effect].name, "parabola");
  const auto pairs = proposals.pairs(Marginal(*likelihood, base, {}), 3);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_NEAR(pairs[0].first, log_normal(y, covariance_of(system, {0, 1}, white(system), 0.2)) - without, 0.05);
}

TEST(LogSum, OfFarApartAndOfNothing) {
  EXPECT_DOUBLE_EQ(log_sum(std::vector<double>{-1000, -1000}), -1000 + std::log(2));
  EXPECT_DOUBLE_EQ(log_sum(std::vector<double>{5, -1e6}), 5);
  EXPECT_EQ(log_sum({}), -std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace bevel::inference
