// SPDX-License-Identifier: MIT
// Frames kept while they are tracked: played back they give the same readings to the last bit, and a slow or broken
// disk costs frames, never the tracker.
#include <bevel/drivers/camera/frame_recorder.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include <bevel/drivers/camera/pipeline.hpp>
#include "tests/camera/scenes.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::camera {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

class ScriptedSource : public FrameSource {
 public:
  explicit ScriptedSource(std::deque<Frame> script) : script_(std::move(script)) {}
  FrameResult next(milliseconds /*timeout*/) override {
    if (script_.empty()) return EndOfFrames{};
    Frame first = script_.front();
    script_.pop_front();
    return first;
  }

 private:
  std::deque<Frame> script_;
};

std::vector<CameraSetup> two_cameras(int64_t latency_us) {
  PlanarViewConfig top = test::side_view();
  top.u_axis = {WorldAxis::x, 1};
  std::vector<CameraSetup> setups{{0, std::make_shared<PlanarView>(test::side_view()), test::tracker_config(), {}},
                                  {1, std::make_shared<PlanarView>(top), test::tracker_config(), {}}};
  setups[0].latency_us = latency_us;
  return setups;
}

// A needle that goes in before two cameras; frames are lost, one shows nothing, one comes twice.
std::deque<Frame> script() {
  rig::SceneConfig scene;
  scene.noise_gray = 2;
  rig::NeedleRenderer side(scene, PlanarView(test::side_view()));
  std::deque<Frame> frames;
  for (int64_t i = 0; i < 24; ++i) {
    if (i % 7 == 3) continue;
    const auto path = i == 12 ? std::vector<Vector3>{} : test::arc(15.0 + static_cast<double>(i), 0.004, 0.02);
    for (const int32_t camera : {0, 1})
      frames.push_back({1'700'000'000'000'000 + 33'333 * i + camera, i, camera, side.render(path, 0.3).gray});
    if (i == 15) frames.push_back(frames.back());
  }
  return frames;
}

std::vector<TipObservation> all_of(CameraPipeline& pipeline) {
  std::vector<TipObservation> seen;
  for (;;) {
    const auto result = pipeline.next(milliseconds(0));
    if (const auto* one = std::get_if<TipObservation>(&result))
      seen.push_back(*one);
    else
      return seen;
  }
}

SourceConfig folder_source(const fs::path& folder) {
  SourceConfig config;
  config.kind = SourceKind::folder;
  config.path = folder.string();
  config.start_utime = 5;
  config.camera = 9;
  return config;
}

