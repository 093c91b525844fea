// SPDX-License-Identifier: MIT
// A step that happened in some recordings, and what these have of their own took up: from there an instant is worth
// nothing anywhere, with all else as it is.
#include <gtest/gtest.h>

#include <random>

#include <bevel/diagnosis/inference/absorbed_instants.hpp>
#include <bevel/diagnosis/inference/local_minima.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kReadings = 90;
constexpr double kFrame_s = 0.1, kSigma = 0.05, kSize = 1, kSlope_sd = 0.1;
constexpr double kAt_s[] = {0, 4.25, 0, 5.05};  // 0: it did not happen

// y = level + slope_r t / T, and from an instant on + size. A ramp takes up five sixths of a step's square.
class StepsAmongRamps final : public testing::HeldSystem {
 public:
  explicit StepsAmongRamps(unsigned seed) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = kFrame_s;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (const double at_s : kAt_s) {
      const double slope = kSlope_sd * normal(random);
      std::vector<double> measured;
      for (Index i = 0; i < kReadings; ++i)
        measured.push_back(slope * ramp(i) + step(i, kSize, at_s) + kSigma * normal(random));
      add_recording(measured, kFrame_s);
    }
    base_ = {{.name = "level", .lower = -9, .upper = 9, .none = 0, .starts = {}, .prior = normal_prior(0, 1)}};
    nuisances_ = {{"slope", 0}};
    groups_ = {{"slope", "1", {0, 1}}};
    effects_ = {
        {"step",
         "step",
         {{.name = "size", .lower = 0, .upper = 9, .none = 0, .starts = {1}, .prior = normal_prior(0, 3)},
          {.name = "at_s", .lower = 0, .upper = 9, .none = 0, .starts = {}, .prior = {}, .scope = Scope::instant}}}};
  }
  bool predict(const ModelSet& set, std::size_t, const VectorXd& shared, const VectorXd& local, bool derivatives,
               Prediction& out) const override {
    const bool steps = !set.empty();
    out.reading.resize(kReadings);
    out.by_shared = MatrixXd::Zero(kReadings, derivatives ? shared.size() : 0);
    out.by_local = MatrixXd::Zero(kReadings, derivatives ? local.size() : 0);
    for (Index i = 0; i < kReadings; ++i) {
      out.reading[i] = shared[0] + local[0] * ramp(i) + (steps ? step(i, shared[1], local[1]) : 0);
      if (!derivatives) continue;
      out.by_shared(i, 0) = 1;
      out.by_local(i, 0) = ramp(i);
      if (!steps) continue;
      out.by_shared(i, 1) = step(i, 1, local[1]);
      if (local[1] > 0 && std::abs(when(i) - local[1]) < kFrame_s) out.by_local(i, 1) = -shared[1] / (2 * kFrame_s);
    }
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }

 private:
  static double when(Index i) { return kFrame_s * static_cast<double>(i); }
  static double ramp(Index i) { return static_cast<double>(i) / kReadings; }
  // Within a frame to either side, so that it can be fitted.
  static double step(Index i, double size, double at_s) {
    return at_s > 0 ? size * std::clamp((when(i) - at_s) / (2 * kFrame_s) + 0.5, 0.0, 1.0) : 0;
  }
};

TEST(Instants, AreFoundWhereWhatARecordingHasOfItsOwnTookThemUp) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const StepsAmongRamps system(seed);
    Noise noise;
    noise.sigma = {kSigma};
    noise.frame_s = kFrame_s;
    const Likelihood likelihood(system, Readings(std::size(kAt_s)), noise);
    const Layout layout(system, {0});
    const std::vector<VectorXd> none(std::size(kAt_s), VectorXd::Zero(2));
    const Scales scales{.nuisance_sd = VectorXd::Constant(1, 1), .curves = {}};
    for (const double size : {kSize, 1.8 * kSize}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", from a size of " + std::to_string(size));
      Fit there = fit(likelihood, layout, VectorXd{{0, size}}, none, scales, {}, {.fixed = {1}});
      ASSERT_TRUE(there.valid);
      ASSERT_GT(there.local[1][0], 1) << "the slope took it up";
      Fit scanned = there;
      scan_locals(likelihood, {}, scanned);
      EXPECT_EQ(scanned.local[1][1], 0) << "nothing else to be shown";
      look_from_alike(likelihood, {}, there);
      EXPECT_NEAR(there.shared[1], kSize, 0.1);
      for (std::size_t r = 0; r < std::size(kAt_s); ++r)
        EXPECT_NEAR(there.local[r][1], kAt_s[r], kFrame_s) << "recording " << r;
      EXPECT_LT(there.cost, 1.3 * static_cast<double>(kReadings * std::ssize(kAt_s)));
    }
  }
}

}  // namespace
}  // namespace bevel::inference
