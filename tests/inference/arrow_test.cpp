// SPDX-License-Identifier: MIT
// The arrow's solution against the same least squares written out in full.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

#include <bevel/diagnosis/inference/arrow.hpp>

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Problem {
  std::vector<ArrowBlock> blocks;
  MatrixXd A, precision;  // all unknowns: shared, then each recording's
  VectorXd w, centre;
};

Problem random_problem(std::uint64_t seed) {
  constexpr Index kRows = 30, kShared = 4, kLocal = 3, kRecordings = 5;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&](Index rows, Index columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); }));
  };
  Problem out;
  const Index all = kShared + kLocal * kRecordings;
  out.A = MatrixXd::Zero(kRows * kRecordings, all);
  out.precision = MatrixXd::Zero(all, all);
  const MatrixXd root = draw(kShared, kShared);
  out.precision.topLeftCorner(kShared, kShared) = root * root.transpose() + MatrixXd::Identity(kShared, kShared);
  out.w.resize(kRows * kRecordings);
  out.centre = draw(all, 1);
  for (Index r = 0; r < kRecordings; ++r) {
    const MatrixXd L = draw(kRows, kLocal), Z = draw(kRows, kShared);
    const VectorXd w = draw(kRows, 1);
    ArrowBlock block = make_block(L, Z, w);
    block.precision = draw(kLocal, 1).cwiseAbs() + VectorXd::Constant(kLocal, 0.1);
    block.centre = out.centre.segment(kShared + r * kLocal, kLocal);
    out.A.block(r * kRows, 0, kRows, kShared) = Z;
    out.A.block(r * kRows, kShared + r * kLocal, kRows, kLocal) = L;
    out.precision.block(kShared + r * kLocal, kShared + r * kLocal, kLocal, kLocal) = block.precision.asDiagonal();
    out.w.segment(r * kRows, kRows) = w;
    out.blocks.push_back(block);
  }
  return out;
}

TEST(Arrow, SolvesAsTheWholeSystemDoes) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Problem p = random_problem(seed);
    const Index n = 4;
    const ArrowSolution s = solve(p.blocks, p.precision.topLeftCorner(n, n), p.centre.head(n));
    ASSERT_TRUE(s.valid);
    const MatrixXd H = p.A.transpose() * p.A + p.precision;
    const VectorXd x = H.ldlt().solve(p.A.transpose() * p.w + p.precision * p.centre);
    EXPECT_LT((s.shared - x.head(n)).norm(), 1e-10);
    for (std::size_t r = 0; r < p.blocks.size(); ++r)
      EXPECT_LT((s.local[r] - x.segment(n + 3 * static_cast<Index>(r), 3)).norm(), 1e-10);
    const VectorXd off = x - p.centre;
    EXPECT_NEAR(s.least, (p.w - p.A * x).squaredNorm() + off.dot(p.precision * off), 1e-9);
    EXPECT_LT((s.covariance - MatrixXd(H.inverse()).topLeftCorner(n, n)).norm(), 1e-10);
    const auto log_det = [](const MatrixXd& M) { return M.ldlt().vectorD().array().log().sum(); };
    EXPECT_NEAR(s.log_volume_ratio, log_det(H) - log_det(p.precision), 1e-9);
  }
}

TEST(Arrow, ASlopeIsWhatItAddsToTheSquares) {
  Problem p = random_problem(6);
  p.blocks[1].slope = VectorXd{{0.3, -2}};  // of the first two
  p.blocks[4].slope = VectorXd{{1, 0, 0.5, -1}};
  const ArrowSolution s = solve(p.blocks, p.precision.topLeftCorner(4, 4), p.centre.head(4));
  VectorXd slope = VectorXd::Zero(p.centre.size());
  slope.head(4) << 1.3, -2, 0.5, -1;
  const MatrixXd H = p.A.transpose() * p.A + p.precision;
  const VectorXd x = H.ldlt().solve(p.A.transpose() * p.w + p.precision * p.centre - slope);
  EXPECT_LT((s.shared - x.head(4)).norm(), 1e-10);
  const VectorXd off = x - p.centre;
  EXPECT_NEAR(s.least, (p.w - p.A * x).squaredNorm() + off.dot(p.precision * off) + 2 * slope.dot(x), 1e-9);
  ArrowRules rules;
  rules.used = {true, false, true, true, false};
  p.blocks[1].slope = p.blocks[4].slope = {};
  const VectorXd rest = solve(p.blocks, p.precision.topLeftCorner(4, 4), p.centre.head(4), rules).shared;
  p.blocks[1].slope = p.blocks[4].slope = VectorXd::Ones(4);
  EXPECT_EQ(solve(p.blocks, p.precision.topLeftCorner(4, 4), p.centre.head(4), rules).shared, rest);
}

TEST(Arrow, WithoutARecordingIsTheRestAlone) {
  const Problem p = random_problem(9);
  ArrowRules rules;
  rules.used = {true, false, true, true, true};
  const ArrowSolution s = solve(p.blocks, p.precision.topLeftCorner(4, 4), p.centre.head(4), rules);
  auto rest = p.blocks;
  rest.erase(rest.begin() + 1);
  const ArrowSolution t = solve(rest, p.precision.topLeftCorner(4, 4), p.centre.head(4));
  EXPECT_LT((s.shared - t.shared).norm(), 1e-12);
  EXPECT_NEAR(s.least, t.least, 1e-10);
  EXPECT_NEAR(s.log_volume_ratio, t.log_volume_ratio, 1e-10);
}