TEST(FrameRecorder, PlayedBackTheReadingsAreTheSame) {
  const test::TemporaryFolder folder;
  const fs::path kept = folder / "kept" / "frames";
  std::vector<TipObservation> live;
  {
    FrameRecorder recorder(kept, 100);
    CameraPipeline pipeline(std::make_unique<ScriptedSource>(script()), two_cameras(80'000));
    pipeline.on_tracked = [&](const cv::Mat& gray, const TipObservation& o) {
      recorder.offer(gray, {o.capture_utime, o.seq, o.camera, static_cast<int32_t>(o.status), o.tip_px, {}});
    };
    live = all_of(pipeline);
    recorder.finish();
    EXPECT_EQ(recorder.counts().written, static_cast<int64_t>(live.size()));
    EXPECT_EQ(recorder.counts().dropped, 0);
    EXPECT_EQ(recorder.counts().failure, "");
  }
  // The latency is off the stamps already, so nothing is taken off again.
  CameraPipeline again(make_frame_source(folder_source(kept)), two_cameras(0));
  const auto played = all_of(again);
  ASSERT_EQ(played.size(), live.size());
  int ok = 0;
  for (size_t i = 0; i < live.size(); ++i) {
    const TipObservation &a = live[i], &b = played[i];
    EXPECT_EQ(a.capture_utime, b.capture_utime);
    EXPECT_EQ(a.seq, b.seq);
    EXPECT_EQ(a.camera, b.camera);
    EXPECT_EQ(a.status, b.status) << i;
    EXPECT_EQ(a.heading_status, b.heading_status);
    EXPECT_EQ(a.position_mm, b.position_mm) << i;
    EXPECT_EQ(a.information_per_mm2, b.information_per_mm2);
    EXPECT_EQ(a.heading.direction, b.heading.direction);
    ok += a.status == TipStatus::ok ? 1 : 0;
  }
  std::printf("%zu frames, %d ok, played back to the last bit\n", live.size(), ok);
  EXPECT_GT(ok, 30);
  EXPECT_EQ(ok, static_cast<int>(live.size()) - 3) << "an empty picture and a repeated one are among them";
  EXPECT_EQ(again.counters().lost_frames, 6);
  const auto index = read_frame_index(kept);
  ASSERT_EQ(index.size(), live.size());
  EXPECT_EQ(index[0].utime, 1'700'000'000'000'000 - 80'000);
  EXPECT_NEAR(index[0].tip_px.x, live[0].tip_px.x, 1e-3);
}

TEST(FrameRecorder, WhatDoesNotFitIsDroppedAndCounted) {
  const test::TemporaryFolder folder;
  cv::Mat noise(1080, 1920, CV_8UC1);
  cv::randu(noise, 0, 256);
  constexpr int offered = 40;
  FrameRecorder recorder(folder / "frames", 3);
  for (int64_t i = 0; i < offered; ++i) recorder.offer(noise, {1000 + i, i, 0, 0, {}, {}});
  recorder.finish();
  const auto counts = recorder.counts();
  std::printf("%lld written, %lld dropped\n", static_cast<long long>(counts.written),
              static_cast<long long>(counts.dropped));
  EXPECT_EQ(counts.written + counts.dropped, offered);
  EXPECT_GE(counts.written, 3);
  EXPECT_GT(counts.dropped, 0);
  const auto index = read_frame_index(folder / "frames");
  EXPECT_EQ(static_cast<int64_t>(index.size()), counts.written);
  for (size_t i = 1; i < index.size(); ++i) EXPECT_GT(index[i].seq, index[i - 1].seq);
}

TEST(FrameRecorder, ADiskThatFailsEndsItAndNamesTheFile) {
  const test::TemporaryFolder folder;
  FrameRecorder recorder(folder / "frames");
  fs::remove_all(folder / "frames");
  for (int64_t i = 0; i < 5; ++i) recorder.offer(cv::Mat(48, 64, CV_8UC1, cv::Scalar(1)), {1000 + i, i, 0, 0, {}, {}});
  recorder.finish();
  const auto counts = recorder.counts();
  EXPECT_EQ(counts.written, 0);
  EXPECT_EQ(counts.dropped, 5);
  EXPECT_THAT(counts.failure, HasSubstr("1000-0-0.png"));
}

TEST(FrameRecorder, ReplacesNothing) {
  const test::TemporaryFolder folder;
  { const FrameRecorder first(folder.path()); }
  EXPECT_THROW(FrameRecorder second(folder.path()), std::runtime_error);
  const std::string file = folder.write("file", "");
  EXPECT_THROW(FrameRecorder(fs::path(file) / "below"), std::runtime_error);
}

TEST(FrameIndex, FaultsAreNamedByLine) {
  const std::string head = "utime,seq,camera,status,u_px,v_px,file\n";
  struct Case {
    const char* named;
    std::string text;
  };
  for (const Case& bad :
       {Case{"frames.csv:1", "time,file\n"}, Case{"empty", ""}, Case{"no frame", head},
        Case{":2: 7 fields", head + "1,2,3\n"}, Case{"utime is '-1'", head + "-1,0,0,0,1,1,a.png\n"},
        Case{"seq is 'x'", head + "1,x,0,0,1,1,a.png\n"}, Case{"camera is '-1'", head + "1,0,-1,0,1,1,a.png\n"},
        Case{"status is ''", head + "1,0,0,,1,1,a.png\n"}, Case{"u_px", head + "1,0,0,0,a,1,a.png\n"},
        Case{":3: file is '../a.png'", head + "1,0,0,0,1,1,a.png\n1,0,0,0,1,1,../a.png\n"}}) {
    const test::TemporaryFolder folder;
    folder.write(kFrameIndex, bad.text);
    try {
      make_frame_source(folder_source(folder.path()));
      ADD_FAILURE() << bad.named << " was accepted";
    } catch (const SourceError& error) {
      EXPECT_THAT(error.what(), HasSubstr(bad.named));
    }
  }
}

TEST(FrameIndex, ALineThatWasBeingWrittenIsLeftOutAMissingPictureIsNot) {
  const test::TemporaryFolder folder;
  cv::imwrite((folder / "a.png").string(), cv::Mat(48, 64, CV_8UC1, cv::Scalar(1)));
  folder.write(kFrameIndex,
               "utime,seq,camera,status,u_px,v_px,file\n7,3,2,1,0,0,a.png\n8,4,2,1,0,0,b.png\n9,5,2,1,0,0,c.p");
  const auto source = make_frame_source(folder_source(folder.path()));
  const FrameResult first = source->next(milliseconds(0));
  ASSERT_TRUE(std::holds_alternative<Frame>(first));
  EXPECT_EQ(std::get<Frame>(first).capture_utime, 7);
  EXPECT_EQ(std::get<Frame>(first).seq, 3);
  EXPECT_EQ(std::get<Frame>(first).camera, 2);
  const FrameResult second = source->next(milliseconds(0));
  ASSERT_TRUE(std::holds_alternative<SourceFailure>(second));
  EXPECT_THAT(std::get<SourceFailure>(second).text, HasSubstr("b.png"));
  EXPECT_TRUE(std::holds_alternative<EndOfFrames>(source->next(milliseconds(0))));
}

// The program: frames of a folder, kept, and tracked again from what was kept. A latency is for live frames: taken off
// here it would be off twice in what is played back.
TEST(CameraProgram, RecordsAndPlaysBack) {
  const test::TemporaryFolder folder;
  fs::create_directories(folder / "in");
  int number = 0;
  for (const Frame& f : script())
    if (f.camera == 0) cv::imwrite((folder / "in" / (std::to_string(number++) + ".png")).string(), f.gray);
  const std::string config = folder.write(
      "system.toml",
      "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n"
      "[source]\nkind = \"folder\"\npath = \"unset\"\n[[camera]]\ncamera = 0\nlatency_s = 0.05\npx_per_mm = 5.0\n"
      "origin_px = [320.0, 20.0]\ncolumns_carry = \"+y\"\nrows_carry = \"+z\"\n");
  const std::string kept = (folder / "kept").string();
  const auto run = [&](const std::string& more) {
    return test::run_program(folder, "bevel-camera", "--lcm-url memq:// --print -c " + config + " " + more);
  };
  const auto live = run("--source " + (folder / "in").string() + " --record " + kept);
  EXPECT_EQ(live.status, 0) << live.err;
  EXPECT_THAT(live.err, HasSubstr(std::to_string(number) + " frames recorded, 0 dropped"));
  const auto played = run("--source " + kept);
  EXPECT_EQ(played.status, 0) << played.err;
  EXPECT_EQ(played.out, live.out);
  EXPECT_EQ(std::ranges::count(live.out, '\n'), number + 1);
  const auto refused = run("--source " + kept + " --record " + kept);
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.err, HasSubstr("frames.csv already"));
  fs::remove(fs::path(kept) / read_frame_index(kept).back().file);
  const auto damaged = run("--source " + kept);
  EXPECT_EQ(damaged.status, 1);
  EXPECT_THAT(damaged.err, HasSubstr("not a readable image"));
}

}  // namespace
}  // namespace bevel::camera
