// SPDX-License-Identifier: MIT
// What a reading was taken at, against motions made by hand.
#include <bevel/model/effects/covariates.hpp>

#include <gtest/gtest.h>

namespace bevel::model::testing {
namespace {

TEST(Covariates, FollowTheBase) {
  CovariateTracker tracker({0, 5, 0});  // the entry at 5 mm
  EXPECT_EQ(tracker[Covariate::since_reversal_mm], 0);
  tracker.advance({0, 5, 0}, {1, 15, 0});
  EXPECT_EQ(tracker[Covariate::speed_mm_s], 10);
  EXPECT_EQ(tracker[Covariate::since_reversal_mm], 10);  // since the entry, where it never turned
  EXPECT_EQ(tracker[Covariate::since_stop_s], 0);
  tracker.advance({1, 15, 0}, {2, 15, 1});
  EXPECT_EQ(tracker[Covariate::turn_rate_rad_s], 1);
  EXPECT_EQ(tracker[Covariate::since_stop_s], 1);
  EXPECT_EQ(tracker[Covariate::since_reversal_mm], 0);
  CovariateTracker again({0, 5, 0}, tracker.history());
  again.advance({2, 15, 1}, {2.5, 20, 1});
  EXPECT_EQ(again[Covariate::since_reversal_mm], 5);
  EXPECT_EQ(again[Covariate::turned_rad], 1);
  EXPECT_EQ(again[Covariate::withdrawn_mm], 0);
  again.advance({2.5, 20, 1}, {3, 12, -7});
  EXPECT_EQ(again[Covariate::turned_rad], -7);
  EXPECT_EQ(again[Covariate::withdrawn_mm], 8);
  again.advance({3, 12, -7}, {4, 19, -7});
  EXPECT_EQ(again[Covariate::withdrawn_mm], 1);
  EXPECT_EQ(again[Covariate::since_speed_change_s], 1);  // from -16 to 7 mm/s at 3 s
  again.advance({4, 19, -7}, {4.5, 22.6, -7});           // 7.2 mm/s is no other speed
  EXPECT_EQ(again[Covariate::since_speed_change_s], 1.5);
}

TEST(Covariates, OfAMotionMadeByHand) {
  // 2 s in at 5 mm/s, 1 s of rest, half a second of turning by 1 rad, 1 s in at 10 mm/s; a node every half second.
  const std::vector<BaseMotion> nodes = {{0, 0, 0},    {0.5, 2.5, 0}, {1, 5, 0},    {1.5, 7.5, 0}, {2, 10, 0},
                                         {2.5, 10, 0}, {3, 10, 0},    {3.5, 10, 1}, {4, 15, 1},    {4.5, 20, 1}};
  const auto at = find_covariates(nodes);
  ASSERT_EQ(at.size(), nodes.size());
  for (std::size_t i = 0; i < at.size(); ++i) {
    EXPECT_EQ(at[i][Covariate::time_s], nodes[i].time_s);
    EXPECT_EQ(at[i][Covariate::depth_mm], nodes[i].insertion_mm);
    EXPECT_EQ(at[i][Covariate::roll_rad], nodes[i].rotation_rad);
    EXPECT_NEAR(at[i][Covariate::speed_mm_s], i == 0 || (i > 4 && i < 8) ? 0 : i < 8 ? 5 : 10, 1e-12) << i;
    EXPECT_NEAR(at[i][Covariate::turn_rate_rad_s], i == 7 ? 2 : 0, 1e-12) << i;
    EXPECT_NEAR(at[i][Covariate::since_stop_s], i > 4 && i < 8 ? 0.5 * static_cast<double>(i - 4) : 0, 1e-12) << i;
    EXPECT_NEAR(at[i][Covariate::since_reversal_mm], i < 7 ? nodes[i].insertion_mm : nodes[i].insertion_mm - 10, 1e-12)
        << i;
  }
}

}  // namespace
}  // namespace bevel::model::testing
