// SPDX-License-Identifier: MIT
// Video files on the path of a camera: rendered needles of known tip, written as MJPEG in AVI and H.264 in MP4 by
// OpenCV's FFmpeg, tracked frame by frame beside the pictures that were never compressed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include <bevel/drivers/camera/pipeline.hpp>
#include "tests/camera/scenes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::camera {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr int kFrames = 60;
constexpr double kRate_hz = 25.0;
constexpr double kFirst_mm = 15.0, kStep_mm = 0.8;

struct Film {
  std::vector<cv::Mat> pictures;
  std::vector<Vector3> tips_mm;
};

// One needle that goes in, turning, by 0.8 mm a frame.
const Film& film() {
  static const Film one = [] {
    Film f;
    rig::SceneConfig scene;
    scene.noise_gray = 2.0;
    scene.seed = 7;
    rig::NeedleRenderer renderer(scene, PlanarView(test::side_view()));
    for (int i = 0; i < kFrames; ++i) {
      const auto path = test::arc(kFirst_mm + kStep_mm * i, 0.004, 0.03);
      f.pictures.push_back(renderer.render(path, 0.1 * i).gray);
      f.tips_mm.push_back(path.back());
    }
    return f;
  }();
  return one;
}

bool write_video(const std::string& path, const char* fourcc) {
  cv::VideoWriter writer;
  if (!writer.open(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc(fourcc[0], fourcc[1], fourcc[2], fourcc[3]), kRate_hz,
                   film().pictures.front().size(), true))
    return false;
  for (const cv::Mat& gray : film().pictures) {
    cv::Mat colour;
    cv::cvtColor(gray, colour, cv::COLOR_GRAY2BGR);
    writer.write(colour);
  }
  return true;
}

struct Tracked {
  int frames = 0, ok = 0;
  double rms_mm = 0, largest_mm = 0;
  std::string failure;
};

// Through the pipeline of bevel-camera. Every frame once, in order, stamped by the file: checked here.
Tracked track(SourceKind kind, const std::string& path) {
  SourceConfig config;
  config.kind = kind;
  config.path = path;
  config.start_utime = 1'000'000;
  config.period_us = kind == SourceKind::folder ? std::llround(1e6 / kRate_hz) : 77'777;
  CameraPipeline pipeline(make_frame_source(config),
                          {{0, std::make_shared<PlanarView>(test::side_view()), test::tracker_config(), {}}});
  Tracked t;
  for (;;) {
    const auto result = pipeline.next(milliseconds(0));
    if (const auto* failure = std::get_if<SourceFailure>(&result)) t.failure = failure->text;
    if (!std::holds_alternative<TipObservation>(result)) break;
    const auto& seen = std::get<TipObservation>(result);
    EXPECT_EQ(seen.seq, t.frames);
    EXPECT_NEAR(static_cast<double>(seen.capture_utime), 1e6 + 1e6 * t.frames / kRate_hz, 1.0) << "frame " << t.frames;
    const Vector3& truth = film().tips_mm.at(static_cast<size_t>(t.frames++));
    if (seen.status != TipStatus::ok) continue;
    ++t.ok;
    const double off_mm = std::hypot(seen.position_mm[1] - truth[1], seen.position_mm[2] - truth[2]);
    t.rms_mm += off_mm * off_mm;
    t.largest_mm = std::max(t.largest_mm, off_mm);
  }
  t.rms_mm = std::sqrt(t.rms_mm / std::max(1, t.ok));
  return t;
}

void print(const char* name, const Tracked& t) {
  std::printf("%s: %d frames, %d ok, off by %.3f mm RMS, %.3f largest\n", name, t.frames, t.ok, t.rms_mm, t.largest_mm);
}

Tracked track_uncompressed(const test::TemporaryFolder& folder) {
  for (size_t i = 0; i < film().pictures.size(); ++i)
    cv::imwrite((folder / (std::to_string(i) + ".png")).string(), film().pictures[i]);
  return track(SourceKind::folder, folder.path().string());
}

