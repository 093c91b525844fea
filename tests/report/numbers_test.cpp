// SPDX-License-Identifier: MIT
// Statistics without a value: of nothing, of one, of what does not vary.
#include <bevel/report/numbers.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace bevel::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

TEST(Numbers, AValueThatIsNotFiniteIsPrintedAsADash) {
  for (const double value : {kNan, -kNan, kInfinity, -kInfinity}) {
    EXPECT_EQ(fixed(value, 2), "-");
    EXPECT_EQ(number(value), "-");
    EXPECT_EQ(measured(value), "-");
    EXPECT_EQ(format_significant(value), "-");
  }
}

TEST(Numbers, AQuantityThatIsHeldHasNoErrorInStandardDeviations) {
  EXPECT_EQ(in_deviations(0, 0), "-");
  EXPECT_EQ(in_deviations(0.2, 0), "-");
  EXPECT_EQ(in_deviations(-0.2, 0), "-");
  EXPECT_EQ(in_deviations(0.2, kNan), "-");
  EXPECT_EQ(in_deviations(0.2, std::numeric_limits<double>::denorm_min()), "-");
  EXPECT_EQ(in_deviations(0.2, 0.1), "+2.0");
  EXPECT_EQ(in_deviations(-0.2, 0.1), "-2.0");
  EXPECT_EQ(in_deviations(0, 0.1), "+0.0");
}

}  // namespace
}  // namespace bevel::report
