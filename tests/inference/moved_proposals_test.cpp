// SPDX-License-Identifier: MIT
// Steps that another effect, which took up their mean, has shifted.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <bevel/diagnosis/inference/proposals.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference::testing {
namespace {

constexpr int kCount = 150;
constexpr double kStep = 1.7, kLag = 0.9, kSigma = 0.1;
constexpr std::size_t kLagging = 0, kSteps = 1;

// Something is pushed at three speeds, as far as 60, and follows: with a lag, in steps of a length, or with both, when
// the steps are counted from where the lag is over. Base: a gain.
class SteppingSystem : public HeldSystem {
 public:
  SteppingSystem(double lag, double step, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    data_.claimed_sd = {kSigma};
    data_.frame_s = 0.1;
    for (std::size_t r = 0; r < 3; ++r) {
      std::vector<double> measured;
      for (int i = 0; i < kCount; ++i) measured.push_back(followed(pushed(r, i) - lag, step) + kSigma * normal(random));
      add_recording(measured, data_.frame_s);
    }
    base_ = {{.name = "gain", .lower = 0.5, .upper = 2, .none = 0, .starts = {}, .prior = normal_prior(1, 0.1)}};
    Parameter size{.name = "lag", .lower = 0, .upper = 10, .none = 0, .starts = {0.5}, .prior = normal_prior(0, 1)};
    Parameter length{
        .name = "step", .lower = 0, .upper = 10, .none = 0, .starts = {}, .prior = normal_prior(0, 2), .shape = true};
    for (int quarters = 4 * 80; quarters >= 4 * 20; --quarters) length.starts.push_back(60 / (0.25 * quarters));
    effects_ = {{.name = "lagging", .label = "lagging", .parameters = {size}},
                {.name = "steps", .label = "steps", .parameters = {length}}};
  }

  bool predict(const ModelSet& set, std::size_t r, const Eigen::VectorXd& shared, const Eigen::VectorXd&,
               bool derivatives, Prediction& out) const override {
    const bool lags = contains(set, kLagging), steps = contains(set, kSteps);
    const double gain = shared[0], lag = lags ? shared[1] : 0, step = steps ? shared[shared.size() - 1] : 0;
    out.reading.resize(kCount);
    if (derivatives) out.by_shared = Eigen::MatrixXd::Zero(kCount, shared.size());
    if (derivatives) out.by_local.resize(kCount, 0);
    for (int i = 0; i < kCount; ++i) {
      const double at = pushed(r, i) - lag;
      out.reading[i] = gain * followed(at, step);
      if (!derivatives) continue;
      out.by_shared(i, 0) = followed(at, step);
      if (lags && !(step > 0)) out.by_shared(i, 1) = -gain;  // a held one does not follow
      if (step > 0) out.by_shared(i, shared.size() - 1) = gain * std::floor(at / step);
    }
    return true;
  }
  Eigen::MatrixXd by_curves(std::size_t, const Eigen::VectorXd&) const override { return {}; }

 private:
  static double pushed(std::size_t r, int i) { return 3 + (0.2 + 0.07 * static_cast<double>(r)) * i; }
  static double followed(double at, double step) { return step > 0 ? step * std::floor(at / step) : at; }
};

class MovedProposals : public ::testing::Test {
 protected:
  // Beside the lag alone, which is the two's mean.
  const SteppingSystem system{kLag, kStep, 5};
  const Likelihood likelihood{system, Readings(3), Noise{.sigma = {kSigma}, .ar1 = 0, .frame_s = 0.1}};
  Fit fitted(const ModelSet& set) const {
    const Layout layout(system, set);
    return fit(likelihood, layout, layout.shared_start(), std::vector<Eigen::VectorXd>(3, layout.local_start()),
               {.nuisance_sd = Eigen::VectorXd(0), .curves = {}});
  }
};

TEST_F(MovedProposals, FindStepsThatAnotherEffectHasShifted) {
  const Proposals proposals(likelihood, fitted({}));
  const Fit lagging = fitted({kLagging});
  ASSERT_NEAR(lagging.shared[1], kLag + 0.5 * kStep, 0.05);
  const Marginal beside(likelihood, lagging, {});
  auto list = proposals.beside(beside, 2);
  ASSERT_EQ(list.size(), 1U);
  const Proposal before = list.front();
  EXPECT_GT(std::abs(before.starts.front().shared[0] - kStep), 0.1);
  proposals.look_with_others_moved(likelihood, lagging, beside, 2, list);
  const StartPoint& found = list.front().starts.front();
  EXPECT_NEAR(found.shared[0], kStep, 0.02);
  ASSERT_EQ(found.beside.size(), 2);
  EXPECT_NEAR(found.beside[1], kLag, 0.2);
  EXPECT_GT(list.front().log_bayes_factor, before.log_bayes_factor + 100);
}

}  // namespace
}  // namespace bevel::inference::testing
