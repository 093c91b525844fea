// SPDX-License-Identifier: MIT
// The likelihood along one unknown, and from one effect to another, against closed forms.
#include <bevel/diagnosis/inference/profile.hpp>

#include <gtest/gtest.h>

#include <boost/math/distributions/normal.hpp>

#include <bevel/diagnosis/inference/local_minima.hpp>
#include <bevel/diagnosis/inference/search.hpp>
#include "tests/inference/linear_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::all_readings;
using testing::LinearSystem;
using testing::white;

constexpr Index kParabola = 2, kStep = 3;

// Posterior of offset, slope, parabola and step without bounds.
struct Normal {
  VectorXd mean;
  MatrixXd covariance;
};
Normal posterior_of(const LinearSystem& system) {
  const MatrixXd X = LinearSystem::design({0, 1});
  const VectorXd y = all_readings(system);
  MatrixXd information = VectorXd{{1, 1, 4, 4}}.asDiagonal();  // 1 / prior variances
  VectorXd pull = VectorXd::Zero(4);
  for (Index r = 0; r < y.size() / X.rows(); ++r) {
    information += X.transpose() * X / (system.sigma * system.sigma);
    pull += X.transpose() * y.segment(r * X.rows(), X.rows()) / (system.sigma * system.sigma);
  }
  return {information.ldlt().solve(pull), information.inverse()};
}

struct Moments {
  double step = 0, step_sd = 0;
};
Moments moments_of(const std::vector<ProfileStep>& steps) {
  Moments out;
  double square = 0;
  for (const ProfileStep& one : steps) {
    out.step += one.weight * one.middle;
    square += one.weight * (one.middle * one.middle + one.width * one.width / 12);
  }
  out.step_sd = std::sqrt(square - out.step * out.step);
  return out;
}
struct AlongTheStep {
  Moments by_profile, by_refits;
  bool parabola = false;  // nothing is to be refitted
};
AlongTheStep moments_along_the_step(const LinearSystem& system) {
  const Likelihood likelihood(system, Readings(system.data().recordings.size()), white(system));
  const Layout layout(system, {0, 1});
  const std::vector<VectorXd> local(system.data().recordings.size(), layout.local_start());
  const Fit there = fit(likelihood, layout, layout.shared_start(), local,
                        {.nuisance_sd = VectorXd::Zero(1), .curves = {}}, {}, {.tolerance = 1e-9});
  const CurveColumns none;
  const Profile profile(likelihood, none, there);
  const VectorXd alone = VectorXd::Unit(there.shared.size(), kStep);
  return {.by_profile = moments_of(posterior_along(profile, kStep, 0.02)),
          .by_refits = moments_of(posterior_by_refits(likelihood, none, there, kStep, alone, 0.02, false)),
          .parabola = posterior_by_refits(likelihood, none, there, kStep, alone, 0.02, true).empty()};
}

TEST(Profile, OfALinearModelIsTheNormalPosterior) {
  const LinearSystem system(4, 7, 0.3, 0, 0);
  const Normal expected = posterior_of(system);
  const double sd = std::sqrt(expected.covariance(kStep, kStep));
  const AlongTheStep along = moments_along_the_step(system);
  for (const Moments& found : {along.by_profile, along.by_refits}) {
    EXPECT_NEAR(found.step, expected.mean[kStep], 0.02 * sd);
    EXPECT_NEAR(found.step_sd, sd, 0.02 * sd);
  }
}

// Slopes of the own volume that hold nowhere, as about instants, move all that follows by the same; the unknown's own
// density does not have it.
TEST(Profile, BesideSlopesThatDoNotHoldItIsAsWideAsWithoutThem) {
  const LinearSystem system(4, 7, 0.3, 0, 0);
  const Likelihood likelihood(system, Readings(4), white(system));
  const Layout layout(system, {0, 1});
  Fit there = fit(likelihood, layout, layout.shared_start(), std::vector<VectorXd>(4, layout.local_start()),
                  {.nuisance_sd = VectorXd::Zero(1), .curves = {}}, {}, {.tolerance = 1e-9});
  const Normal expected = posterior_of(system);
  const double sd = std::sqrt(expected.covariance(kStep, kStep));
  const double slope = 3 / std::sqrt(expected.covariance(0, 0)) / 4;  // in all the cost of three standard deviations
  OwnVolume volume{.about = there.shared, .slope = {}};
  volume.slope.assign(4, slope * VectorXd::Unit(there.shared.size(), 0));
  there.own_volume = std::make_shared<const OwnVolume>(volume);
  const VectorXd by_step = expected.covariance.col(kStep) / (sd * sd);
  const Moments found = moments_of(posterior_by_refits(likelihood, {}, there, kStep, by_step, sd, false));
  EXPECT_NEAR(found.step, expected.mean[kStep], 0.02 * sd);
  EXPECT_NEAR(found.step_sd, sd, 0.02 * sd);
}

