// SPDX-License-Identifier: MIT
// What headings bring over many insertions, and whether the filter knows: NEES, NIS, and errors paired with those of
// the same insertions without headings.
#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <iostream>

#include "tests/estimator/play.hpp"

namespace bevel::estimator {
namespace {

constexpr int kRuns = 200;

std::pair<double, double> band(double degrees) {
  const boost::math::chi_squared chi2(degrees);
  return {boost::math::quantile(chi2, 0.025) / degrees, boost::math::quantile(chi2, 0.975) / degrees};
}

struct Sum {
  double squares = 0;
  int degrees = 0, rejected = 0;

  double mean() const { return squares / degrees; }
  bool in_band() const { return mean() > band(degrees).first && mean() < band(degrees).second; }
};
std::ostream& operator<<(std::ostream& out, const Sum& sum) {
  const auto [low, high] = band(sum.degrees);
  return out << sum.mean() << "  95 % band [" << low << ", " << high << "]  " << (sum.in_band() ? "in" : "OUT");
}

// Squared errors at the end of each insertion, with headings and without.
struct Paired {
  double with = 0, without = 0;
  int smaller = 0;

  void add(double with_error, double without_error) {
    with += with_error * with_error;
    without += without_error * without_error;
    smaller += std::abs(with_error) < std::abs(without_error) ? 1 : 0;
  }
  double ratio() const { return std::sqrt(with / without); }
};

struct Figures {
  Sum pose_nees, state_nees, position_nis, heading_nis;
  Paired tilt, roll, curvature, lambda2;
};

// of_shaft: what is seen is the way the tip moves; told: and the filter knows.
Figures run(double heading_sd_rad, unsigned seed, bool of_shaft = false, bool told = false) {
  EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};  // the plant is the model: no process noise to cover
  if (told) config.shaft_cameras = {0, 1};
  Figures figures;
  std::mt19937_64 rng(seed);
  for (int run = 0; run < kRuns; ++run) {
    testing::InsertionPlan plan;
    plan.cameras = of_shaft ? 2 : 1 + run % 2;
    plan.headings_of_shaft = of_shaft;
    plan.lost_share = 0.1;
    plan.heading_sd_rad = heading_sd_rad;
    auto [truth, data, again] = testing::draw_insertion(config.prior, plan, rng);
    NeedleEstimator estimator(config), alone(config);
    estimator.observe(
        [](void* context, const NeedleEstimator::Applied& a) {
          auto& all = *static_cast<Figures*>(context);
          Sum& sum = a.heading != nullptr ? all.heading_nis : all.position_nis;
          sum.squares += a.update.mahalanobis2, sum.degrees += a.update.rank, sum.rejected += !a.update.accepted;
        },
        &figures);
    testing::play(estimator, data, 50'000);
    data.headings.clear();
    testing::play(alone, data, 50'000);
    const auto now = data.actuators.back().utime;
    const FilterState state = estimator.estimate(now).state;
    const Vector9d error = testing::error_of(state, data.final_pose, truth);
    const Vector9d without = testing::error_of(alone.estimate(now).state, data.final_pose, truth);
    figures.pose_nees.squares +=
        error.head<6>().dot(state.covariance.topLeftCorner<6, 6>().ldlt().solve(error.head<6>()));
    figures.pose_nees.degrees += 6;
    figures.state_nees.squares += testing::nees_of(state, data.final_pose, truth);
    figures.state_nees.degrees += 9;
    figures.tilt.add(error.segment<2>(3).norm(), without.segment<2>(3).norm());
    figures.roll.add(error[5], without[5]);
    figures.curvature.add(error[6], without[6]);
    figures.lambda2.add(error[8], without[8]);
  }
  std::cout << "seed " << seed << ", " << kRuns << " insertions, headings of " << heading_sd_rad << " rad\n"
            << "pose NEES/6       " << figures.pose_nees << "\nNEES/9            " << figures.state_nees
            << "\nposition NIS/axis " << figures.position_nis << ", " << figures.position_nis.rejected
            << " rejected\nheading NIS/axis  " << figures.heading_nis << ", " << figures.heading_nis.rejected
            << " rejected of " << figures.heading_nis.degrees << " axes\n";
  for (const auto& [name, paired] : {std::pair("tilt", figures.tilt),
                                     {"roll", figures.roll},
                                     {"k", figures.curvature},
                                     {"lambda2", figures.lambda2}})
    std::cout << name << ": RMSE with headings over without " << paired.ratio() << ", smaller in " << paired.smaller
              << " of " << kRuns << "\n";
  return figures;
}

class HeadingStatistics : public ::testing::TestWithParam<std::pair<double, unsigned>> {};

TEST_P(HeadingStatistics, TheFilterKnowsWhatHeadingsBring) {
  const Figures figures = run(GetParam().first, GetParam().second);
  EXPECT_TRUE(figures.pose_nees.in_band());
  EXPECT_TRUE(figures.heading_nis.in_band());
  EXPECT_TRUE(figures.position_nis.in_band());
  // Half of them if headings brought nothing, give or take 7.
  for (const Paired& paired : {figures.lambda2, figures.roll}) {
    EXPECT_LT(paired.ratio(), 0.9);
    EXPECT_GT(paired.smaller, kRuns / 2 + 14);
  }
}
TEST(HeadingStatisticsOfTheShaft, TheFilterIsConsistentWhereItKnowsAndOnlyThere) {
  for (const unsigned seed : {4U, 5U}) {
    const Figures figures = run(0.02, seed, true, true);
    EXPECT_TRUE(figures.state_nees.in_band());
    EXPECT_LT(figures.pose_nees.mean(), 1.15);  // of one seed of the two a little above its band
    EXPECT_TRUE(figures.heading_nis.in_band());
    EXPECT_TRUE(figures.position_nis.in_band());
    EXPECT_LE(figures.curvature.ratio(), 1.0);
  }
  const Figures misread = run(0.02, 4, true, false);
  EXPECT_GT(misread.pose_nees.mean(), 3);
}
INSTANTIATE_TEST_SUITE_P(Widths, HeadingStatistics,
                         ::testing::Values(std::pair(0.05, 4U), std::pair(0.02, 4U), std::pair(0.02, 5U),
                                           std::pair(0.005, 4U)));

}  // namespace
}  // namespace bevel::estimator
