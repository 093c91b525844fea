// SPDX-License-Identifier: MIT
// How much more readings scatter near the entry: against made-up readings of which it is known, and against restricted
// likelihoods by dense matrices.
#include <bevel/diagnosis/needle/scatter_near_entry.hpp>

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <random>

#include <bevel/model/effects/discrepancy.hpp>

namespace bevel::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kRecordings = 6, kStops = 21;
constexpr double kStep_mm = 5, kDeep_mm = 0.03;

struct Scatter {
  double excess = 0, length_mm = 1;
  double sd_at(double depth_mm) const { return kDeep_mm * std::sqrt(1 + excess * std::exp(-depth_mm / length_mm)); }
};

// One channel; each recording has a parabola of its own about a path that all share.
RecordedCase made(const Scatter& scatter, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  RecordedCase out;
  out.has_clock = false;
  out.channels = {{.camera = 0, .axis = Eigen::Vector3d::UnitX(), .name = "tip.x", .claimed_sd = 0.1}};
  for (int r = 0; r < kRecordings; ++r) {
    Recording& one = out.recordings.emplace_back();
    one.series.resize(1);
    one.changed = r >= kRecordings / 2;
    const double offset = 0.3 * normal(random), slope = 0.01 * normal(random), bend = 1e-5 * normal(random);
    for (int i = 0; i < kStops; ++i) {
      const double depth_mm = i * kStep_mm;
      model::BaseMotion node{};
      node.time_s = i;
      node.insertion_mm = depth_mm;
      one.motion.nodes.push_back(node);
      one.motion.at.push_back(static_cast<std::size_t>(i));
      Series& series = one.series[0];
      series.message.push_back(static_cast<std::size_t>(i));
      series.time_s.push_back(i);
      series.relative_sd.push_back(1);
      series.measured.push_back(offset + slope * depth_mm + bend * depth_mm * depth_mm + 0.0004 * depth_mm * depth_mm +
                                (one.changed ? 0.005 * depth_mm : 0) + scatter.sd_at(depth_mm) * normal(random));
    }
  }
  return out;
}

// As its definition stands, and not by orthogonal columns: -2 log of the density of all contrasts that are free of X.
double dense_deviance(const RecordedCase& recorded, const Scatter& scatter) {
  const Index rows = kRecordings * kStops;
  std::vector<double> knots;
  for (int k = 0; k < 8; ++k) knots.push_back(k / 7.0);
  MatrixXd X = MatrixXd::Zero(rows, 3 * kRecordings + 16);
  VectorXd y(rows), variance(rows);
  for (int r = 0, row = 0; r < kRecordings; ++r)
    for (int i = 0; i < kStops; ++i, ++row) {
      const double depth = i / (kStops - 1.0);
      y[row] = recorded.recordings[static_cast<std::size_t>(r)].series[0].measured[static_cast<std::size_t>(i)];
      variance[row] = std::pow(scatter.sd_at(i * kStep_mm) / kDeep_mm, 2);
      for (int power = 0; power < 3; ++power) X(row, 3 * r + power) = std::pow(depth, power);
      const auto at = model::weights_at(knots, false, depth);
      for (std::size_t k = 0; k < 2; ++k)
        X(row, 3 * kRecordings + (r >= kRecordings / 2 ? 8 : 0) + static_cast<Index>(at.knot[k])) += at.weight[k];
    }
  const Eigen::FullPivLU<MatrixXd> lu(X.transpose());
  const MatrixXd contrasts = lu.kernel();  // columns K with X'K = 0
  const MatrixXd V = contrasts.transpose() * variance.asDiagonal() * contrasts;
  const Eigen::LLT<MatrixXd> llt(V);
  const VectorXd w = llt.matrixL().solve(contrasts.transpose() * y);
  const auto n = static_cast<double>(w.size());
  const MatrixXd L = llt.matrixL();
  return n * std::log(w.squaredNorm() / n) + 2 * L.diagonal().array().log().sum();
}

TEST(ScatterNearEntry, IsFoundAsItIs) {
  const Scatter truth{.excess = 15, .length_mm = 12};  // four times the standard deviation
  std::vector<double> factors;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const auto found = find_scatter_near_entry(made(truth, seed)).front();
    if (found.length_mm > 0) factors.push_back(found.sd_at_entry());
  }
  RecordProperty("found_of_100", static_cast<int>(factors.size()));
  ASSERT_GE(factors.size(), 90U);
  std::ranges::sort(factors);
  RecordProperty("quartiles", std::to_string(factors[factors.size() / 4]) + " to " +
                                  std::to_string(factors[3 * factors.size() / 4]));
  EXPECT_NEAR(factors[factors.size() / 2], 4, 0.8);
}

TEST(ScatterNearEntry, IsNoneWhereReadingsAreAsGoodEverywhere) {
  int called = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) called += find_scatter_near_entry(made({}, seed)).front().length_mm > 0;
  RecordProperty("called_of_300", called);
  EXPECT_LE(called, 4);  // once in 1000, for each of a few lengths that are not one
}

TEST(ScatterNearEntry, IsTheLikeliestByDenseMatrices) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto recorded = made({.excess = 8, .length_mm = 12}, seed);
    const auto found = find_scatter_near_entry(recorded).front();
    if (!(found.length_mm > 0)) continue;
    const double here = dense_deviance(recorded, {found.excess, found.length_mm});
    EXPECT_LT(here, dense_deviance(recorded, {}) - 13.7) << "seed " << seed;
    for (const double length_mm : {3.0, 6.0, 12.0, 25.0, 50.0})
      for (double log_excess = -2; log_excess <= 4.5; log_excess += 0.25)
        EXPECT_LT(here, dense_deviance(recorded, {std::exp(log_excess), length_mm}) + 0.02)
            << "seed " << seed << ", " << length_mm << " mm, " << std::exp(log_excess);
  }
}

TEST(ScatterNearEntry, WidensWhatIsClaimed) {
  auto recorded = made({.excess = 15, .length_mm = 12}, 7);
  const auto found = find_scatter_near_entry(recorded).front();
  widen_near_entry(recorded);
  EXPECT_EQ(recorded.channels[0].scatter.excess, found.excess);
  for (const Recording& recording : recorded.recordings) {
    EXPECT_NEAR(recording.series[0].relative_sd.front(), found.sd_at_entry(), 1e-12);
    EXPECT_NEAR(recording.series[0].relative_sd[4], std::sqrt(1 + found.excess * std::exp(-20 / found.length_mm)),
                1e-12);
  }
}

}  // namespace
}  // namespace bevel::diagnosis