// Two standard deviations away the cost of a linear model is four more, if it is told how far a deviation is.
TEST(Profile, NothingIsRefittedOfALinearModel) {
  const LinearSystem system(4, 7, 0.3, 0, 0);
  const Likelihood likelihood(system, Readings(4), white(system));
  const Layout layout(system, {0, 1});
  const Fit there = fit(likelihood, layout, layout.shared_start(), std::vector<VectorXd>(4, layout.local_start()),
                        {.nuisance_sd = VectorXd::Zero(1), .curves = {}}, {}, {.tolerance = 1e-9});
  const Normal expected = posterior_of(system);
  const double sd = std::sqrt(expected.covariance(kStep, kStep));
  const VectorXd by_step = expected.covariance.col(kStep) / (sd * sd);
  EXPECT_TRUE(posterior_by_refits(likelihood, {}, there, kStep, by_step, sd, true).empty());
  EXPECT_FALSE(posterior_by_refits(likelihood, {}, there, kStep, by_step, 1.3 * sd, true).empty());
}

TEST(Profile, AtABoundIsTheTruncatedNormal) {
  for (const double beyond_sds : {-0.5, 1.0, 2.5}) {
    LinearSystem system(4, 7, 0.3, 0, 0);
    const Normal free = posterior_of(system);
    const double sd = std::sqrt(free.covariance(kStep, kStep));
    system.least_size(1, free.mean[kStep] + beyond_sds * sd);
    const boost::math::normal normal;
    const double hazard = boost::math::pdf(normal, beyond_sds) / boost::math::cdf(complement(normal, beyond_sds));
    const AlongTheStep along = moments_along_the_step(system);
    EXPECT_FALSE(along.parabola) << beyond_sds;
    for (const Moments& found : {along.by_profile, along.by_refits}) {
      EXPECT_NEAR(found.step, free.mean[kStep] + sd * hazard, 0.03 * sd) << beyond_sds;
      EXPECT_NEAR(found.step_sd, sd * std::sqrt(1 + beyond_sds * hazard - hazard * hazard), 0.03 * sd) << beyond_sds;
    }
  }
}

// y = (1 + gain) slope (1 + feed) t, and a step where (1 + feed) t passes a place: gain and feed are one path, but for
// where the step is.
class TwoScales final : public testing::HeldSystem {
 public:
  static constexpr double kFeed = 0.3, kPlace = 4, kSize = 2, kSigma = 0.01, kWidth = 0.01;
  explicit TwoScales(double size = kSize) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = 0.02;
    Series series;
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal(0, kSigma);
    for (std::size_t i = 0; i < 300; ++i) {
      series.message.push_back(i);
      series.time_s.push_back(0.02 * static_cast<double>(i));
      series.relative_sd.push_back(1);
    }
    for (const double t : series.time_s)
      series.measured.push_back(reading(t, 1, 0, kFeed, kPlace, size) + normal(random));
    data_.recordings = {{.series = {series}, .messages = 300, .duration_s = 6}};
    base_ = {{.name = "slope", .lower = 0.1, .upper = 10, .none = 0, .starts = {}, .prior = normal_prior(1, 0.001)}};
    const auto share = [](const char* name) {
      return Parameter{
          .name = name, .lower = -0.9, .upper = 5, .none = 0, .starts = {0.1}, .prior = normal_prior(0, 1)};
    };
    Parameter place{.name = "place",
                    .lower = 0.1,
                    .upper = 8,
                    .none = std::numeric_limits<double>::quiet_NaN(),
                    .starts = {1, 2, 3, 4, 5, 6},
                    .prior = normal_prior(4, 3)};
    effects_ = {
        {"gain", "gain", {share("gain")}}, {"feed", "feed", {share("feed")}}, {"step", "step", {place, share("size")}}};
  }
  static double reading(double t, double slope, double gain, double feed, double place, double size) {
    // Without a width no derivative says anything of its place.
    const double passed = (t - place / (1 + feed)) / kWidth;
    return (1 + gain) * slope * (1 + feed) * t + size / (1 + std::exp(-passed));
  }
  bool predict(const ModelSet& set, std::size_t r, const VectorXd& shared, const VectorXd&, bool derivatives,
               Prediction& out) const override {
    const auto& times = data_.recordings[r].series[0].time_s;
    const auto n = static_cast<Index>(times.size());
    const auto at = [&](const VectorXd& u) {
      double gain = 0, feed = 0, place = 0, size = 0;
      Index next = 1;
      for (const std::size_t e : set) {
        if (e == 0) gain = u[next++];
        if (e == 1) feed = u[next++];
        if (e == 2) place = u[next], size = u[next + 1], next += 2;
      }
      VectorXd y(n);
      for (Index i = 0; i < n; ++i) y[i] = reading(times[static_cast<std::size_t>(i)], u[0], gain, feed, place, size);
      return y;
    };
    out.reading = at(shared);
    if (!derivatives) return true;
    out.by_shared.resize(n, shared.size());
    out.by_local.resize(n, 0);
    for (Index k = 0; k < shared.size(); ++k) {
      VectorXd more = shared, less = shared;
      more[k] += 1e-6, less[k] -= 1e-6;
      out.by_shared.col(k) = (at(more) - at(less)) / 2e-6;
    }
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }
};

