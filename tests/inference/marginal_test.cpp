// SPDX-License-Identifier: MIT
// What stands beside a set, by the linear model about its fit, against dense least squares and a normal density.
#include <bevel/diagnosis/inference/marginal.hpp>

#include <gtest/gtest.h>

#include <Eigen/QR>

#include <bevel/diagnosis/inference/error_spread.hpp>
#include <bevel/diagnosis/inference/evidence.hpp>
#include "tests/inference/linear_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::all_readings;
using testing::covariance_of;
using testing::LinearSystem;
using testing::white;

// Columns were whitened once, without what a set leaves open of some readings; what stands beside that set is estimated
// with it all the same.
TEST(Marginal, WhatASetLeavesOpenCountsInColumnsBesideIt) {
  LinearSystem system(4, 7, 0.3, 0.2, 0);
  system.input_sd = VectorXd::Zero(LinearSystem::kCount);
  system.input_sd.segment(18, 9).setConstant(0.7);
  const auto reference = std::make_shared<const Likelihood>(system, Readings(4), white(system));
  const Layout layout(system, {0});
  Fit at = fit(*reference, layout, layout.shared_start(), std::vector<VectorXd>(4, layout.local_start()),
               {.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}}, {});
  at.likelihood = reference;
  const auto own = with_inputs_of(at, reference);
  ASSERT_NE(own, reference);
  const MatrixXd step = LinearSystem::design({1}).rightCols(1);
  const std::vector<Eigen::MatrixXf> columns(4, reference->whitened(0, step).cast<float>());
  const auto added = Marginal(*own, at, {}, reference.get()).added(columns);
  MatrixXd covariance = covariance_of(system, {0}, white(system), 0.2);
  covariance.diagonal() += system.input_sd.cwiseAbs2().replicate(4, 1);
  const VectorXd weighed = covariance.llt().solve(step.replicate(4, 1));
  EXPECT_NEAR(added.square(0, 0), weighed.dot(step.replicate(4, 1).col(0)), 1e-3 * added.square(0, 0));
  EXPECT_NEAR(added.pull[0], weighed.dot(all_readings(system)), 1e-3 * std::sqrt(added.square(0, 0)));
  // So it is of curves.
  const Discrepancy discrepancy(*reference, at);
  const std::vector<Eigen::MatrixXf> of_curve(4, reference->whitened(0, system.by_curves(0, {})).cast<float>());
  const Marginal beside(*own, at, {}, reference.get());
  const MatrixXd expected = beside.added(of_curve).square;
  EXPECT_LT((discrepancy.added(beside)[0].square - expected).norm(), 1e-3 * expected.norm());
  // And it matters: without, the readings that are open would count like the others.
  const auto blind = Marginal(*reference, at, {}).added(columns);
  EXPECT_GT(std::abs(blind.square(0, 0) / added.square(0, 0) - 1), 0.1);
}

// Where paths diverge all derivatives are nearly the same one, and 10^7 of the noise. By least squares with everything
// side by side, priors as rows of their own.
TEST(Marginal, WhatAColumnAddsIsRightWherePathsDiverge) {
  constexpr std::size_t kRecordings = 4;
  LinearSystem system(kRecordings, 7, 0.3, 0.2, 0);
  system.divergence = 1e6;
  const Likelihood likelihood(system, Readings(kRecordings), white(system));
  Fit at(Layout(system, {}));
  at.shared = Eigen::Vector2d(LinearSystem::kOffset, LinearSystem::kSlope);
  at.local.assign(kRecordings, VectorXd::Zero(1));
  at.scales.nuisance_sd = VectorXd::Constant(1, 0.2);
  at.valid = true;
  const MatrixXd step = LinearSystem::design({1}).rightCols(1);
  const std::vector<Eigen::MatrixXf> columns(kRecordings, likelihood.whitened(0, step).cast<float>());
  const auto added = Marginal(likelihood, at, {}).added(columns);

  const Index n = LinearSystem::kCount, rows = n * static_cast<Index>(kRecordings), width = 2 + kRecordings;
  MatrixXd design = MatrixXd::Zero(rows + width, width), target = MatrixXd::Zero(rows + width, 2);
  Prediction prediction;
  for (std::size_t r = 0; r < kRecordings; ++r) {
    ASSERT_TRUE(system.predict({}, r, at.shared, at.local[r], true, prediction));
    const Index first = n * static_cast<Index>(r);
    design.block(first, 0, n, 2) = prediction.by_shared / system.sigma;
    design.block(first, 2 + static_cast<Index>(r), n, 1) = prediction.by_local / system.sigma;
    target.block(first, 0, n, 1) = step / system.sigma;
    target.block(first, 1, n, 1) = (all_readings(system).segment(first, n) - prediction.reading) / system.sigma;
  }
  design.bottomRows(width).diagonal() << 1, 1, VectorXd::Constant(kRecordings, 1 / 0.2);
  target.block(rows, 1, 2, 1) = -at.shared;
  const MatrixXd left = target - design * design.colPivHouseholderQr().solve(target);
  const double square = left.col(0).squaredNorm();
  EXPECT_NEAR(added.square(0, 0), square, 1e-3 * square);
  EXPECT_NEAR(added.pull[0], left.col(0).dot(left.col(1)), 1e-2 * std::sqrt(square));
}

}  // namespace
}  // namespace bevel::inference
