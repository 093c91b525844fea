// SPDX-License-Identifier: MIT
// Predictions of one recording, new and continued, and its nuisances, against dense normal densities of all readings.
#include <bevel/diagnosis/inference/predictive.hpp>

#include <gtest/gtest.h>

#include <numeric>

#include <bevel/diagnosis/inference/log_sum.hpp>
#include <bevel/diagnosis/inference/nuisances.hpp>
#include <bevel/diagnosis/inference/recording_rows.hpp>
#include "tests/inference/linear_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::all_readings;
using testing::LinearSystem;
using testing::log_normal;

constexpr Index kRows = LinearSystem::kCount;
constexpr std::size_t kHeldOut = 1;
constexpr double kLog2Pi = 1.8378770664093453;

// Of an autoregressive process of second order by its Yule-Walker equations; ar1 and ar2 are partial correlations.
double autocorrelation(const Noise& noise, Index lag) {
  const double second = noise.ar2, first = noise.ar1 * (1 - second);
  double before = 1, now = noise.ar1;
  if (lag == 0) return 1;
  for (Index k = 1; k < lag; ++k) {
    const double next = first * now + second * before;
    before = now;
    now = next;
  }
  return now;
}

MatrixXd covariance_of(const LinearSystem& system, const Noise& noise, double nuisance_sd) {
  const MatrixXd X = LinearSystem::design({0}), L = LinearSystem::cosine();
  const MatrixXd shared = X * Eigen::Vector3d(1, 1, 0.25).asDiagonal() * X.transpose();
  const Index rows = system.data().rows();
  MatrixXd out(rows, rows);
  for (Index i = 0; i < rows; ++i)
    for (Index j = 0; j < rows; ++j) {
      out(i, j) = shared(i % kRows, j % kRows);
      if (i / kRows != j / kRows) continue;
      out(i, j) += nuisance_sd * nuisance_sd * L(i % kRows) * L(j % kRows) +
                   noise.sigma[0] * noise.sigma[0] * autocorrelation(noise, std::abs(i - j));
    }
  return out;
}

struct Normal {
  VectorXd mean, sd;
  double log_density = 0;  // of what was read
};
Normal given(const MatrixXd& C, const VectorXd& y, const std::vector<Index>& of, const std::vector<Index>& known) {
  const Eigen::PartialPivLU<MatrixXd> lu(MatrixXd(C(known, known)));
  const MatrixXd across = C(of, known);
  std::vector<Index> both = known;
  both.insert(both.end(), of.begin(), of.end());
  Normal out;
  out.mean = across * lu.solve(VectorXd(y(known)));
  out.sd = (C(of, of) - across * lu.solve(across.transpose())).diagonal().cwiseSqrt();
  out.log_density = log_normal(y(both), C(both, both)) - log_normal(y(known), C(known, known)) -
                    0.5 * static_cast<double>(of.size()) * kLog2Pi;
  return out;
}

// Over the two standard deviations, by shares whose logarithms these are.
void expect_mixture(const Forecast& found, const VectorXd& y, const std::vector<Normal>& normals,
                    const std::vector<double>& log_shares) {
  const double total = log_sum(log_shares);
  std::vector<double> logs;
  for (std::size_t k = 0; k < normals.size(); ++k) logs.push_back(log_shares[k] - total + normals[k].log_density);
  EXPECT_NEAR(found.log_density, log_sum(logs), 5e-6);  // what does not vary has a precision of 1e12 there
  ASSERT_EQ(found.error.size(), y.size());
  for (Index i = 0; i < y.size(); ++i) {
    double mean = 0, below = 0;
    for (std::size_t k = 0; k < normals.size(); ++k) {
      const double share = std::exp(log_shares[k] - total);
      mean += share * normals[k].mean[i];
      below += share * 0.5 * std::erfc(-(y[i] - normals[k].mean[i]) / normals[k].sd[i] / std::sqrt(2.0));
    }
    EXPECT_NEAR(found.error[i], y[i] - mean, 1e-7) << i;
    EXPECT_NEAR(found.below[i], below, 1e-6) << i;
  }
}

struct Predictive : ::testing::TestWithParam<double> {};