struct Container {
  const char* name;
  const char* file;
  const char* fourcc;
  double rms_mm;  // allowed, of frames whose step is 0.8
};
void PrintTo(const Container& c, std::ostream* out) { *out << c.name; }
class Video : public testing::TestWithParam<Container> {
 protected:
  test::TemporaryFolder folder_;
  std::string path_ = (folder_ / GetParam().file).string();
};

#define BEVEL_SKIP_WITHOUT_ENCODER() \
  if (!write_video(path_, GetParam().fourcc)) GTEST_SKIP() << "OpenCV's FFmpeg has no encoder for " << GetParam().fourcc

TEST_P(Video, GivesEveryFrameOnceByItsOwnClock) {
  BEVEL_SKIP_WITHOUT_ENCODER();
  const test::TemporaryFolder pictures;
  const Tracked plain = track_uncompressed(pictures), video = track(SourceKind::video, path_);
  print("uncompressed", plain);
  print(GetParam().name, video);
  EXPECT_EQ(plain.frames, kFrames);
  EXPECT_EQ(video.frames, kFrames);
  EXPECT_EQ(video.failure, "");
  EXPECT_GE(plain.ok, kFrames - 1);
  EXPECT_GE(video.ok, kFrames - 2);
  EXPECT_LT(plain.rms_mm, 0.1);
  EXPECT_LT(video.rms_mm, GetParam().rms_mm);
}

// Whatever the damage: the frames before it, then a failure that names the file, or a refusal to open it. Never more
// frames than there were, never an end as if nothing had been.
TEST_P(Video, DamageIsAFailureThatNamesTheFile) {
  BEVEL_SKIP_WITHOUT_ENCODER();
  const std::string whole = test::text_of(path_);
  std::mt19937 random(5);
  int failures = 0, refused = 0;
  const auto look = [&](const std::string& bytes, const std::string& what) {
    const std::string damaged = folder_.write("damaged-" + std::string(GetParam().file), bytes);
    SourceConfig config;
    config.kind = SourceKind::video;
    config.path = damaged;
    try {
      const auto source = make_frame_source(config);
      int frames = 0;
      FrameResult last = source->next(milliseconds(0));
      for (; std::holds_alternative<Frame>(last); last = source->next(milliseconds(0))) ++frames;
      EXPECT_LT(frames, kFrames) << what;
      ASSERT_TRUE(std::holds_alternative<SourceFailure>(last)) << what << ": " << frames << " frames";
      EXPECT_THAT(std::get<SourceFailure>(last).text, HasSubstr("damaged-")) << what;
      EXPECT_TRUE(std::holds_alternative<EndOfFrames>(source->next(milliseconds(0))));
      ++failures;
    } catch (const SourceError& error) {
      EXPECT_THAT(error.what(), HasSubstr("damaged-")) << what;
      ++refused;
    }
  };
  for (const double share : {0.0, 0.01, 0.3, 0.6, 0.9})
    look(whole.substr(0, static_cast<size_t>(share * static_cast<double>(whole.size()))),
         std::to_string(share) + " of it");
  for (const double from : {0.2, 0.5, 0.7}) {
    std::string bytes = whole;
    const auto first = static_cast<size_t>(from * static_cast<double>(bytes.size()));
    for (size_t i = first; i < first + bytes.size() / 5; ++i) bytes[i] = static_cast<char>(random() & 0xFF);
    look(bytes, "a fifth overwritten from " + std::to_string(from));
  }
  std::printf("%s, seed 5: %d cut or overwritten files fail after their last good frame, %d do not open\n",
              GetParam().name, failures, refused);
}

INSTANTIATE_TEST_SUITE_P(Containers, Video,
                         testing::Values(Container{"MJPEG", "film.avi", "MJPG", 0.12},
                                         Container{"H264", "film.mp4", "avc1", 0.2}),
                         [](const auto& i) { return std::string(i.param.name); });

}  // namespace
}  // namespace bevel::camera
