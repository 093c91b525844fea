// SPDX-License-Identifier: MIT
// Which path is a needle's, and where it ends, on responses drawn by hand.
#include <bevel/drivers/camera/ridge_path.hpp>

#include <gtest/gtest.h>

namespace bevel::camera {
namespace {

constexpr int kWindow = 50;
constexpr int kWidth = 7;
constexpr double kShare = 0.4;

void draw(cv::Mat& response, int first_row, int last_row, double col, double slope, int gray) {
  for (int r = first_row; r <= last_row; ++r) {
    const int x = cvRound(col + slope * (r - first_row));
    for (int k = -2; k <= 2; ++k) response.at<uchar>(r, x + k) = static_cast<uchar>(gray - 5 * std::abs(k));
  }
}

RidgePath best(const cv::Mat& response) {
  PathQuery query;
  query.last_col = response.cols - 1;
  return RidgePathFinder().find(response, query);
}

TEST(RidgePath, AShortDarkNeedleOutweighsALongFaintLine) {
  cv::Mat response = cv::Mat::zeros(600, 200, CV_8UC1);
  draw(response, 0, 70, 60.0, 0.0, 60);
  draw(response, 0, 599, 140.0, 0.0, 15);
  const RidgePath path = best(response);
  EXPECT_NEAR(path.cols.at(30), 60, 1);
  EXPECT_NEAR(end_of_needle(path, kWindow, kWidth, kShare), 70, 2);
}

TEST(RidgePath, NeedsNothingAboveTheNeedle) {
  cv::Mat response = cv::Mat::zeros(300, 200, CV_8UC1);
  draw(response, 80, 220, 100.0, 0.2, 60);
  const RidgePath path = best(response);
  EXPECT_NEAR(path.cols.at(100), 104, 1);
  EXPECT_NEAR(end_of_needle(path, kWindow, kWidth, kShare), 220, 2);
}

TEST(RidgePath, GoesOnBehindWhatHidesIt) {
  cv::Mat response = cv::Mat::zeros(300, 200, CV_8UC1);
  draw(response, 0, 119, 60.0, 0.2, 60);
  draw(response, 150, 260, 60.0 + 0.2 * 150, 0.2, 60);
  EXPECT_NEAR(end_of_needle(best(response), kWindow, kWidth, kShare), 260, 2);
}

TEST(RidgePath, EndsWhereItWouldHaveToKink) {
  cv::Mat response = cv::Mat::zeros(300, 200, CV_8UC1);
  draw(response, 0, 119, 60.0, 0.0, 60);
  draw(response, 150, 280, 85.0, 0.0, 55);  // an old track, within reach of the path
  const RidgePath path = best(response);
  ASSERT_GT(path.last_row(), 250) << "the path itself takes both";
  EXPECT_NEAR(end_of_needle(path, kWindow, kWidth, kShare), 119, 3);
}

TEST(RidgePath, AFainterLineThatContinuesTheNeedleIsNotTheNeedle) {
  cv::Mat response = cv::Mat::zeros(500, 200, CV_8UC1);
  draw(response, 0, 150, 100.0, 0.0, 70);
  draw(response, 151, 480, 100.0, 0.0, 20);
  EXPECT_NEAR(end_of_needle(best(response), kWindow, kWidth, kShare), 150, 2);
}

}  // namespace
}  // namespace bevel::camera
