// SPDX-License-Identifier: MIT
// Instants, whose likelihood has one minimum a reading wide.
#include <bevel/diagnosis/inference/local_minima.hpp>

#include <gtest/gtest.h>

#include <random>

#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// y = level + size from an instant on, in slowly wandering noise.
class Step : public testing::HeldSystem {
 public:
  static constexpr double kAt_s = 3.29, kSize = 1, kSigma = 0.15, kAr1 = 0.99, kFrame_s = 1.0 / 30;
  explicit Step(unsigned seed) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = kFrame_s;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    Series series;
    double error = kSigma * normal(random);
    for (std::size_t i = 0; i < 270; ++i) {
      const double time_s = kFrame_s * static_cast<double>(i);
      series.message.push_back(i);
      series.time_s.push_back(time_s);
      series.relative_sd.push_back(1);
      series.measured.push_back((time_s >= kAt_s ? kSize : 0) + error);
      error = kAr1 * error + kSigma * std::sqrt(1 - kAr1 * kAr1) * normal(random);
    }
    data_.recordings = {{.series = {series}, .messages = 270, .duration_s = 9}};
    base_ = {{.name = "level", .lower = -9, .upper = 9, .none = 0, .starts = {}, .prior = normal_prior(0, 1)}};
    Parameter size{.name = "size", .lower = 0, .upper = 9, .none = 0, .starts = {1}, .prior = normal_prior(0, 3)};
    Parameter at{.name = "at_s",
                 .lower = 0,
                 .upper = 9,
                 .none = 0,
                 .starts = {},
                 .prior = {},
                 .scope = Scope::instant,
                 .jumps = true};
    effects_ = {{"step", "step", {size, at}}};
  }
  bool predict(const ModelSet& set, std::size_t, const VectorXd& shared, const VectorXd& local, bool derivatives,
               Prediction& out) const override {
    const auto& times = data_.recordings[0].series[0].time_s;
    const auto n = static_cast<Index>(times.size());
    VectorXd happened = VectorXd::Zero(n);
    for (Index i = 0; i < n && !set.empty() && local[0] > 0; ++i)
      happened[i] = times[static_cast<std::size_t>(i)] >= local[0] ? 1 : 0;
    out.reading = VectorXd::Constant(n, shared[0]) + (set.empty() ? 0 : shared[1]) * happened;
    if (!derivatives) return true;
    out.by_shared = MatrixXd::Ones(n, shared.size());
    if (!set.empty()) out.by_shared.col(1) = happened;
    out.by_local = MatrixXd::Zero(n, local.size());
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }
};

Noise noise_of_step() {
  Noise noise;
  noise.sigma = {Step::kSigma};
  noise.ar1 = Step::kAr1;
  noise.frame_s = Step::kFrame_s;
  return noise;
}

TEST(Instants, AreFoundWhereReadingsJumpInNoiseThatWanders) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Step system(seed);
    const Likelihood likelihood(system, Readings(1), noise_of_step());
    const Layout layout(system, {0});
    // From where another recording's fit put it: a wrong instant costs two jumps, wherever it is.
    for (const double from_s : {0.0, 4.0}) {
      Fit there = fit(likelihood, layout, VectorXd{{0, Step::kSize}}, {VectorXd::Constant(1, from_s)},
                      {.nuisance_sd = VectorXd::Zero(0), .curves = {}}, {}, {.fixed = {0, 1}});
      ASSERT_TRUE(there.valid);
      scan_locals(likelihood, {}, there);
      EXPECT_NEAR(there.local[0][0], Step::kAt_s, Step::kFrame_s) << "seed " << seed << ", from " << from_s << " s";
    }
  }
}

// The same with a jump by 5 at 6 s and back at 7 s that is no step: a curve over time, which can jump there.
class StepBesideAHump final : public Step {
 public:
  static constexpr int kValues = 6;
  explicit StepBesideAHump(unsigned seed) : Step(seed) {
    curves_ = {{.component = "reading", .unit = "mm", .covariate = "time_s", .at = {0, 6, 6.01, 7, 7.01, 9}}};
    Series& series = data_.recordings[0].series[0];
    const VectorXd hump = hats() * VectorXd{{0, 0, 5, 5, 0, 0}};
    for (std::size_t i = 0; i < series.measured.size(); ++i) series.measured[i] += hump[static_cast<Index>(i)];
  }
  // Linear between the places.
  MatrixXd hats() const {
    const auto& times = data_.recordings[0].series[0].time_s;
    const auto& at = curves_[0].at;
    MatrixXd out = MatrixXd::Zero(static_cast<Index>(times.size()), kValues);
    for (Index i = 0; i < out.rows(); ++i) {
      const double time_s = times[static_cast<std::size_t>(i)];
      std::size_t k = 0;
      while (k + 2 < at.size() && time_s >= at[k + 1]) ++k;
      const double share = (time_s - at[k]) / (at[k + 1] - at[k]);
      out(i, static_cast<Index>(k)) = 1 - share;
      out(i, static_cast<Index>(k) + 1) = share;
    }
    return out;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return hats(); }
};

// A scan sees no curve: what the curve explains is not for the instants to explain.
TEST(Instants, StayWhereTheyAreLikelierBesideACurve) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const StepBesideAHump system(seed);
    const Likelihood likelihood(system, Readings(1), noise_of_step());
    CurveColumns curve;
    curve.raw = {system.hats()};
    curve.columns = {likelihood.whitened(0, system.hats())};
    curve.covariance = 25 * MatrixXd::Identity(StepBesideAHump::kValues, StepBesideAHump::kValues);
    const Layout layout(system, {0});
    const Scales scales{.nuisance_sd = VectorXd::Zero(0), .curves = {{.curve = 0, .scale = 1, .length = 1}}};
    Fit there = fit(likelihood, layout, VectorXd{{0, Step::kSize}}, {VectorXd::Constant(1, Step::kAt_s)}, scales, curve,
                    {.fixed = {0, 1}});
    ASSERT_TRUE(there.valid);
    scan_locals(likelihood, curve, there);
    EXPECT_NEAR(there.local[0][0], Step::kAt_s, 2 * Step::kFrame_s) << "seed " << seed;
    EXPECT_NEAR(there.curve_values[3] - there.curve_values[4], 5, 0.5) << "seed " << seed;
  }
}

}  // namespace
}  // namespace bevel::inference
