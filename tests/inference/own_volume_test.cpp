// SPDX-License-Identifier: MIT
// What each recording has of its own, integrated out: against the density of the readings in full.
#include <bevel/diagnosis/inference/own_volume.hpp>

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include <bevel/diagnosis/inference/evidence.hpp>
#include <bevel/diagnosis/inference/nuisances.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kReadings = 40;
constexpr std::size_t kRecordings = 6;
constexpr double kSigma = 0.2, kSpread = 0.3, kGrowth = 2;

// y = growth t + exp(kGrowth growth) own_r t^2 + white noise: where the path grows faster, so does what a recording has
// of its own; or without that factor.
class Paths final : public testing::HeldSystem {
 public:
  static constexpr double kTrue = 0.3;
  Paths(bool grows, unsigned seed) : grows_(grows) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = 1;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (std::size_t r = 0; r < kRecordings; ++r) {
      const VectorXd path = reading(kTrue, kSpread * normal(random));
      std::vector<double> measured;
      for (Index i = 0; i < kReadings; ++i) measured.push_back(path[i] + kSigma * normal(random));
      add_recording(measured, data_.frame_s);
    }
    base_ = {{.name = "growth", .lower = -9, .upper = 9, .none = 0, .starts = {}, .prior = normal_prior(0, 1)}};
    nuisances_ = {{"own", 0}};
    groups_ = {{"own", "1", {0, kSpread}}};
  }
  bool predict(const ModelSet&, std::size_t, const VectorXd& shared, const VectorXd& local, bool derivatives,
               Prediction& out) const override {
    out.reading = reading(shared[0], local[0]);
    if (!derivatives) return true;
    out.by_local = own_column(shared[0]);
    out.by_shared = times() + (grows_ ? kGrowth * local[0] : 0) * own_column(shared[0]);
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }

  // Minus twice the log density of all readings and the prior, with what the recordings have of their own integrated
  // out, but for constants: det of the readings' covariance over that of the noise.
  double deviance(double growth) const {
    const VectorXd column = own_column(growth);
    const MatrixXd covariance =
        kSigma * kSigma * MatrixXd::Identity(kReadings, kReadings) + kSpread * kSpread * column * column.transpose();
    const Eigen::LLT<MatrixXd> factor(covariance);
    const double log_det = 2 * factor.matrixLLT().diagonal().array().log().sum() - 2 * kReadings * std::log(kSigma);
    double sum = growth * growth;
    for (const SeriesSet& set : data_.recordings) {
      const auto& measured = set.series[0].measured;
      const VectorXd error = Eigen::Map<const VectorXd>(measured.data(), kReadings) - reading(growth, 0);
      sum += error.dot(factor.solve(error)) + log_det;
    }
    return sum;
  }
  // From this growth on, what a recording has of its own moves its readings three times as far: its volume has a jump.
  void jump_at(double growth) { jump_at_ = growth; }
  double least_deviant() const {
    double best = 0, least = std::numeric_limits<double>::infinity();
    for (double at = -1; at < 1.5; at += 1e-4)
      if (const double there = deviance(at); there < least) least = there, best = at;
    return best;
  }

 private:
  static VectorXd times() { return VectorXd::LinSpaced(kReadings, 0, 1); }
  VectorXd own_column(double growth) const {
    return (grows_ ? std::exp(kGrowth * growth) : 1) * (growth > jump_at_ ? 3 : 1) * times().cwiseAbs2();
  }
  VectorXd reading(double growth, double own) const { return growth * times() + own * own_column(growth); }

  bool grows_;
  double jump_at_ = std::numeric_limits<double>::infinity();
};

struct Modes {
  Fit joint, integrated;
  double sd = 0;  // of the growth, about the latter
};
Modes modes_of(const Paths& system) {
  Noise noise;
  noise.sigma = {kSigma};
  noise.frame_s = 1;
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(kRecordings), noise);
  const Layout layout(system, {});
  Fit joint = fit(*likelihood, layout, VectorXd::Zero(1), std::vector<VectorXd>(kRecordings, VectorXd::Zero(1)),
                  {.nuisance_sd = VectorXd::Constant(1, kSpread), .curves = {}}, {}, {.tolerance = 1e-9});
  joint.likelihood = likelihood;
  Fit integrated = with_own_integrated(joint, everywhere({}));
  const double variance = solve_about(integrated, linearise(*likelihood, integrated, {}), {}).covariance(0, 0);
  return {.joint = std::move(joint), .integrated = std::move(integrated), .sd = std::sqrt(variance)};
}

