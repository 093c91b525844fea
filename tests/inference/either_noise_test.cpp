// SPDX-License-Identifier: MIT
// What a set promises of a larger one depends on the noise by which it is asked: its own, or that of a reference.
#include <gtest/gtest.h>

#include <bevel/diagnosis/inference/evidence.hpp>
#include "tests/inference/linear_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::VectorXd;
using testing::LinearSystem;

TEST(EitherNoise, ASetByAnotherNoiseIsThatOfItsNormalDensity) {
  constexpr std::size_t kRecordings = 4;
  const LinearSystem system(kRecordings, 7, 0.3, 0.2, 0);
  const auto noise_of = [&](double sigma) {
    Noise noise = testing::white(system);
    noise.sigma = {sigma};
    return noise;
  };
  const auto of = [&](double sigma) {
    return std::make_shared<const Likelihood>(system, Readings(kRecordings), noise_of(sigma));
  };
  const auto from = of(0.13), to = of(0.08);
  const Layout layout(system, {0});
  Fit here = fit(*from, layout, layout.shared_start(), std::vector<VectorXd>(kRecordings, layout.local_start()),
                 {.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}}, {}, {.tolerance = 1e-9});
  here.likelihood = from;
  const Moved moved = moved_to(to, here, Discrepancy(*from, here));
  ASSERT_TRUE(moved.fit.valid);
  const auto log_density = [&](double sigma) {
    return testing::log_normal(testing::all_readings(system),
                               testing::covariance_of(system, {0}, noise_of(sigma), 0.2));
  };
  EXPECT_NEAR(moved.log_change, log_density(0.08) - log_density(0.13), 1e-4);
  EXPECT_NEAR(moved.share_before, std::pow(0.08 / 0.13, 2), 1e-9);
}

}  // namespace
}  // namespace bevel::inference
