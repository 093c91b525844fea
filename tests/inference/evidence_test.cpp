// The evidence against closed forms: of a model linear in everything it is a normal density of all readings together.
#include <gtest/gtest.h>

#include "diagnosis/inference/evidence.hpp"
#include "diagnosis/inference/log_sum.hpp"
#include "diagnosis/inference/posterior.hpp"
#include "diagnosis/inference/proposals.hpp"
#include "tests/inference/linear_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::all_readings;
using testing::LinearSystem;
using testing::log_normal;
using testing::white;

// Covariance of all readings: noise, shared parameters, nuisances, a curve.
MatrixXd covariance_of(const LinearSystem& system, const ModelSet& set, const Noise& noise, double nuisance_sd,
                       const MatrixXd& curve_covariance = {}) {
  const Index n = LinearSystem::kCount, rows = system.data().rows();
  const MatrixXd X = LinearSystem::design(set), L = LinearSystem::cosine(), C = system.by_curves(0, {});
  VectorXd prior(X.cols());
  prior << 1, 1, VectorXd::Constant(X.cols() - 2, 0.25);
  MatrixXd shared = X * prior.asDiagonal() * X.transpose();
  if (curve_covariance.size() > 0) shared += C * curve_covariance * C.transpose();
  MatrixXd out(rows, rows);
  for (Index a = 0; a < rows / n; ++a)
    for (Index b = 0; b < rows / n; ++b) out.block(a * n, b * n, n, n) = shared;
  for (Index a = 0; a < rows / n; ++a) out.block(a * n, a * n, n, n) += nuisance_sd * nuisance_sd * L * L.transpose();
  for (Index a = 0; a < rows / n; ++a)
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j < n; ++j)
        out(a * n + i, a * n + j) +=
            noise.sigma[0] * noise.sigma[0] * std::pow(noise.ar1, std::abs(static_cast<double>(i - j)));
  return out;
}

Evaluated evaluate_set(const LinearSystem& system, const ModelSet& set, const Discrepancy* discrepancy = nullptr) {
  const Likelihood likelihood(system, Readings(system.data().recordings.size()), white(system));
  const Layout layout(system, set);
  const std::vector<VectorXd> local(system.data().recordings.size(), layout.local_start());
  Evaluated out = evaluate(likelihood, layout, layout.shared_start(), local, VectorXd::Constant(1, 0.2));
  if (discrepancy) add_discrepancy(likelihood, *discrepancy, out);
  return out;
}

TEST(Evidence, OfALinearModelIsTheNormalDensityOfAllReadings) {
  for (const double nuisance_sd : {0.0, 0.2})
    for (const ModelSet& set : {ModelSet{}, ModelSet{0}, ModelSet{0, 1}}) {
      const LinearSystem system(4, 7, 0.3, nuisance_sd, 0);
      const Evaluated at = evaluate_set(system, set);
      ASSERT_TRUE(at.valid);
      const Noise& noise = at.fit.likelihood->noise();
      const VectorXd y = all_readings(system);
      const double none = log_normal(y, covariance_of(system, set, noise, 0.0));
      const double some = log_normal(y, covariance_of(system, set, noise, 0.2));
      // Over the grid of two; what lies elsewhere counts for no more than the best.
      EXPECT_NEAR(at.log_evidence, std::max(none, some) + std::log1p(std::exp(-std::abs(none - some))) - std::log(2),
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
      fit(likelihood, layout, layout.shared_start(), local, {.nuisance_sd = VectorXd::Constant(1, 0.2), .curve = {}});
  base.likelihood = std::make_shared<const Likelihood>(likelihood);
  const Discrepancy discrepancy(likelihood, base);
  const auto factors = discrepancy.scan(Marginal(likelihood, base, {}));
  ASSERT_EQ(factors.size(), discrepancy.choices());
  const VectorXd y = all_readings(system);
  const double without = log_normal(y, covariance_of(system, {}, white(system), 0.2));
  for (const CurveFactor& one : factors) {
    const MatrixXd covariance = discrepancy.columns(likelihood, one.prior).covariance;
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
      fit(likelihood, layout, layout.shared_start(), local, {.nuisance_sd = VectorXd::Constant(1, 0.2), .curve = {}});
  const Discrepancy discrepancy(likelihood, base);
  // Drawn from the prior of scale 2: in the mean twice the noise, squared.
  const CurvePrior prior{.curve = 0, .scale = 2, .length = 0.2};
  const MatrixXd root = discrepancy.columns(likelihood, prior).covariance.llt().matrixL();
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  double square = 0;
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    const VectorXd values = root * VectorXd::NullaryExpr(6, [&] { return normal(random); });
    square += std::pow(discrepancy.visible_size(prior, values), 2) / kDraws;
  }
  EXPECT_NEAR(square, 4, 0.2);
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
    refitted.shared = leave_out(at.fit, blocks, {}, r).shared;
    const auto predictive = predictive_of(refitted, linearise(*refitted.likelihood, refitted, {}), {}, r);
    EXPECT_NEAR(predictive.log_density, log_normal(y, covariance) - without, 1e-6);
    EXPECT_NEAR(predictive.chi2, leave_out(at.fit, blocks, {}, r).chi2, 1e-6);
    EXPECT_NEAR(leave_out(at.fit, blocks, {}, r).log_density, log_normal(y, covariance) - without, 1e-6);
    // And the parameters: generalised least squares of the others.
    MatrixXd X(y.size(), 3);
    for (Index k = 0; k < 4; ++k)
      X.middleRows(k * LinearSystem::kCount, LinearSystem::kCount) = LinearSystem::design({0});
    const MatrixXd V = covariance_of(system, {0}, noise, sd)(others, others), Xo = X(others, Eigen::all);
    const VectorXd prior = (VectorXd(3) << 1, 1, 0.25).finished();
    const VectorXd expected = prior.asDiagonal() * Xo.transpose() * V.lu().solve(VectorXd(y(others)));
    EXPECT_LT((leave_out(at.fit, blocks, {}, r).shared - expected).norm(), 1e-6);
  }
}

TEST(Proposals, OfALinearModelAreExact) {
  const LinearSystem system(4, 7, 0.3, 0.2, 0);
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(4), white(system));
  const Layout layout(system, {});
  const std::vector<VectorXd> local(4, layout.local_start());
  const Fit base =
      fit(*likelihood, layout, layout.shared_start(), local, {.nuisance_sd = VectorXd::Constant(1, 0.2), .curve = {}});
  const Proposals proposals(*likelihood, base, 2);
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
