// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/pipeline.hpp>

#include <gtest/gtest.h>

#include <deque>

#include <bevel/error.hpp>
#include "tests/camera/scenes.hpp"

namespace bevel::camera {
namespace {

using std::chrono::milliseconds;

class ScriptedSource : public FrameSource {
 public:
  explicit ScriptedSource(std::deque<FrameResult> script) : script_(std::move(script)) {}
  FrameResult next(milliseconds /*timeout*/) override {
    if (script_.empty()) return EndOfFrames{};
    FrameResult first = script_.front();
    script_.pop_front();
    return first;
  }

 private:
  std::deque<FrameResult> script_;
};

CameraSetup setup(int32_t camera, const PlanarViewConfig& view) {
  return {camera, std::make_shared<PlanarView>(view), test::tracker_config(), {}};
}

PlanarViewConfig top_view() {
  PlanarViewConfig view = test::side_view();
  view.u_axis = {WorldAxis::x, 1};
  return view;
}

TEST(CameraPipeline, TakesTheLatencyOffTheStamps) {
  rig::NeedleRenderer side({}, PlanarView(test::side_view()));
  const auto gray = side.render(test::arc(40.0, 0.004, 0.0), 0.4).gray;
  CameraSetup late = setup(0, test::side_view()), prompt = setup(1, test::side_view());
  late.latency_us = 100'000;
  CameraPipeline pipeline(
      std::make_unique<ScriptedSource>(std::deque<FrameResult>{Frame{900'000, 0, 0, gray}, Frame{900'000, 0, 1, gray}}),
      {late, prompt});
  for (const int64_t utime : {800'000, 900'000}) {
    const auto result = pipeline.next(milliseconds(100));
    ASSERT_TRUE(std::holds_alternative<TipObservation>(result));
    EXPECT_EQ(std::get<TipObservation>(result).capture_utime, utime);
  }
}

TEST(CameraPipeline, TwoCamerasGiveThreeAxes) {
  const std::vector<Vector3> path = [] {
    std::vector<Vector3> p = test::arc(40.0, 0.004, 0.0);
    for (Vector3& point : p) point[0] = -0.5 * point[1];  // out of either plane
    return p;
  }();
  rig::NeedleRenderer side({}, PlanarView(test::side_view()));
  rig::NeedleRenderer top({}, PlanarView(top_view()));
  std::deque<FrameResult> script;
  script.push_back(Frame{1000, 5, 0, side.render(path, 0.4).gray});
  script.push_back(Frame{1000, 5, 9, side.render(path, 0.4).gray});  // a camera nobody set up
  script.push_back(Frame{1010, 5, 1, top.render(path, 0.4).gray});
  CameraPipeline pipeline(std::make_unique<ScriptedSource>(script),
                          {setup(0, test::side_view()), setup(1, top_view())});
  Matrix3 sum{};
  for (const int camera : {0, 1}) {
    const auto result = pipeline.next(milliseconds(100));
    ASSERT_TRUE(std::holds_alternative<TipObservation>(result));
    const TipObservation& seen = std::get<TipObservation>(result);
    EXPECT_EQ(seen.camera, camera);
    EXPECT_EQ(seen.seq, 5);
    EXPECT_EQ(seen.capture_utime, 1000 + 10 * camera);
    ASSERT_EQ(seen.status, TipStatus::ok) << seen.reason;
    const size_t sideways = camera == 0 ? 1 : 0;
    EXPECT_NEAR(seen.position_mm[sideways], path.back()[sideways], 0.3);
    EXPECT_NEAR(seen.position_mm[2], path.back()[2], 0.5);
    EXPECT_EQ(seen.information_per_mm2[4 * (1 - sideways)], 0.0);
    for (size_t i = 0; i < 9; ++i) sum[i] += seen.information_per_mm2[i];
    ASSERT_EQ(seen.heading_status, TipStatus::ok);
    const Vector3& end = path.back();
    const Vector3& before = path[path.size() - 2];
    const Vector3& h = seen.heading.direction;
    EXPECT_EQ(h[1 - sideways], 0.0);
    EXPECT_NEAR(std::atan2(h[sideways], h[2]), std::atan2(end[sideways] - before[sideways], end[2] - before[2]), 0.06);
    EXPECT_GT(seen.heading.information_per_rad2[4 * sideways], 100.0);
  }
  EXPECT_TRUE(std::holds_alternative<EndOfFrames>(pipeline.next(milliseconds(100))));
  for (const size_t axis : {0U, 1U, 2U}) EXPECT_GT(sum[4 * axis], 1.0);
  EXPECT_GT(sum[0], sum[8]) << "across is better known than along";
  EXPECT_EQ(pipeline.counters().frames, 2);
  EXPECT_EQ(pipeline.counters().unknown_camera, 1);
  EXPECT_EQ(pipeline.counters().headings, 2);
}

TEST(CameraPipeline, NoPositionWithoutOkAndGapsAreCounted) {
  rig::NeedleRenderer side({}, PlanarView(test::side_view()));
  std::deque<FrameResult> script;
  script.push_back(Frame{1000, 1, 0, side.render({}, 0.0).gray});
  script.push_back(FrameTimeout{});
  script.push_back(Frame{2000, 5, 0, side.render(test::arc(30.0, 0.0, 0.0), 0.0).gray});
  script.push_back(SourceFailure{"unplugged"});
  CameraPipeline pipeline(std::make_unique<ScriptedSource>(script), {setup(0, test::side_view())},
                          [] { return int64_t{900'000}; });
  const auto first = std::get<TipObservation>(pipeline.next(milliseconds(1)));
  EXPECT_NE(first.status, TipStatus::ok);
  EXPECT_FALSE(first.reason.empty());
  for (const double p : first.position_mm) EXPECT_EQ(p, 0.0);
  for (const double i : first.information_per_mm2) EXPECT_EQ(i, 0.0);
  EXPECT_EQ(first.heading_status, first.status);
  for (const double h : first.heading.direction) EXPECT_EQ(h, 0.0);
  for (const double i : first.heading.information_per_rad2) EXPECT_EQ(i, 0.0);
  EXPECT_TRUE(std::holds_alternative<FrameTimeout>(pipeline.next(milliseconds(1))));
  EXPECT_EQ(std::get<TipObservation>(pipeline.next(milliseconds(1))).status, TipStatus::late);
  EXPECT_EQ(std::get<SourceFailure>(pipeline.next(milliseconds(1))).text, "unplugged");
  EXPECT_EQ(pipeline.counters().lost_frames, 3);
  EXPECT_EQ(pipeline.counters().by_status[static_cast<size_t>(TipStatus::late)], 2);
}

TEST(CameraPipeline, PredictionBringsTheRegionOfInterestToATipThatJumped) {
  rig::NeedleRenderer side({}, PlanarView(test::side_view()));
  const auto far = test::arc(70.0, 0.004, 0.0);
  TipTracker tracker(test::tracker_config(), 5.0);
  const PlanarView view(test::side_view());
  ASSERT_EQ(tracker.track({1, 0, 0, side.render(test::arc(35.0, 0.004, 0.0), 0.0).gray}).status, TipStatus::ok);
  const TipResult tip = tracker.track({2, 1, 0, side.render(far, 0.0).gray}, 0, view.pixel(far.back()));
  EXPECT_EQ(tip.status, TipStatus::ok);
  EXPECT_FALSE(tip.full_search);
}

TEST(CameraPipeline, BadSetupsNameTheCamera) {
  const auto make = [](const std::vector<CameraSetup>& cameras) {
    CameraPipeline(std::make_unique<ScriptedSource>(std::deque<FrameResult>{}), cameras);
  };
  EXPECT_THROW(make({}), bevel::ArgumentError);
  EXPECT_THROW(make({setup(0, top_view()), setup(0, top_view())}), bevel::ArgumentError);
  EXPECT_THROW(make({CameraSetup{}}), bevel::ArgumentError);
  CameraSetup bad = setup(4, top_view());
  bad.tracker.min_length_mm = 0.0;
  try {
    make({bad});
    ADD_FAILURE() << "accepted";
  } catch (const ArgumentError& error) {
    EXPECT_NE(std::string(error.what()).find("camera 4"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("min_length_mm"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace bevel::camera
