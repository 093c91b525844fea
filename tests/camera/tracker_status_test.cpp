// SPDX-License-Identifier: MIT
// Each reason for which a frame gives no position, provoked.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include <bevel/drivers/camera/tip_tracker.hpp>
#include <bevel/error.hpp>
#include "tests/camera/scenes.hpp"

namespace bevel::camera {
namespace {

class TrackerStatus : public ::testing::Test {
 protected:
  cv::Mat needle(double length_mm) {
    return rig::NeedleRenderer(scene_, view_).render(test::arc(length_mm, 0.004, 0.0), 0.5).gray;
  }
  cv::Mat empty() { return rig::NeedleRenderer(scene_, view_).render({}, 0.0).gray; }
  TipResult track(const cv::Mat& gray, int64_t now_utime = 0) {
    utime_ += 33'333;
    return tracker_.track({utime_, 0, 0, gray}, now_utime);
  }

  PlanarView view_{test::side_view()};
  rig::SceneConfig scene_;
  TipTracker tracker_{test::tracker_config(), view_.px_per_mm()};
  int64_t utime_ = 1'700'000'000'000'000;
};

TEST_F(TrackerStatus, Ok) { EXPECT_EQ(track(needle(40.0)).status, TipStatus::ok); }

TEST_F(TrackerStatus, LostWithoutNeedle) {
  EXPECT_EQ(track(empty()).status, TipStatus::lost);
  EXPECT_EQ(track(cv::Mat()).status, TipStatus::lost);
  EXPECT_EQ(track(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(9))).status, TipStatus::lost);
}

TEST_F(TrackerStatus, LostWhenTheTipLeavesThePicture) {
  scene_.size_px = {640, 200};
  EXPECT_EQ(track(needle(60.0)).status, TipStatus::lost);
}

TEST_F(TrackerStatus, LostAndFoundAgain) {
  ASSERT_EQ(track(needle(40.0)).status, TipStatus::ok);
  ASSERT_EQ(track(empty()).status, TipStatus::lost);
  const TipResult again = track(needle(41.0));
  EXPECT_EQ(again.status, TipStatus::ok);
  EXPECT_TRUE(again.full_search);
}

TEST_F(TrackerStatus, FullSearchFindsATipThatJumped) {
  ASSERT_EQ(track(needle(20.0)).status, TipStatus::ok);
  const TipResult far = track(needle(80.0));
  ASSERT_EQ(far.status, TipStatus::ok);
  const cv::Point2d truth_px = view_.pixel(test::arc(80.0, 0.004, 0.0).back());
  EXPECT_LT(cv::norm(far.tip_px - truth_px), 3.0);
}

TEST_F(TrackerStatus, TooShort) { EXPECT_EQ(track(needle(1.5)).status, TipStatus::too_short); }

TEST_F(TrackerStatus, SaturatedByLight) {
  scene_.gain = 5.0;
  EXPECT_EQ(track(needle(40.0)).status, TipStatus::saturated);
}

TEST_F(TrackerStatus, SaturatedAroundTheTip) {
  const cv::Point2d tip_px = view_.pixel(test::arc(40.0, 0.004, 0.0).back());
  scene_.glare.push_back({tip_px + cv::Point2d(0.0, 14.0), 12.0, 400.0});
  EXPECT_EQ(track(needle(40.0)).status, TipStatus::saturated);
}

TEST_F(TrackerStatus, TwoCandidates) {
  cv::Mat two = needle(40.0);
  const cv::Mat other = needle(40.0);
  // The same needle again, 100 pixels to the side.
  cv::Mat moved;
  cv::warpAffine(other, moved, cv::Matx23d(1, 0, 100, 0, 1, 0), other.size(), cv::INTER_NEAREST, cv::BORDER_REPLICATE);
  two = cv::min(two, moved);
  EXPECT_EQ(track(two).status, TipStatus::two_candidates);
  // Knowing where the needle enters settles it.
  EXPECT_EQ(TipTracker(test::with_entry(), view_.px_per_mm()).track({1, 0, 0, two}).status, TipStatus::ok);
}

TEST_F(TrackerStatus, Blurred) {
  scene_.blur_px = 6.0;
  EXPECT_EQ(track(needle(40.0)).status, TipStatus::blurred);
}

TEST_F(TrackerStatus, Frozen) {
  const cv::Mat same = needle(40.0);
  ASSERT_EQ(track(same).status, TipStatus::ok);
  EXPECT_EQ(track(same).status, TipStatus::frozen);
  EXPECT_EQ(track(same.clone()).status, TipStatus::frozen);
  EXPECT_EQ(track(needle(41.0)).status, TipStatus::ok);
}

TEST_F(TrackerStatus, LateByAge) {
  EXPECT_EQ(track(needle(40.0), utime_ + 400'000).status, TipStatus::ok);
  EXPECT_EQ(track(needle(41.0), utime_ + 700'000).status, TipStatus::late);
}

TEST_F(TrackerStatus, LateByOrder) {
  ASSERT_EQ(track(needle(40.0)).status, TipStatus::ok);
  EXPECT_EQ(tracker_.track({utime_ - 1, 0, 0, needle(41.0)}).status, TipStatus::late);
  EXPECT_EQ(tracker_.track({utime_, 0, 0, needle(42.0)}).status, TipStatus::late);
}

TEST_F(TrackerStatus, AClockThatWasSetBackIsFollowedAfterThreeFrames) {
  ASSERT_EQ(track(needle(40.0)).status, TipStatus::ok);
  utime_ -= 3'600'000'000;
  EXPECT_EQ(track(needle(41.0)).status, TipStatus::late);
  EXPECT_EQ(track(needle(42.0)).status, TipStatus::late);
  const TipResult followed = track(needle(43.0));
  EXPECT_EQ(followed.status, TipStatus::ok);
  EXPECT_TRUE(followed.full_search) << "the tip's speed is not known across the step";
  EXPECT_EQ(track(needle(44.0)).status, TipStatus::ok);
}

TEST_F(TrackerStatus, AFrameOfTheOldTimeAfterTheStepKeepsNothingOut) {
  ASSERT_EQ(track(needle(40.0)).status, TipStatus::ok);
  utime_ -= 3'600'000'000;
  for (const double mm : {41.0, 42.0, 43.0}) (void)track(needle(mm));
  ASSERT_EQ(tracker_.track({utime_ + 3'600'000'000, 0, 0, needle(43.5)}).status, TipStatus::ok);
  for (const double mm : {44.0, 45.0}) (void)track(needle(mm));
  EXPECT_EQ(track(needle(46.0)).status, TipStatus::ok);
}

TEST_F(TrackerStatus, FramesThatComeLateBetweenOthersAreNoNewTime) {
  ASSERT_EQ(track(needle(40.0)).status, TipStatus::ok);
  for (int i = 1; i <= 4; ++i) {
    EXPECT_EQ(track(needle(40.0 + i)).status, TipStatus::ok);
    EXPECT_EQ(tracker_.track({utime_ - 50'000, 0, 0, needle(40.5 + i)}).status, TipStatus::late);
  }
}

TEST(TrackerConfigCheck, NamesTheKey) {
  struct Case {
    const char* key;
    void (*spoil)(TrackerConfig&);
  };
  const Case cases[] = {
      {"needle_diameter_mm", [](TrackerConfig& c) { c.needle_diameter_mm = 0.0; }},
      {"min_contrast_gray", [](TrackerConfig& c) { c.min_contrast_gray = 300.0; }},
      {"fit_length_mm", [](TrackerConfig& c) { c.fit_length_mm = std::nan(""); }},
      {"fit_length_mm", [](TrackerConfig& c) { c.fit_length_mm = c.bevel_length_mm; }},
      {"max_age_us", [](TrackerConfig& c) { c.max_age_us = 0; }},
      {"floor_along_mm", [](TrackerConfig& c) { c.floor_along_mm = -1.0; }},
  };
  for (const Case& bad : cases) {
    TrackerConfig config;
    bad.spoil(config);
    try {
      const TipTracker tracker(config, 5.0);
      ADD_FAILURE() << bad.key << " was accepted";
    } catch (const ArgumentError& error) {
      EXPECT_NE(std::string(error.what()).find(bad.key), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("allowed"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(TipTracker(TrackerConfig{}, 0.0), bevel::ArgumentError);
}

}  // namespace
}  // namespace bevel::camera
