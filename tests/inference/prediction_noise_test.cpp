// SPDX-License-Identifier: MIT
// The noise by which recordings are predicted: simulated recordings that differ, one channel white and one that drifts.
#include <bevel/diagnosis/inference/prediction_noise.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kStops = 21;
constexpr Index kReadings = Index{2} * kStops;  // two channels
constexpr std::size_t kRecordings = 5;

// An offset and a slope that all recordings share in each of two channels; each has an offset and a slope of its own.
class TwoChannels final : public testing::HeldSystem {
 public:
  static constexpr double kWhite = 0.08, kDrifting = 0.5, kAr1 = 0.9;

  explicit TwoChannels(std::uint64_t seed) {
    groups_ = {{"offset", "mm", {0, 0.05, 0.12, 0.3, 0.8}}, {"slope", "mm", {0, 0.1, 0.3, 0.9}}};
    nuisances_ = {{"offset_0", 0}, {"offset_1", 0}, {"slope_0", 1}, {"slope_1", 1}};
    const auto parameter = [](const char* name) {
      return Parameter{.name = name, .lower = -10, .upper = 10, .none = 0, .starts = {}, .prior = normal_prior(0, 1)};
    };
    base_ = {parameter("offset_0"), parameter("offset_1"), parameter("slope_0"), parameter("slope_1")};
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const auto draw = [&](double sd) { return sd * normal(random); };
    // As the prior has it: none, or one of the others.
    std::vector<double> sd;
    for (const auto& group : groups_) {
      const auto& values = group.standard_deviations;
      const bool none = std::bernoulli_distribution(0.5)(random);
      sd.push_back(none ? 0 : values[std::uniform_int_distribution<std::size_t>(1, values.size() - 1)(random)]);
    }
    VectorXd shared(4);
    for (double& value : shared) value = draw(1);
    data_.claimed_sd = {kWhite, kDrifting};
    data_.frame_s = 0.2;
    for (std::size_t r = 0; r < kRecordings; ++r) {
      VectorXd all = shared;
      for (Index i = 0; i < 4; ++i) all[i] += draw(sd[static_cast<std::size_t>(i / 2)]);
      const VectorXd path = columns() * all;
      SeriesSet set;
      set.messages = kStops;
      set.duration_s = 0.2 * kStops;
      for (int c = 0; c < 2; ++c) {
        Series series;
        double state = draw(1);
        for (int i = 0; i < kStops; ++i) {
          if (i > 0) state = c == 0 ? draw(1) : kAr1 * state + draw(std::sqrt(1 - kAr1 * kAr1));
          series.message.push_back(static_cast<std::size_t>(i));
          series.time_s.push_back(0.2 * i);
          series.relative_sd.push_back(1);
          series.measured.push_back(path[c * kStops + i] + (c == 0 ? kWhite : kDrifting) * state);
        }
        set.series.push_back(std::move(series));
      }
      data_.recordings.push_back(std::move(set));
    }
  }
  static MatrixXd columns() {
    MatrixXd out = MatrixXd::Zero(kReadings, 4);
    for (int c = 0; c < 2; ++c)
      for (int i = 0; i < kStops; ++i) out(c * kStops + i, c) = 1, out(c * kStops + i, 2 + c) = i / (kStops - 1.0);
    return out;
  }
  bool predict(const ModelSet&, std::size_t, const VectorXd& shared, const VectorXd& local, bool derivatives,
               Prediction& out) const override {
    out.reading = columns() * (shared + local);
    if (derivatives) out.by_shared = out.by_local = columns();
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return MatrixXd::Zero(kReadings, 0); }
};

struct Share {
  double inside = 0, count = 0;
  void add(const Forecast& forecast) {
    for (const double below : forecast.below) inside += below > 0.025 && below < 0.975 ? 1 : 0;
    count += static_cast<double>(forecast.below.size());
  }
  double value() const { return inside / count; }
};

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

Fit settled(const TwoChannels& system) {
  Noise noise;
  noise.sigma = system.data().claimed_sd;
  noise.frame_s = system.data().frame_s;
  const Layout layout(system, {});
  const Likelihood likelihood(system, Readings(kRecordings), noise);
  return evaluate(likelihood, layout, layout.shared_start(), std::vector<VectorXd>(kRecordings, layout.local_start()),
                  Eigen::Vector2d(0.12, 0.3))
      .fit;
}

TEST(PredictionNoise, IntervalsOfSmallSetsHold) {
  constexpr int kSets = 100;
  Share beyond, whole, continued, by_one_autocorrelation;
  std::vector<double> white, white_ar1, drifting_ar1;
  for (int set = 0; set < kSets; ++set) {
    const TwoChannels system(static_cast<std::uint64_t>(1000 + set));
    Fit fit = settled(system);
    ASSERT_TRUE(fit.valid);
    const auto about = [&](std::size_t r) { return with_mean({&fit, linearise(*fit.likelihood, fit, {})}, r); };
    const NuisanceGrid grid = nuisance_grid(system);
    const auto predict = [&](std::size_t r, const NuisanceGrid& spreads) {
      return forecast(about(r), about(r), {}, spreads, r, time_of_share(system.data().recordings[r], 1.0 / 3));
    };
    for (std::size_t r = 0; r < kRecordings; ++r) {
      const auto found = predict(r, likely_part(grid, spread_weights(about(kRecordings), {}, grid)));
      ASSERT_TRUE(found);
      by_one_autocorrelation.add(found->continued);
    }
    const Noise noise = prediction_noise(about(kRecordings), {});
    white.push_back(noise.sigma[0]), white_ar1.push_back(noise.own_ar1[0]), drifting_ar1.push_back(noise.own_ar1[1]);
    fit.likelihood = std::make_shared<const Likelihood>(*fit.likelihood, noise);
    const NuisanceGrid spreads = likely_part(grid, spread_weights(about(kRecordings), {}, grid));
    for (std::size_t r = 0; r < kRecordings; ++r) {
      const auto found = predict(r, spreads);
      ASSERT_TRUE(found);
      whole.add(found->all), beyond.add(found->beyond), continued.add(found->continued);
    }
  }
  std::printf(
      "%d sets of %zu: of %.0f readings of new recordings %.1f %% in 95 %%, of %.0f continued %.1f %%; by one "
      "autocorrelation %.1f %%; median of the white one's deviation %.4f\n",
      kSets, kRecordings, whole.count, 100 * whole.value(), continued.count, 100 * continued.value(),
      100 * by_one_autocorrelation.value(), quantile(white, 0.5));
  EXPECT_NEAR(whole.value(), 0.95, 0.02);
  EXPECT_NEAR(continued.value(), 0.95, 0.02);
  // Each channel's own: what is white is not taken for a drift, and the deviation is not that of residuals at the mode.
  // (What recordings differ by may still pass for a drift, where they are few: in one set of twenty.)
  EXPECT_NEAR(quantile(white, 0.5) / TwoChannels::kWhite, 1, 0.03);
  EXPECT_LT(quantile(white_ar1, 0.9), 0.2);
  EXPECT_GT(quantile(drifting_ar1, 0.1), 0.6);
}

}  // namespace
}  // namespace bevel::inference