TEST(Arrow, WhatIsHeldStaysAndHasTheVolumeOfItsTail) {
  const Problem p = random_problem(4);
  ArrowRules rules;
  rules.held = {2};
  MatrixXd precision = p.precision.topLeftCorner(4, 4).diagonal().asDiagonal();
  const ArrowSolution s = solve(p.blocks, precision, VectorXd::Zero(4), rules);
  ASSERT_TRUE(s.valid);
  EXPECT_EQ(s.shared[2], 0);
  EXPECT_EQ(s.covariance(2, 2), 0);
  // The same problem without that unknown.
  auto blocks = p.blocks;
  const std::vector<Index> rest = {0, 1, 3};
  for (auto& block : blocks) {
    block.lz = MatrixXd(block.lz(Eigen::all, rest));
    block.zz = MatrixXd(block.zz(rest, rest));
    block.zw = VectorXd(block.zw(rest));
  }
  const ArrowSolution t = solve(blocks, MatrixXd(precision(rest, rest)), VectorXd::Zero(3));
  EXPECT_NEAR(s.least, t.least, 1e-9);
  EXPECT_GT(s.log_volume_ratio, t.log_volume_ratio);
}

// The least squares of the rest, with those unknowns where they are held.
TEST(Arrow, WhatIsHeldElsewhereIsThereAndTheRestFollows) {
  const Problem p = random_problem(11);
  const Index n = 4, all = p.A.cols();
  ArrowRules rules;
  rules.held = {2, 0};
  rules.held_at = {0.7, -1.3};
  const ArrowSolution s = solve(p.blocks, p.precision.topLeftCorner(n, n), p.centre.head(n), rules);
  ASSERT_TRUE(s.valid);
  VectorXd x = VectorXd::Zero(all);
  x[2] = 0.7, x[0] = -1.3;
  std::vector<Index> rest;
  for (Index i = 0; i < all; ++i)
    if (i != 2 && i != 0) rest.push_back(i);
  const MatrixXd H = p.A.transpose() * p.A + p.precision;
  const VectorXd g = p.A.transpose() * p.w + p.precision * p.centre - H * x;
  const VectorXd others = MatrixXd(H(rest, rest)).ldlt().solve(VectorXd(g(rest)));
  for (std::size_t i = 0; i < rest.size(); ++i) x[rest[i]] = others[static_cast<Index>(i)];
  EXPECT_LT((s.shared - x.head(n)).norm(), 1e-9);
  for (std::size_t r = 0; r < p.blocks.size(); ++r)
    EXPECT_LT((s.local[r] - x.segment(n + 3 * static_cast<Index>(r), 3)).norm(), 1e-9);
  const VectorXd off = x - p.centre;
  EXPECT_NEAR(s.least, (p.w - p.A * x).squaredNorm() + off.dot(p.precision * off), 1e-8);
}

TEST(Arrow, WhatPressesAgainstABoundHasTheVolumeThatItsCurvatureLeaves) {
  const Problem p = random_problem(4);
  const MatrixXd precision = p.precision.topLeftCorner(4, 4).diagonal().asDiagonal();
  const std::vector<Index> rest = {0, 1, 3};
  // From hardly pressing, half of a normal density, to an exponential tail.
  for (const double pull : {0.0, 0.3, 3.0, 1000.0}) {
    auto blocks = p.blocks;
    const VectorXd centre = VectorXd::Unit(4, 2) * pull / precision(2, 2);
    ArrowRules rules;
    rules.held = {2};
    const ArrowSolution s = solve(blocks, precision, centre, rules);
    // The least of the rest, with that unknown at x.
    double volume_rest = 0;
    VectorXd others_at;
    const auto least_at = [&](double x) {
      auto moved = p.blocks;
      for (auto& block : moved) {
        block.ww += x * (x * block.zz(2, 2) - 2 * block.zw[2]);
        block.lw -= x * block.lz.col(2);
        block.zw = VectorXd((block.zw - x * block.zz.col(2))(rest));
        block.lz = MatrixXd(block.lz(Eigen::all, rest));
        block.zz = MatrixXd(block.zz(rest, rest));
      }
      const ArrowSolution t = solve(moved, MatrixXd(precision(rest, rest)), VectorXd::Zero(3));
      volume_rest = t.log_volume_ratio;
      others_at = t.shared;
      return t.least + precision(2, 2) * (x - centre[2]) * (x - centre[2]);
    };
    const double here = least_at(0), small = 1e-6;
    const double inwards = least_at(small) > here ? 1 : -1;
    // Trapezia over twenty widths of the tail.
    const double slope = (least_at(inwards * small) - here) / (2 * small);
    const double curvature = (least_at(1) + least_at(-1) - 2 * here) / 2;
    const double step = 20 / std::max(slope, std::sqrt(curvature)) / 20000;
    double volume = 0.5 * step, square = 0;
    for (int i = 1; i < 20000; ++i) {
      const double x = i * step, density = step * std::exp(-0.5 * (least_at(inwards * x) - here));
      volume += density, square += x * x * density;
    }
    EXPECT_NEAR(s.log_volume_ratio,
                volume_rest + std::log(2 * std::numbers::pi) - 2 * std::log(volume) - std::log(precision(2, 2)), 2e-3)
        << "pull " << pull;
    // As far as it may be from there, and what follows it: of the rest, so much more than with it at its bound.
    least_at(1);
    const VectorXd with = others_at;
    least_at(0);
    VectorXd along = VectorXd::Unit(4, 2);
    along(rest) = with - others_at;
    const MatrixXd added = square / volume * along * along.transpose();
    EXPECT_LT((s.of_tails - added).norm(), 2e-3 * added.norm()) << "pull " << pull;
    EXPECT_EQ(s.covariance_with_tails(), s.covariance + s.of_tails);
  }
}

}  // namespace
}  // namespace bevel::inference
