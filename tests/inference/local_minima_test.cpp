// Instants, whose likelihood has one minimum a reading wide.
#include "diagnosis/inference/local_minima.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// y = level + size from an instant on, in slowly wandering noise.
class Step final : public testing::HeldSystem {
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

TEST(Instants, AreFoundWhereReadingsJumpInNoiseThatWanders) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Step system(seed);
    Noise noise;
    noise.sigma = {Step::kSigma};
    noise.ar1 = Step::kAr1;
    noise.frame_s = Step::kFrame_s;
    const Likelihood likelihood(system, Readings(1), noise);
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

}  // namespace
}  // namespace bevel::inference