TEST_P(Predictive, NewAndContinuedAreTheConditionalDensitiesOfALinearModel) {
  const LinearSystem system(4, 8, 0.3, 0.1, 0);
  Noise noise = testing::white(system);
  noise.ar1 = 0.6;
  noise.ar2 = GetParam();
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(4), noise);
  const Layout layout(system, {0});
  const std::vector<VectorXd> local(4, layout.local_start());
  // The mode is not where the readings are predicted from: any place does in a linear model.
  Fit fit(layout);
  fit.scales.nuisance_sd = VectorXd::Constant(1, 0.2);
  fit.shared = Eigen::Vector3d(0.5, 0.1, 0.2);
  fit.local = local;
  fit.local[kHeldOut][0] = 0.3;
  fit.likelihood = likelihood;
  const NuisanceGrid grid = nuisance_grid(system);
  ASSERT_EQ(grid.log_prior.size(), 2);
  const double until_s = time_of_share(system.data().recordings[kHeldOut], 1.0 / 3);
  Fit begun = fit;
  begun.shared += Eigen::Vector3d(-0.2, 0.3, 0.1);
  begun.local[kHeldOut][0] = -0.1;
  const auto found = forecast({&fit, linearise(*likelihood, fit, {})}, {&begun, linearise(*likelihood, begun, {})}, {},
                              grid, kHeldOut, until_s);
  ASSERT_TRUE(found);

  const VectorXd y = all_readings(system);
  std::vector<Index> others, own, first, rest;
  for (Index i = 0; i < y.size(); ++i)
    if (i / kRows != kHeldOut) others.push_back(i);
  for (Index i = 0; i < kRows; ++i) {
    own.push_back(kHeldOut * kRows + i);
    (i < kRows / 3 ? first : rest).push_back(own.back());
  }
  std::vector<Index> known = others;
  known.insert(known.end(), first.begin(), first.end());
  std::vector<Normal> all, beyond, continued;
  std::vector<double> by_others, by_both;
  for (Index k = 0; k < 2; ++k) {
    const MatrixXd C = covariance_of(system, noise, grid.standard_deviations(0, k));
    all.push_back(given(C, y, own, others));
    beyond.push_back(given(C, y, rest, others));
    continued.push_back(given(C, y, rest, known));
    by_others.push_back(grid.log_prior[k] + log_normal(y(others), C(others, others)));
    by_both.push_back(by_others.back() + given(C, y, first, others).log_density);
  }
  // Neither of the two standard deviations alone, nor at a share that is left out.
  ASSERT_LT(std::abs(by_others[0] - by_others[1]), 3) << by_others[0] << ' ' << by_others[1];
  expect_mixture(found->all, y(own), all, by_others);
  expect_mixture(found->beyond, y(rest), beyond, by_others);
  expect_mixture(found->continued, y(rest), continued, by_both);
  EXPECT_EQ(found->continued.rows.front(), kRows / 3);
  EXPECT_NEAR(found->log_density_first, log_sum(by_both) - log_sum(by_others), 1e-6);
}
// Where recordings differ about a mean that they share, and that is normal about zero by the widest that is tried: the
// same densities with it in the covariance of all readings.
TEST_P(Predictive, WhatAllHaveInCommonTheNextHasToo) {
  const LinearSystem system(4, 8, 0.3, 0.1, 0);
  Noise noise = testing::white(system);
  noise.ar1 = 0.6;
  noise.ar2 = GetParam();
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(4), noise);
  const Layout layout(system, {0});
  Fit fit(layout);
  fit.scales.nuisance_sd = VectorXd::Constant(1, 0.2);
  fit.shared = Eigen::Vector3d(0.5, 0.1, 0.2);
  for (const double own : {0.2, 0.3, -0.1, 0.5}) fit.local.emplace_back(VectorXd::Constant(1, own));
  fit.likelihood = likelihood;
  Fit begun = fit;
  begun.shared += Eigen::Vector3d(-0.2, 0.3, 0.1);
  begun.local[kHeldOut][0] = -0.1;
  const NuisanceGrid grid = nuisance_grid(system);
  const double until_s = time_of_share(system.data().recordings[kHeldOut], 1.0 / 3);
  const auto about = [&](const Fit& at, std::size_t recording) {
    return with_mean({&at, linearise(*likelihood, at, {})}, recording);
  };
  const auto found = forecast(about(fit, kHeldOut), about(begun, kHeldOut), {}, grid, kHeldOut, until_s);
  ASSERT_TRUE(found);

  const VectorXd y = all_readings(system);
  std::vector<Index> others, own, first, rest;
  for (Index i = 0; i < y.size(); ++i)
    if (i / kRows != kHeldOut) others.push_back(i);
  for (Index i = 0; i < kRows; ++i) {
    own.push_back(kHeldOut * kRows + i);
    (i < kRows / 3 ? first : rest).push_back(own.back());
  }
  std::vector<Index> known = others;
  known.insert(known.end(), first.begin(), first.end());
  const VectorXd common = LinearSystem::cosine().replicate(4, 1);
  std::vector<Normal> all, beyond, continued;
  std::vector<double> by_others, by_both, about_zero, by_all;
  for (Index k = 0; k < 2; ++k) {
    const double sd = grid.standard_deviations(0, k);
    const MatrixXd zero = covariance_of(system, noise, sd);
    const MatrixXd C = zero + (sd > 0 ? 0.2 * 0.2 : 0.0) * common * common.transpose();
    all.push_back(given(C, y, own, others));
    beyond.push_back(given(C, y, rest, others));
    continued.push_back(given(C, y, rest, known));
    by_others.push_back(grid.log_prior[k] + log_normal(y(others), C(others, others)));
    by_both.push_back(by_others.back() + given(C, y, first, others).log_density);
    by_all.push_back(grid.log_prior[k] + log_normal(y, C));
    about_zero.push_back(grid.log_prior[k] + log_normal(y(others), zero(others, others)));
  }
  expect_mixture(found->all, y(own), all, by_others);
  expect_mixture(found->beyond, y(rest), beyond, by_others);
  expect_mixture(found->continued, y(rest), continued, by_both);
  EXPECT_NEAR(found->log_density_first, log_sum(by_both) - log_sum(by_others), 1e-4);
  // Both ways of the others' readings stand on one scale.
  EXPECT_NEAR(found->log_others - log_evidence_of_others({&fit, linearise(*likelihood, fit, {})}, {}, grid, kHeldOut),
              log_sum(by_others) - log_sum(about_zero), 1e-4);
  const VectorXd weights = spread_weights(about(fit, 4), {}, grid);
  for (Index k = 0; k < 2; ++k)
    EXPECT_NEAR(weights[k], std::exp(by_all[static_cast<std::size_t>(k)] - log_sum(by_all)), 1e-5);
}
INSTANTIATE_TEST_SUITE_P(OfFirstAndSecondOrder, Predictive, ::testing::Values(0.0, -0.3));

