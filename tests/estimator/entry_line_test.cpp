// SPDX-License-Identifier: MIT
#include <bevel/estimator/entry_line.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>

#include "tests/estimator/coloured.hpp"
#include "tests/estimator/play.hpp"

namespace bevel::estimator {
namespace {

using testing::agar_config;
// Each reading 50 ms after its capture, through a frame that is turned by `turned`.
EntryLine watched(const EstimatorConfig& config, const testing::Insertion& data, const Eigen::Vector3d& turned_rad) {
  EntryLine entry(config);
  const Eigen::Matrix3d frame = model::exp_so3(turned_rad);
  std::size_t next = 0;
  for (const model::ActuatorState& axes : data.actuators) {
    for (; next < data.measurements.size() && data.measurements[next].utime + 50'000 < axes.utime; ++next) {
      model::TipMeasurement seen = data.measurements[next];
      seen.position_mm = frame * seen.position_mm;
      entry.add(seen);
    }
    entry.add(axes);
  }
  return entry;
}

struct Share {
  int said = 0, insertions = 0;
  double statistic = 0;   // mean over the 2 that it should be
  double normalised = 0;  // squared error of the slope over its variance, a sum of chi-squares of two
};

// Needles drawn from the prior, but for the tilt. lambda1 goes with the tilt from {A}'s z, so that a path is sloped by
// more than the needle was tilted, about 1.35 times.
Share share_of(const Eigen::Vector3d& turned_rad, double tilt_sd_rad, unsigned seed, double lambda_share = 1) {
  Share share;
  std::mt19937_64 rng(seed);
  EstimatorConfig config = agar_config();
  config.prior.tilt_sd_rad = tilt_sd_rad;
  config.prior.lambda1_sd_per_rad *= lambda_share, config.prior.lambda2_sd *= lambda_share;
  testing::InsertionPlan plan;
  plan.cameras = 2;
  plan.length_mm = 40;
  for (; share.insertions < 200; ++share.insertions) {
    const auto drawn = testing::draw_insertion(config.prior, plan, rng);
    const EntryLine entry = watched(config, drawn.data, turned_rad);
    EXPECT_TRUE(entry.knows());
    share.statistic += entry.statistic() / 2 / 200;
    share.said += entry.is_turned() ? 1 : 0;
    const Eigen::Vector3d goes = model::exp_so3(turned_rad).col(2);
    const Eigen::Vector2d error = entry.slope() - goes.head<2>() / goes.z();  // where nothing else is sloped
    share.normalised += error.squaredNorm() / 2 / (entry.slope_sd() * entry.slope_sd()) / 200;
  }
  return share;
}

constexpr double kTwoDegrees_rad = 2 * std::numbers::pi / 180;
constexpr double kNoTilt_rad = 1e-6;

TEST(EntryLine, KnowsTheSlopeAsWellAsItSays) {
  constexpr unsigned kSeed = 31;
  for (const double turned_rad : {0.0, kTwoDegrees_rad}) {
    const Share share = share_of({turned_rad, 0, 0}, kNoTilt_rad, kSeed);
    std::cout << "seed " << kSeed << ", turned by " << turned_rad << ": squared error " << share.normalised
              << " of the variance, said of " << share.said << " of " << share.insertions << "\n";
    EXPECT_LT(share.normalised, 1.2);
  }
}

// Of a needle whose lambda has been identified: which way it slips is then no excuse.
TEST(EntryLine, FindsATurnedFrameBesideAKnownNeedle) {
  constexpr unsigned kSeed = 34;
  const EstimatorConfig config;
  const Share turned = share_of({kTwoDegrees_rad, 0, 0}, config.entry_slope_sd_rad / 1.35, kSeed, 0.2);
  const Share straight = share_of({0, 0, 0}, config.entry_slope_sd_rad / 1.35, kSeed, 0.2);
  std::cout << "seed " << kSeed << ": said of " << turned.said << " turned ones, of " << straight.said << " others, of "
            << turned.insertions << " each\n";
  EXPECT_GE(turned.said, 110) << "the slopes of insertions hide some: 2 degrees are four of their standard deviations";
  EXPECT_LE(straight.said, 7);
}

TEST(EntryLine, SaysOfOneInsertionInAHundredThatItsFrameIsTurnedWhereSlopesAreAsExpected) {
  constexpr unsigned kSeed = 32;
  const EstimatorConfig config;
  const Share share = share_of({0, 0, 0}, config.entry_slope_sd_rad / 1.35, kSeed);
  std::cout << "seed " << kSeed << ": said of " << share.said << " of " << share.insertions << "\n";
  EXPECT_LE(share.said, 7);
}

TEST(EntryLine, FindsAFrameThatIsTurnedByTwoDegreesWithinThirtyMillimetres) {
  constexpr unsigned kSeed = 33;
  const EstimatorConfig config;
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0.6, 0.8, 0)}) {
    const Share share = share_of(kTwoDegrees_rad * axis, config.entry_slope_sd_rad / 1.35, kSeed);
    std::cout << "seed " << kSeed << ": said of " << share.said << " of " << share.insertions << "\n";
    EXPECT_GE(share.said, 90) << "slopes of insertions, and a lambda that is hardly known, hide some";
  }
  EXPECT_EQ(EntryLine::kTo_mm, 30);
}

