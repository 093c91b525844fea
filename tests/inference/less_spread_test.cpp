// SPDX-License-Identifier: MIT
// What a fit has with less spread: by the linear model about it, and about its mode there.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

#include <bevel/diagnosis/inference/evidence.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kReadings = 20;
constexpr std::size_t kRecordings = 5;
constexpr double kSigma = 0.1, kPriorSd = 5, kSpread = 3, kMean = 3;

// y = level + level_r + white noise, or with tanh(level): no level makes up for a spread about a mean of 3 then.
class Levels final : public testing::HeldSystem {
 public:
  explicit Levels(bool saturates) : saturates_(saturates) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = 1;
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    for (std::size_t r = 0; r < kRecordings; ++r) {
      std::vector<double> measured;
      const double own = kMean + 0.02 * normal(random);
      for (Index i = 0; i < kReadings; ++i) measured.push_back(own + kSigma * normal(random));
      add_recording(measured, data_.frame_s);
    }
    base_ = {{.name = "level", .lower = -99, .upper = 99, .none = 0, .starts = {}, .prior = normal_prior(0, kPriorSd)}};
    nuisances_ = {{"level", 0}};
    groups_ = {{"level", "1", {0, kSpread}}};
  }
  bool predict(const ModelSet&, std::size_t, const VectorXd& shared, const VectorXd& local, bool derivatives,
               Prediction& out) const override {
    const double level = saturates_ ? std::tanh(shared[0]) : shared[0];
    out.reading = VectorXd::Constant(kReadings, level + local[0]);
    if (!derivatives) return true;
    out.by_shared = MatrixXd::Constant(kReadings, 1, saturates_ ? 1 - level * level : 1);
    out.by_local = MatrixXd::Ones(kReadings, 1);
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }

  // Log density of the recordings' means where the level is linear, but for what does not depend on the spread.
  double log_evidence(double spread) const {
    VectorXd mean(kRecordings);
    for (std::size_t r = 0; r < kRecordings; ++r) {
      const auto& measured = data_.recordings[r].series[0].measured;
      mean[static_cast<Index>(r)] = Eigen::Map<const VectorXd>(measured.data(), kReadings).mean();
    }
    MatrixXd covariance = MatrixXd::Constant(kRecordings, kRecordings, kPriorSd * kPriorSd);
    covariance.diagonal().array() += kSigma * kSigma / kReadings + spread * spread;
    return -0.5 * (mean.dot(covariance.llt().solve(mean)) + std::log(covariance.determinant()));
  }
  // Squares in standard deviations, of the readings and the level's prior, where recordings do not differ: over a grid.
  double least_cost() const {
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 100'000; ++i) {
      const double at = 1e-4 * i;
      double cost = at * at / (kPriorSd * kPriorSd);
      for (const SeriesSet& set : data_.recordings)
        for (const double y : set.series[0].measured) cost += std::pow((y - std::tanh(at)) / kSigma, 2);
      least = std::min(least, cost);
    }
    return least;
  }

 private:
  bool saturates_;
};

struct Without {
  Fit fit;
  WithLessSpread linear, at_mode;
};
Without without_spread(const Levels& system) {
  Noise noise;
  noise.sigma = {kSigma};
  noise.frame_s = 1;
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(kRecordings), noise);
  const Layout layout(system, {});
  Fit here = fit(*likelihood, layout, VectorXd::Zero(1), std::vector<VectorXd>(kRecordings, VectorXd::Zero(1)),
                 {.nuisance_sd = VectorXd::Constant(1, kSpread), .curves = {}}, {}, {.tolerance = 1e-9});
  here.likelihood = likelihood;
  const auto less = with_less_spread(*likelihood, here, {});
  EXPECT_EQ(less.size(), 1U);
  return {.fit = here, .linear = less.front(), .at_mode = at_its_mode(less.front(), here, {})};
}

TEST(LessSpread, BothAreTheClosedFormWhereTheModelIsLinear) {
  const Levels system(false);
  const Without without = without_spread(system);
  const double expected = system.log_evidence(0) - system.log_evidence(kSpread) +
                          log_prior_of_spread(system, VectorXd::Zero(1)) -
                          log_prior_of_spread(system, VectorXd::Constant(1, kSpread));
  EXPECT_GT(expected, 1);  // they do not differ
  EXPECT_NEAR(without.linear.log_change, expected, 1e-5);
  EXPECT_NEAR(without.at_mode.log_change, expected, FitRules{}.tolerance / 2);  // of a cost: twice a logarithm
}

TEST(LessSpread, WhereItIsNotTheModeSaysWhatTheLinearModelDoesNot) {
  const Levels system(true);
  const Without without = without_spread(system);
  EXPECT_GT(without.linear.log_change, -20);  // it takes the level to where the recordings are
  EXPECT_LT(without.at_mode.log_change, -1e4);
  EXPECT_NEAR(without.at_mode.fit.cost, system.least_cost(), 0.1);
  // But for the volumes, a few units each.
  EXPECT_NEAR(without.at_mode.log_change, -0.5 * (system.least_cost() - without.fit.cost), 30);
}

// By a noise of other size the mode is elsewhere, where the level hardly shows: that says nothing of the two noises.
TEST(LessSpread, ByAnotherNoiseTheReadingsSayInProportionToThatAlone) {
  const Levels system(true);
  const Fit here = without_spread(system).at_mode.fit;
  Noise larger = here.likelihood->noise();
  larger.sigma = {5 * kSigma};
  const auto to = std::make_shared<const Likelihood>(*here.likelihood, larger);
  const Moved moved = moved_to(to, here, Discrepancy(*here.likelihood, here));
  ASSERT_TRUE(moved.fit.valid);
  EXPECT_GT(std::abs(moved.fit.shared[0] - here.shared[0]), 1e-3);
  EXPECT_NEAR(moved.share_before, 25, 1e-9);
}

}  // namespace
}  // namespace bevel::inference