// Readings with an error of their own beside the noise (a jump's): back from whitened rows, and what the first part
// says of the rest, as by the dense covariance.
TEST(Predictive, ReadingsWithErrorsOfTheirOwnAreConditionedToo) {
  const LinearSystem system(2, 8, 0.3, 0, 0);
  Noise noise = testing::white(system);
  noise.ar1 = 0.6;
  VectorXd own = VectorXd::Zero(kRows);
  for (const Index i : {5, 18, 19, 20, 41}) own[i] = 0.3;
  const Likelihood likelihood(system, Readings(2), noise, {own, own});
  const double until_s = time_of_share(system.data().recordings[kHeldOut], 1.0 / 3);
  const RecordingRows rows(likelihood, kHeldOut, until_s);
  MatrixXd C(kRows, kRows);
  for (Index i = 0; i < kRows; ++i)
    for (Index j = 0; j < kRows; ++j)
      C(i, j) =
          noise.sigma[0] * noise.sigma[0] * autocorrelation(noise, std::abs(i - j)) + (i == j ? own[i] * own[i] : 0);
  const VectorXd errors = VectorXd::LinSpaced(kRows, -1, 2).array().sin();
  const MatrixXd white = likelihood.whitened(kHeldOut, errors);
  EXPECT_NEAR(white.squaredNorm(), errors.dot(C.ldlt().solve(errors)), 1e-9);
  EXPECT_LT((rows.coloured(white, false) - errors).norm(), 1e-12);
  EXPECT_LT((rows.noise_variances(false) - C.diagonal()).cwiseAbs().maxCoeff(), 1e-12);
  const auto &first = rows.first(), &rest = rows.rest();
  const Eigen::LDLT<MatrixXd> of_first(MatrixXd(C(first, first)));
  const MatrixXd across = C(rest, first);
  const VectorXd left = errors(rest) - across * of_first.solve(VectorXd(errors(first)));
  EXPECT_LT((rows.coloured(white, true)(rest, Eigen::all) - left).norm(), 1e-10);
  const VectorXd variances = (C(rest, rest) - across * of_first.solve(across.transpose())).diagonal();
  EXPECT_LT((rows.noise_variances(true)(rest) - variances).cwiseAbs().maxCoeff(), 1e-12);
  const WhiteReadings alone = rows.rest_alone(MatrixXd::Zero(kRows, 1), errors);
  EXPECT_NEAR(alone.w.squaredNorm(), errors(rest).dot(MatrixXd(C(rest, rest)).ldlt().solve(VectorXd(errors(rest)))),
              1e-9);
}

