// SPDX-License-Identifier: MIT
// The tracker against rendered needles of known tip. Figures are printed; the bounds are the goals.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include <bevel/drivers/camera/tip_tracker.hpp>
#include "tests/camera/scenes.hpp"

namespace bevel::camera {
namespace {

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<size_t>(share * static_cast<double>(values.size() - 1)));
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

TEST(TrackerAccuracy, RandomRenderedNeedles) {
  constexpr uint64_t seed = 20150928;
  constexpr int frames = 1000;
  std::mt19937_64 random(seed);
  const PlanarView view(test::side_view());
  std::vector<double> error_px;
  std::vector<double> along_px;
  std::vector<double> along_side_px;  // bevel seen from the side: it runs out to nothing
  std::vector<double> along_face_px;  // seen onto the bevel: it ends round
  std::vector<double> across_px;
  std::vector<double> direction_deg;
  std::vector<double> nees;
  std::array<int, kTipStatuses> by_status{};
  for (int i = 0; i < frames; ++i) {
    const test::Needle needle = test::random_needle(random, seed + static_cast<uint64_t>(i));
    const rig::NeedlePicture picture = rig::NeedleRenderer(needle.scene, view).render(needle.path, needle.roll_rad);
    TipTracker tracker(test::tracker_config(), view.px_per_mm());
    const TipResult tip = tracker.track({1 + i, i, 0, picture.gray});
    ++by_status.at(static_cast<size_t>(tip.status));
    if (tip.status != TipStatus::ok) continue;
    const cv::Vec2d e(tip.tip_px.x - picture.tip_px.x, tip.tip_px.y - picture.tip_px.y);
    const cv::Vec2d& t = picture.direction_px;
    error_px.push_back(cv::norm(e));
    along_px.push_back(e.dot(t));
    across_px.push_back(std::abs(e[0] * t[1] - e[1] * t[0]));
    const bool from_the_side = std::abs(std::sin(needle.roll_rad)) > 0.7;
    (from_the_side ? along_side_px : along_face_px).push_back(e.dot(t));
    direction_deg.push_back(std::acos(std::min(1.0, t.dot(tip.direction_px))) * 57.29578);
    nees.push_back((e.t() * tip.covariance_px2.inv() * e)(0));
  }
  std::printf("seed %llu, %d frames, status ok/lost/short/saturated/two/blurred: %d %d %d %d %d %d\n",
              static_cast<unsigned long long>(seed), frames, by_status[0], by_status[1], by_status[2], by_status[3],
              by_status[4], by_status[5]);
  const auto report = [&](const char* name, const std::vector<double>& px) {
    std::printf("%-12s median %.3f px %.4f mm, p95 %.3f px %.4f mm, p99 %.3f px, largest %.3f px\n", name,
                percentile(px, 0.5), percentile(px, 0.5) / view.px_per_mm(), percentile(px, 0.95),
                percentile(px, 0.95) / view.px_per_mm(), percentile(px, 0.99), percentile(px, 1.0));
  };
  report("tip error", error_px);
  report("across", across_px);
  std::vector<double> along_size = along_px;
  for (double& a : along_size) a = std::abs(a);
  report("along", along_size);
  std::printf(
      "along mean (bias) %.3f px (bevel from the side %.3f, onto it %.3f); direction median %.2f deg, p95 %.2f\n",
      mean(along_px), mean(along_side_px), mean(along_face_px), percentile(direction_deg, 0.5),
      percentile(direction_deg, 0.95));
  std::printf("normalised squared error: mean %.2f (2 if honest), median %.2f (1.39), p95 %.2f (5.99)\n", mean(nees),
              percentile(nees, 0.5), percentile(nees, 0.95));

  EXPECT_GE(by_status[0], frames * 95 / 100);
  EXPECT_LT(percentile(across_px, 0.95), 0.5);
  EXPECT_LT(percentile(along_size, 0.95), 1.0);
  for (const auto& along : {along_px, along_side_px, along_face_px})
    EXPECT_LT(std::abs(mean(along)) / view.px_per_mm(), 0.03);
  EXPECT_LT(percentile(direction_deg, 0.95), 2.0);
  EXPECT_LT(mean(nees) / 2.0, 1.25) << "the covariance is too small";
  EXPECT_GT(mean(nees) / 2.0, 0.8) << "the covariance is too large";
}

TEST(TrackerAccuracy, RegionOfInterestEqualsFullSearch) {
  constexpr uint64_t seed = 77;
  std::mt19937_64 random(seed);
  const PlanarView view(test::side_view());
  std::vector<double> gap_px;
  int roi_frames = 0;
  for (int insertion = 0; insertion < 5; ++insertion) {
    const double curvature_per_mm = test::uniform(random, -0.006, 0.006);
    rig::SceneConfig scene;
    scene.seed = seed + static_cast<uint64_t>(insertion);
    rig::NeedleRenderer renderer(scene, view);
    TipTracker following(test::tracker_config(), view.px_per_mm());
    TipTracker searching(test::tracker_config(), view.px_per_mm());
    for (int i = 0; i < 30; ++i) {
      const auto picture = renderer.render(test::arc(12.0 + 2.0 * i, curvature_per_mm, 0.0), 0.7);
      const Frame frame{1 + i * 100'000, i, 0, picture.gray};
      const TipResult near = following.track(frame);
      searching.forget();
      const TipResult far = searching.track(frame);
      ASSERT_EQ(near.status, TipStatus::ok) << near.reason << ", frame " << i;
      ASSERT_EQ(far.status, TipStatus::ok) << far.reason << ", frame " << i;
      EXPECT_TRUE(far.full_search);
      roi_frames += near.full_search ? 0 : 1;
      gap_px.push_back(cv::norm(near.tip_px - far.tip_px));
    }
  }
  std::printf("seed %llu, %zu frames, %d by region of interest; gap p95 %.4f px, largest %.4f px\n",
              static_cast<unsigned long long>(seed), gap_px.size(), roi_frames, percentile(gap_px, 0.95),
              percentile(gap_px, 1.0));
  EXPECT_GE(roi_frames, 140);
  EXPECT_LT(percentile(gap_px, 1.0), 0.2);
}

// As the demo's cameras see it: 4.4 px/mm, 30 Hz, 10 mm/s, and the shaft rotated as it goes in. What matters to a
// filter that averages a thousand frames is what they have in common.
TEST(TrackerAccuracy, AnInsertionHasNoOffsetInCommon) {
  constexpr uint64_t seed = 3;
  PlanarViewConfig config;
  config.px_per_mm = 4.4;
  config.origin_px = {240.0, 40.0};
  const PlanarView view(config);
  rig::SceneConfig scene;
  scene.size_px = {480, 640};
  scene.seed = seed;
  rig::NeedleRenderer renderer(scene, view);
  TipTracker tracker(test::tracker_config(), view.px_per_mm());
  std::vector<double> along_mm, across_mm, nees;
  for (int i = 0; i < 270; ++i) {
    const double inserted_mm = 10.0 + i / 3.0;
    const test::SpacePath path = test::space_path(
        {.length_mm = inserted_mm, .curvature_per_mm = 0.005, .slope_y_rad = 0.02, .turn_rad_per_mm = 0.06});
    const rig::NeedlePicture picture = renderer.render(path.points_mm, 0.06 * inserted_mm);
    const TipResult tip = tracker.track({1 + i * 33'333, i, 0, picture.gray});
    if (tip.status != TipStatus::ok) continue;
    const cv::Vec2d e(tip.tip_px.x - picture.tip_px.x, tip.tip_px.y - picture.tip_px.y);
    const cv::Vec2d& t = picture.direction_px;
    along_mm.push_back(e.dot(t) / view.px_per_mm());
    across_mm.push_back((e[0] * t[1] - e[1] * t[0]) / view.px_per_mm());
    nees.push_back((e.t() * tip.covariance_px2.inv() * e)(0));
  }
  const auto rms = [](const std::vector<double>& v) {
    double sum = 0.0;
    for (const double x : v) sum += x * x;
    return std::sqrt(sum / static_cast<double>(v.size()));
  };
  std::printf(
      "seed %llu, %zu of 270 frames: along mean %.4f mm, rms %.4f; across mean %.4f mm, rms %.4f; squared / 2 %.2f\n",
      static_cast<unsigned long long>(seed), along_mm.size(), mean(along_mm), rms(along_mm), mean(across_mm),
      rms(across_mm), mean(nees) / 2.0);
  EXPECT_GE(along_mm.size(), 265U);
  EXPECT_LT(std::abs(mean(along_mm)), 0.03);
  EXPECT_LT(std::abs(mean(across_mm)), 0.03);
}

TEST(TrackerAccuracy, EverySideOfEntryGivesTheSameTip) {
  const PlanarView view(test::side_view());
  rig::SceneConfig scene;
  scene.noise_gray = 1.0;
  const auto picture = rig::NeedleRenderer(scene, view).render(test::arc(40.0, 0.005, 0.0), 0.3);
  TipTracker top(test::tracker_config(), view.px_per_mm());
  const TipResult upright = top.track({1, 0, 0, picture.gray});
  ASSERT_EQ(upright.status, TipStatus::ok) << upright.reason;
  const double w = picture.gray.cols - 1.0;
  const double h = picture.gray.rows - 1.0;
  struct Turned {
    EntrySide side;
    cv::RotateFlags rotation;
    cv::Point2d tip_px;
    cv::Point2d entry_px;
    cv::Vec2d direction;
  };
  const cv::Point2d t = upright.tip_px;
  const cv::Vec2d d = upright.direction_px;
  const Turned cases[] = {
      {EntrySide::right, cv::ROTATE_90_CLOCKWISE, {h - t.y, t.x}, {h - 20.0, 320.0}, {-d[1], d[0]}},
      {EntrySide::bottom, cv::ROTATE_180, {w - t.x, h - t.y}, {w - 320.0, h - 20.0}, {-d[0], -d[1]}},
      {EntrySide::left, cv::ROTATE_90_COUNTERCLOCKWISE, {t.y, w - t.x}, {20.0, w - 320.0}, {d[1], -d[0]}},
  };
  for (const Turned& c : cases) {
    Frame frame{1, 0, 0, {}};
    cv::rotate(picture.gray, frame.gray, c.rotation);
    TrackerConfig config = test::tracker_config();
    config.entry_side = c.side;
    config.entry_px = c.entry_px;
    TipTracker tracker(config, view.px_per_mm());
    for (int i = 0; i < 2; ++i) {  // full search, then region of interest
      frame.capture_utime += 1;
      frame.gray.at<uchar>(0, 0) ^= 1;
      const TipResult tip = tracker.track(frame);
      ASSERT_EQ(tip.status, TipStatus::ok) << tip.reason;
      EXPECT_EQ(tip.full_search, i == 0);
      EXPECT_LT(cv::norm(tip.tip_px - c.tip_px), 0.3);
      EXPECT_GT(tip.direction_px.dot(c.direction), 0.9999);
    }
  }
}

TEST(TrackerAccuracy, FirstFrameAsBackgroundSeesThroughClutter) {
  const PlanarView view(test::side_view());
  rig::SceneConfig scene;
  scene.grid_gray = 70.0;  // lines as dark as the needle
  rig::NeedleRenderer renderer(scene, view);
  TrackerConfig config = test::tracker_config();
  config.background = Background::first_frame;
  TipTracker tracker(config, view.px_per_mm());
  EXPECT_EQ(tracker.track({1, 0, 0, renderer.render({}, 0.0).gray}).status, TipStatus::lost);
  renderer.set_gain(1.1);
  const auto picture = renderer.render(test::arc(50.0, -0.004, 0.0), 1.0);
  const TipResult tip = tracker.track({2, 1, 0, picture.gray});
  ASSERT_EQ(tip.status, TipStatus::ok) << tip.reason;
  EXPECT_LT(cv::norm(tip.tip_px - picture.tip_px) / view.px_per_mm(), 0.5);
}

}  // namespace
}  // namespace bevel::camera
