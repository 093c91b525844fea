// SPDX-License-Identifier: MIT
// The study behind Table I: what goes in comes out, and the figures that the documents quote.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include <bevel/analysis/table1/protocol.hpp>

namespace bevel::analysis {
namespace {

model::NeedleParameters agar() {
  model::NeedleParameters n;
  n.lambda1_per_rad = 0.49;
  n.lambda2 = 0.22;
  return n;
}

TEST(Table1, WithoutNoiseTheLambdasComeBack) {
  std::vector<diagnosis::Insertion> clean = {record(kinematic_path("agar", agar()), 20, 1, 1e-6)};
  diagnosis::FitOptions options;
  options.start = agar();
  options.start.lambda1_per_rad = 0.3;
  options.start.lambda2 = 0.1;
  options.loss = diagnosis::Loss::square;
  const auto fit = diagnosis::fit_trajectory(clean, options);
  EXPECT_NEAR(fit.needle.lambda1_per_rad, 0.49, 2e-3);
  EXPECT_NEAR(fit.needle.lambda2, 0.22, 2e-3);
}

TEST(Table1, OverSeedsTheEstimateIsUnbiasedAndItsErrorHonest) {
  const auto path = kinematic_path("agar", agar());
  double sum = 0;
  double squares = 0;
  constexpr int kSeeds = 30;
  for (int i = 0; i < kSeeds; ++i) {
    const auto fit = identify_tissue(path, 1000 + 10 * static_cast<std::uint64_t>(i)).fit;
    const auto& p = *fit.find(diagnosis::kNeedleLambda1);
    sum += (p.value - 0.49) / p.std_error;
    squares += std::pow((p.value - 0.49) / p.std_error, 2);
  }
  std::cout << "z of lambda1 over " << kSeeds << " seeds: mean " << sum / kSeeds << ", RMS "
            << std::sqrt(squares / kSeeds) << '\n';
  EXPECT_NEAR(sum / kSeeds, 0, 4 / std::sqrt(kSeeds));
  EXPECT_NEAR(std::sqrt(squares / kSeeds), 1, 0.4);
}

TEST(Table1, BicycleErrorOfTheBeamGrowsWithTheForce) {
  EXPECT_LT(largest_circle_error_mm(beam_path("", 20, 0.5)), largest_circle_error_mm(beam_path("", 20, 1.0)));
  const double force_N = force_for_error_N(20, 1.11, 3);
  EXPECT_NEAR(largest_circle_error_mm(beam_path("", 20, force_N)), 1.11, 0.02);
}

TEST(Table1, TheSignOfThePrintedModelFollowsFromItsTable) {
  auto wheel = agar();
  EXPECT_NEAR(largest_circle_error_mm(kinematic_path("agar", wheel)), 3.64, 0.15);
  wheel.front_wheel = model::FrontWheel::nonslip;
  EXPECT_LT(largest_circle_error_mm(kinematic_path("agar", wheel)), 1.5);
}

}  // namespace
}  // namespace bevel::analysis
