// SPDX-License-Identifier: MIT
// A smaller edition of the coverage study: fewer sets, hence a wider band. The study of 200 is study_coverage.
#include "tests/identification/coverage_study.hpp"

#include <gtest/gtest.h>

#include <cstdio>

namespace bevel::diagnosis {
namespace {

TEST(Coverage, IntervalsContainTheTruthAsOftenAsTheySay) {
  model::NeedleParameters truth;
  truth.lambda1_per_rad = 0.49;
  truth.lambda2 = 0.22;
  FitOptions options;
  options.start = truth;
  options.start.curvature_per_mm = 0.0042;
  options.start.lambda2 = 0.1;
  constexpr std::uint64_t kSeed = 7;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  for (const auto& c : coverage_study(truth, 80, kSeed, {}, 6, options)) {
    std::printf("%-18s %d of %d\n", kParameterNames[c.parameter], c.inside.hits, c.inside.of);
    // 95 % of 80 is 76; three standard deviations of the binomial are 5.8.
    EXPECT_GE(c.inside.hits, 70);
    double squares = 0;
    for (const double z : c.z) squares += z * z;
    EXPECT_NEAR(std::sqrt(squares / c.inside.of), 1, 0.25);  // neither too narrow nor too wide
  }
}

}  // namespace
}  // namespace bevel::diagnosis
