// SPDX-License-Identifier: MIT
// What the needle is compared with on its sides, on made pictures.
#include <bevel/drivers/camera/centreline.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace bevel::camera {
namespace {

constexpr double kNeedle_px = 7.0;
constexpr int kMiddle_px = 60;

/// A needle 60 gray dark from the top to row 80, in light that grows by 0.2 gray a column.
cv::Mat picture() {
  cv::Mat m(140, 120, CV_8UC1);
  for (int y = 0; y < m.rows; ++y)
    for (int x = 0; x < m.cols; ++x) {
      const bool needle = y < 80 && std::abs(x - kMiddle_px) <= 3;
      m.at<uchar>(y, x) = cv::saturate_cast<uchar>(150.0 + 0.2 * (x - kMiddle_px) - (needle ? 60.0 : 0.0));
    }
  cv::GaussianBlur(m, m, {0, 0}, 1.0);
  return m;
}

EndProfile profile(const cv::Mat& m) {
  Centreline straight;
  straight.last_row = 80.0;
  straight.coefficient = {kMiddle_px, 0.0, 0.0};
  return profile_along(m, straight, 80.0, -50, 40, 9, ridge_scale(kNeedle_px));
}

TEST(ProfileAlong, ALineInOneWindowBesideTheNeedleChangesNothing) {
  const cv::Mat clear = picture();
  const EndProfile without = profile(clear);
  const int side = ridge_scale(kNeedle_px).offset_px + 1;
  for (const int at : {kMiddle_px + side, kMiddle_px - side, kMiddle_px + side + 6}) {
    cv::Mat lined = clear.clone();
    lined.colRange(at - 1, at + 2) -= cv::Scalar(40);
    const EndProfile with = profile(lined);
    ASSERT_EQ(with.dark.size(), without.dark.size());
    // The light's own slope and rounding of grays: half a gray under the needle. Over 19 columns a line of 24 gray
    // in the mean of a window would be 228.
    for (size_t i = 0; i < with.dark.size(); ++i) EXPECT_NEAR(with.dark[i], without.dark[i], 10.0) << at << " " << i;
  }
}

// Two windows on each side of the needle are read: where the picture ends before that, there is no profile.
TEST(ProfileAlong, EndsWhereThePictureDoes) {
  const cv::Mat m = picture();
  const int farthest = ridge_scale(kNeedle_px).offset_px + 1 + 7;
  EXPECT_FALSE(profile(m.colRange(0, kMiddle_px + farthest + 2)).dark.empty());
  EXPECT_TRUE(profile(m.colRange(0, kMiddle_px + farthest)).dark.empty());
}

TEST(ProfileAlong, BeyondTheNeedleIsNothing) {
  const EndProfile p = profile(picture());
  EXPECT_NEAR(p.dark.front(), 7.0 * 60.0, 15.0);
  EXPECT_NEAR(p.dark.back(), 0.0, 10.0);
  EXPECT_NEAR(p.moment.front(), 0.0, 40.0);
}

}  // namespace
}  // namespace bevel::camera