TEST(OwnVolume, ModeIsThatOfTheReadingsDensity) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Paths system(true, seed);
    const Modes modes = modes_of(system);
    const Fit& there = modes.integrated;
    ASSERT_TRUE(there.valid);
    EXPECT_NEAR(there.shared[0], system.least_deviant(), 0.2 * modes.sd) << "seed " << seed;
    const auto blocks = linearise(*there.likelihood, there, {});
    EXPECT_NEAR(there.cost + log_own_volume(blocks), system.deviance(there.shared[0]), 1e-6);
    // It is stationary with the slopes that it carries.
    EXPECT_LT(std::abs(solve_about(there, blocks, {}).shared[0]), 0.2 * modes.sd);
  }
}

TEST(OwnVolume, OfAllFittedTogetherTheModeIsBiasedAndOfWhatIsIntegratedItIsNot) {
  constexpr int kSeeds = 200;
  double joint = 0, integrated = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Modes modes = modes_of(Paths(true, seed));
    joint += (modes.joint.shared[0] - Paths::kTrue) / modes.sd;
    integrated += (modes.integrated.shared[0] - Paths::kTrue) / modes.sd;
  }
  std::printf("mean error in standard deviations, %d seeds: joint %.2f, integrated %.2f\n", kSeeds, joint / kSeeds,
              integrated / kSeeds);
  EXPECT_GT(joint / kSeeds, 0.5);
  EXPECT_LT(std::abs(integrated / kSeeds), 4 / std::sqrt(kSeeds));
}

TEST(OwnVolume, WhereItIsTheSameEverywhereTheTwoModesAreOne) {
  const Modes modes = modes_of(Paths(false, 3));
  EXPECT_NEAR(modes.integrated.shared[0], modes.joint.shared[0], 1e-6);
}

TEST(OwnVolume, FitsWithItsSlopesStayAtItsMode) {
  const Paths system(true, 5);
  const Modes modes = modes_of(system);
  const Fit& there = modes.integrated;
  const Fit again = fit(*there.likelihood, there.layout, modes.joint.shared, modes.joint.local, there.scales, {},
                        {.tolerance = 1e-6, .own_volume = there.own_volume});
  EXPECT_GT(std::abs(modes.joint.shared[0] - there.shared[0]), 0.5 * modes.sd);
  EXPECT_NEAR(again.shared[0], there.shared[0], 0.4 * modes.sd);
}

TEST(OwnVolume, BesideAJumpOfItTheModeStaysAndTheLinearModelWithIt) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Paths system(false, seed);
    const Modes smooth = modes_of(system);
    // Slopes are taken across it, and no step along them comes to less.
    system.jump_at(smooth.joint.shared[0] + 0.1 * smooth.sd);
    const Modes modes = modes_of(system);
    const Fit& there = modes.integrated;
    ASSERT_TRUE(there.own_volume);
    EXPECT_NEAR(there.shared[0], smooth.joint.shared[0], 1e-6) << "seed " << seed;
    EXPECT_LT(std::abs(solve_about(there, linearise(*there.likelihood, there, {}), {}).shared[0]), 0.02 * modes.sd);
    const Fit again = fit(*there.likelihood, there.layout, there.shared, there.local, there.scales, {},
                          {.own_volume = there.own_volume});
    EXPECT_NEAR(again.cost, there.cost, 0.01) << "seed " << seed;
  }
}

TEST(OwnVolume, CovarianceIsOverTheStandardDeviations) {
  const Paths system(true, 2);
  const Modes modes = modes_of(system);
  const Fit& there = modes.integrated;
  const auto blocks = linearise(*there.likelihood, there, {});
  const auto at = [&](double spread) {
    auto own = blocks;
    return solve_at(VectorXd::Constant(1, spread), there, own, {});
  };
  const ArrowSolution none = at(0), some = at(kSpread);
  const auto squares = [](const ArrowSolution& s) { return s.covariance(0, 0) + s.shared[0] * s.shared[0]; };
  const MatrixXd both = shared_covariance(there, blocks, {}, VectorXd{{0.25, 0.75}});
  EXPECT_NEAR(both(0, 0), 0.25 * squares(none) + 0.75 * squares(some), 1e-12);
}

}  // namespace
}  // namespace bevel::inference