// Measurement errors are AR(1) with 0.9 from frame to frame, as [estimator.reading_noise] configures them. A filter
// that ignores the configuration counts each frame as an independent measurement and reports the noise as a slope.
TEST(EntryLine, CountsFramesOfAutocorrelatedNoiseByTheirEffectiveNumber) {
  constexpr unsigned kSeed = 35;
  constexpr int kInsertions = 100;
  constexpr double kFrame_s = 0.033, kRho = 0.9;
  const testing::Colour noise{.share = 0.99, .correlation_s = -kFrame_s / std::log(kRho)};
  const double sigma_mm = 0.4;
  const auto said_of = [&](const Eigen::Vector3d& turned_rad, bool coloured, bool told) {
    std::mt19937_64 rng(kSeed);
    EstimatorConfig config = agar_config();
    config.prior.tilt_sd_rad = config.entry_slope_sd_rad / 1.35;
    if (told) config.reading = {.correlated_share = noise.share, .correlation_s = noise.correlation_s};
    testing::InsertionPlan plan;
    plan.cameras = 2;
    plan.length_mm = 40;
    plan.sigma_mm = coloured ? sigma_mm * std::sqrt(1 - noise.share) : sigma_mm;
    int said = 0;
    for (int i = 0; i < kInsertions; ++i) {
      auto drawn = testing::draw_insertion(config.prior, plan, rng);
      if (coloured) testing::colour(drawn.data, noise, sigma_mm, plan.rate_mm_s, rng);
      said += watched(config, drawn.data, turned_rad).is_turned() ? 1 : 0;
    }
    return said;
  };
  const Eigen::Vector3d turned(0.14, 0, 0);  // 8 degrees: what these few independent measurements can show
  const int untold = said_of({0, 0, 0}, true, false), told = said_of({0, 0, 0}, true, true);
  const int white = said_of({0, 0, 0}, false, false);
  const int found = said_of(turned, true, true), found_white = said_of(turned, false, false);
  std::cout << "seed " << kSeed << ", of " << kInsertions << " insertions, noise of " << sigma_mm
            << " mm: reported falsely with AR(1) " << kRho << " " << untold << " if not configured, " << told
            << " if configured, with white noise " << white << "; of those turned by 8 degrees " << found
            << " with AR(1) configured, " << found_white << " with white noise\n";
  EXPECT_GE(untold, 20) << "or the noise is no test of it";
  EXPECT_LE(told, 5);
  EXPECT_LE(white, 5);
  EXPECT_GE(found, 90);
  EXPECT_GE(found_white, 95);
}

TEST(EntryLine, SaysNothingBeforeItIsDeepEnoughOrWhereItDidNotBeginAtTheEntry) {
  std::mt19937_64 rng(33);
  EstimatorConfig config = agar_config();
  testing::InsertionPlan plan;
  plan.length_mm = 9;
  EXPECT_FALSE(watched(config, testing::draw_insertion(config.prior, plan, rng).data, {0.3, 0, 0}).is_turned());
  plan.length_mm = 40;
  config.start_at_axes = true;
  testing::Insertion data = testing::draw_insertion(config.prior, plan, rng).data;
  for (auto& axes : data.actuators) axes.insertion_mm += 20;
  EXPECT_FALSE(watched(config, data, {0.3, 0, 0}).knows());
}

}  // namespace
}  // namespace bevel::estimator
