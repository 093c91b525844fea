// SPDX-License-Identifier: MIT
// An instant from which on readings go another way: no jump says where it is, only where they are later.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>

#include <bevel/diagnosis/inference/evidence.hpp>
#include <bevel/diagnosis/inference/local_minima.hpp>
#include <bevel/diagnosis/inference/log_sum.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// y = slope t + bend (t - at) from an instant on, in white noise.
class Knee final : public testing::HeldSystem {
 public:
  static constexpr double kAt_s = 3.3, kSlope = 0.4, kBend = 0.5, kSigma = 0.3, kFrame_s = 0.05, kPriorSd = 2;
  static constexpr Index kReadings = 160;
  explicit Knee(unsigned seed) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = kFrame_s;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::vector<double> measured;
    const VectorXd y = kSlope * times() + kBend * after(kAt_s);
    for (Index i = 0; i < kReadings; ++i) measured.push_back(y[i] + kSigma * normal(random));
    add_recording(measured, kFrame_s);
    base_ = {{.name = "slope", .lower = -9, .upper = 9, .none = 0, .starts = {}, .prior = normal_prior(0, kPriorSd)}};
    Parameter bend{.name = "bend", .lower = -9, .upper = 9, .none = 0, .starts = {1}, .prior = {}};
    bend.prior = normal_prior(0, kPriorSd);
    Parameter at{.name = "at_s",
                 .lower = 0,
                 .upper = 99,
                 .none = 0,
                 .starts = {},
                 .prior = flat_prior(0, duration_s()),
                 .scope = Scope::instant};
    effects_ = {{"knee", "knee", {bend, at}}};
  }
  double duration_s() const { return data_.recordings[0].duration_s; }
  bool predict(const ModelSet& set, std::size_t, const VectorXd& shared, const VectorXd& local, bool derivatives,
               Prediction& out) const override {
    const bool bends = !set.empty() && local[0] > 0;
    const VectorXd later = bends ? after(local[0]) : VectorXd(VectorXd::Zero(kReadings));
    out.reading = shared[0] * times();
    if (bends) out.reading += shared[1] * later;
    if (!derivatives) return true;
    out.by_shared = times();
    out.by_local = MatrixXd::Zero(kReadings, local.size());
    if (set.empty()) return true;
    out.by_shared.conservativeResize(Eigen::NoChange, 2);
    out.by_shared.col(1) = later;
    if (bends) out.by_local = -shared[1] * (later.array() > 0).cast<double>().matrix();
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }

  // The posterior over the instant, by its every value: of the slope its mean and deviation, and the evidence.
  struct Integrated {
    double mean = 0, sd = 0, log_evidence = 0;
  };
  Integrated integrated(double sigma, double ar1) const {
    const auto white = [&](VectorXd column) {
      for (Index i = kReadings - 1; i > 0; --i)
        column[i] = (column[i] - ar1 * column[i - 1]) / std::sqrt(1 - ar1 * ar1);
      return VectorXd(column / sigma);
    };
    const auto& measured = data_.recordings[0].series[0].measured;
    const VectorXd y = white(Eigen::Map<const VectorXd>(measured.data(), kReadings));
    std::vector<double> logs, means, variances;
    for (double at_s = 0.001; at_s < duration_s(); at_s += 0.002) {
      MatrixXd Z(kReadings, 2);
      Z << white(times()), white(after(at_s));
      const MatrixXd H = Z.transpose() * Z + MatrixXd::Identity(2, 2) / (kPriorSd * kPriorSd);
      const VectorXd g = Z.transpose() * y;
      const Eigen::LLT<MatrixXd> factor(H);
      const VectorXd mode = factor.solve(g);
      logs.push_back(-0.5 * (y.squaredNorm() - g.dot(mode)) -
                     0.5 * (2 * factor.matrixLLT().diagonal().array().log().sum() + 4 * std::log(kPriorSd)));
      means.push_back(mode[0]);
      variances.push_back(factor.solve(MatrixXd::Identity(2, 2))(0, 0));
    }
    Integrated out;
    const double all = log_sum(logs);
    double squares = 0;
    for (std::size_t i = 0; i < logs.size(); ++i) {
      const double share = std::exp(logs[i] - all);
      out.mean += share * means[i];
      squares += share * (variances[i] + means[i] * means[i]);
    }
    out.sd = std::sqrt(squares - out.mean * out.mean);
    // One recording, in which it happened: Beta(kHappens, kHappensNot) of its mean.
    out.log_evidence = all - std::log(static_cast<double>(logs.size())) - kReadings * std::log(sigma) -
                       0.5 * (kReadings - 1) * std::log(1 - ar1 * ar1) + std::log(kHappens / (kHappens + kHappensNot));
    return out;
  }

 private:
  static VectorXd times() { return VectorXd::LinSpaced(kReadings, 0, kFrame_s * (kReadings - 1)); }
  static VectorXd after(double at_s) { return (times().array() - at_s).cwiseMax(0); }
};

TEST(Knee, AllStartsEndInOneModeWhoseVolumeIsThatOfThePosterior) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const Knee system(seed);
    Noise noise;
    noise.sigma = {Knee::kSigma};
    noise.frame_s = Knee::kFrame_s;
    const auto likelihood = std::make_shared<const Likelihood>(system, Readings(1), noise);
    const Layout layout(system, {0});
    const Knee::Integrated expected = system.integrated(Knee::kSigma, 0);
    for (const double from_s : {2.0, 3.0, 4.5}) {
      Fit there = fit(*likelihood, layout, VectorXd{{0.3, 0.7}}, {VectorXd::Constant(1, from_s)},
                      {.nuisance_sd = VectorXd::Zero(0), .curves = {}}, {}, {.tolerance = 1e-4});
      ASSERT_TRUE(there.valid);
      there.likelihood = likelihood;
      const auto solution = solve_about(there, linearise(*likelihood, there, {}), {});
      EXPECT_NEAR(there.shared[0], expected.mean, 0.4 * expected.sd) << "seed " << seed << ", from " << from_s;
      EXPECT_NEAR(std::sqrt(solution.covariance(0, 0)), expected.sd, 0.15 * expected.sd) << "seed " << seed;
      const Evaluated whole = evaluate(*likelihood, layout, there.shared, there.local, VectorXd::Zero(0));
      const Noise& fitted = whole.fit.likelihood->noise();
      EXPECT_NEAR(whole.log_evidence, system.integrated(fitted.sigma[0], fitted.ar1).log_evidence, 0.3)
          << "seed " << seed << ", from " << from_s;
    }
  }
}

}  // namespace
}  // namespace bevel::inference