TEST(Predictive, ModelsAreWeighedByTheFirstReadingsTooWhenContinued) {
  const auto one = [](double error, double below, double log_density) {
    return Forecast{.rows = {0},
                    .error = VectorXd::Constant(1, error),
                    .below = VectorXd::Constant(1, below),
                    .log_density = log_density};
  };
  const std::vector<Forecasts> models{
      {.all = one(1, 0.9, -1), .beyond = one(1, 0.9, -1), .continued = one(1, 0.9, -1), .log_density_first = 0},
      {.all = one(3, 0.5, -2),
       .beyond = one(3, 0.5, -2),
       .continued = one(3, 0.5, -2),
       .log_density_first = std::log(3.0)}};
  const Forecasts mean = averaged(models, {0.25, 0.25});  // shares of a posterior, not all of it
  EXPECT_NEAR(mean.all.error[0], 2, 1e-12);
  EXPECT_NEAR(mean.all.below[0], 0.7, 1e-12);
  EXPECT_NEAR(mean.all.log_density, std::log(0.5 * std::exp(-1) + 0.5 * std::exp(-2)), 1e-12);
  EXPECT_NEAR(mean.continued.error[0], 2.5, 1e-12);
  EXPECT_NEAR(mean.continued.below[0], 0.6, 1e-12);
  EXPECT_NEAR(mean.continued.log_density, std::log(0.25 * std::exp(-1) + 0.75 * std::exp(-2)), 1e-12);
}

TEST(Predictive, ReadingsOfOneTimeAreKnownTogether) {
  SeriesSet set;
  set.series.resize(2);
  set.series[0].time_s = {0, 1, 1, 2, 3, 4};
  set.series[1].time_s = {0, 1, 2};
  const double until_s = time_of_share(set, 1.0 / 3);  // the third of nine: one of three at 1 s
  EXPECT_GT(until_s, 1);
  EXPECT_LT(until_s, 1.001);
}

TEST(Nuisances, OfALinearModelAreTheNormalPosterior) {
  const LinearSystem system(4, 8, 0.3, 0.1, 0);
  Noise noise = testing::white(system);
  noise.ar1 = 0.5;
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(4), noise);
  const Layout layout(system, {0});
  const Scales scales{.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}};
  Fit at = fit(*likelihood, layout, layout.shared_start(), std::vector<VectorXd>(4, layout.local_start()), scales);
  at.likelihood = likelihood;
  const VectorXd weights = Eigen::Vector2d(0.3, 0.7);
  const auto found = nuisance_posterior(at, linearise(*likelihood, at, {}), {}, weights);
  const MatrixXd C = covariance_of(system, noise, 0.2);
  const VectorXd y = all_readings(system);
  ASSERT_EQ(found.size(), 4U);
  for (std::size_t r = 0; r < 4; ++r) {
    // Covariance of the recording's own with all readings.
    VectorXd across = VectorXd::Zero(y.size());
    across.segment(static_cast<Index>(r) * kRows, kRows) = 0.04 * LinearSystem::cosine();
    const VectorXd gain = C.lu().solve(across);
    const double mean = gain.dot(y), variance = 0.04 - gain.dot(across);
    // With share 0.3 it is zero: the recordings do not differ.
    ASSERT_EQ(found[r].size(), 1U);
    EXPECT_NEAR(found[r][0].mean(), 0.7 * mean, 1e-6);
    EXPECT_NEAR(found[r][0].sd(), std::sqrt(0.7 * variance + 0.21 * mean * mean), 1e-6);
  }
}

}  // namespace
}  // namespace bevel::inference