TEST(Replaced, AStepFollowsWhereOneScaleTakesTheOthersPlace) {
  const TwoScales system;
  Noise noise;
  noise.sigma = {TwoScales::kSigma};
  noise.frame_s = 0.02;
  const Likelihood likelihood(system, Readings(1), noise);
  const Scales scales{.nuisance_sd = VectorXd::Zero(0), .curves = {}};
  const Layout wrong(system, {0, 2});
  const std::vector<VectorXd> local(1, VectorXd::Zero(0));
  // As if the gain were it: the step is seen at 4 / 1.3 s.
  const Fit gain = fit(likelihood, wrong, VectorXd{{1, 0.3, 4 / 1.3, 2}}, local, scales);
  ASSERT_TRUE(gain.valid);
  EXPECT_NEAR(gain.shared[2], 4 / 1.3, 0.01);

  const Fit there = replaced(likelihood, {}, gain, 0, 1, VectorXd{{0.3}});
  ASSERT_TRUE(there.valid);
  // Before any fit of the new set.
  EXPECT_NEAR(there.shared[1], TwoScales::kFeed, 0.005);
  EXPECT_NEAR(there.shared[2], TwoScales::kPlace, 0.02);
  EXPECT_NEAR(there.shared[3], TwoScales::kSize, 0.02);
}

TEST(Search, WeighsBothNamesOfOnePathBesideAStep) {
  const TwoScales system;
  Noise noise;
  noise.sigma = {TwoScales::kSigma};
  noise.frame_s = 0.02;
  Search search(system, {});
  search.run(Readings(1), noise);
  const auto& visited = search.visited();
  ASSERT_TRUE(visited.contains({0, 2}) && visited.contains({1, 2}));
  // One path: their evidence differs by the prior of the step's place alone.
  EXPECT_NEAR(visited.at({0, 2}).log_posterior(), visited.at({1, 2}).log_posterior(), 0.5);
  EXPECT_GT(visited.at({1, 2}).log_posterior(), search.best().log_posterior() - 1);
}

// Gain and feed without a step are one path: only (1 + gain) (1 + feed) is known, and the priors decide along that
// hyperbola. The closed form: feed = known / (1 + gain) - 1, cost gain^2 + feed^2.
TEST(Profile, FollowsACurvedRidge) {
  const TwoScales system(0);
  Noise noise;
  noise.sigma = {TwoScales::kSigma};
  noise.frame_s = 0.02;
  const Likelihood likelihood(system, Readings(1), noise);
  const Layout layout(system, {0, 1});
  const Fit there = fit(likelihood, layout, VectorXd{{1, 0.1, 0.1}}, std::vector<VectorXd>(1, VectorXd::Zero(0)),
                        {.nuisance_sd = VectorXd::Zero(0), .curves = {}}, {}, {.tolerance = 1e-9});
  ASSERT_TRUE(there.valid);
  const double known = (1 + there.shared[1]) * (1 + there.shared[2]);
  EXPECT_NEAR(known, 1 + TwoScales::kFeed, 0.01);
  const Moments found = moments_of(posterior_by_refits(likelihood, {}, there, 1, VectorXd{{0, 1, -1}}, 0.5, true));
  double sum = 0, first = 0, second = 0;
  const double least = std::pow(there.shared[1], 2) + std::pow(there.shared[2], 2);
  for (double gain = -0.7; gain < 5; gain += 1e-3) {
    const double feed = known / (1 + gain) - 1;
    if (feed < -0.9 || feed > 5) continue;
    const double weight = std::exp(-0.5 * (gain * gain + feed * feed - least));
    sum += weight, first += weight * gain, second += weight * gain * gain;
  }
  const double mean = first / sum, sd = std::sqrt(second / sum - mean * mean);
  EXPECT_NEAR(found.step, mean, 0.05 * sd);
  EXPECT_NEAR(found.step_sd, sd, 0.05 * sd);
}

TEST(Fit, KeepsWhatIsFixed) {
  const LinearSystem system(2, 7, 0.3, 0, 0);
  const Likelihood likelihood(system, Readings(2), white(system));
  const Layout layout(system, {0, 1});
  VectorXd start = layout.shared_start();
  start[kParabola] = 0.123;
  const Fit there = fit(likelihood, layout, start, std::vector<VectorXd>(2, layout.local_start()),
                        {.nuisance_sd = VectorXd::Zero(1), .curves = {}}, {}, {.fixed = {kParabola}});
  ASSERT_TRUE(there.valid);
  EXPECT_EQ(there.shared[kParabola], 0.123);
  EXPECT_NEAR(there.shared[0], 0.3, 0.1);
}

}  // namespace
}  // namespace bevel::inference
