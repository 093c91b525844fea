// SPDX-License-Identifier: MIT
// From pixels on: needles drawn as two calibrated cameras see them through their walls, tracked, and put together from
// what the pipeline says of each.
#include <gtest/gtest.h>

#include <cstdio>
#include <deque>
#include <random>

#include <bevel/drivers/camera/calibrated_view.hpp>
#include <bevel/drivers/camera/pipeline.hpp>
#include <bevel/rig/camera/needle_renderer.hpp>
#include "tests/calibration/true_optics.hpp"
#include "tests/camera/scenes.hpp"

namespace bevel::camera {
namespace {

// Frames that are there already.
class Queue : public FrameSource {
 public:
  explicit Queue(std::deque<Frame>& frames) : frames_(frames) {}
  FrameResult next(std::chrono::milliseconds) override {
    if (frames_.empty()) return EndOfFrames{};
    Frame frame = std::move(frames_.front());
    frames_.pop_front();
    return frame;
  }

 private:
  std::deque<Frame>& frames_;
};

TEST(RenderedNeedles, TwoCamerasThroughTheirWallsFindTheTip) {
  constexpr unsigned long long kSeed = 77;
  constexpr int kNeedles = 60;
  auto cameras = test::two_cameras();
  const cv::Matx33d R = test::turned(0.03, 0, 0.02) * cv::Matx33d(0, 1, 0, 0, 0, 1, 1, 0, 0);
  std::vector<std::shared_ptr<const CalibratedView>> views;
  std::vector<CameraSetup> setups;
  std::vector<rig::NeedleRenderer> renderers;
  for (size_t c = 0; c < 2; ++c) {
    cameras[c].t_mm += cameras[c].R * (test::kBox_mm + cv::Vec3d(0, -48, 0));
    cameras[c].R = cameras[c].R * R;
    views.push_back(std::make_shared<CalibratedView>(cameras[c].model(static_cast<int>(c))));
    setups.push_back({static_cast<int32_t>(c), views[c], {}, {}});
    rig::SceneConfig scene;
    scene.size_px = cameras[c].size_px;
    scene.seed = kSeed + c;
    renderers.emplace_back(scene, views[c]);
  }
  std::deque<Frame> frames;
  CameraPipeline pipeline(std::make_unique<Queue>(frames), setups);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> any(-1, 1);
  double squares_mm2 = 0, worst_mm = 0;
  int found = 0;
  for (int n = 0; n < kNeedles; ++n) {
    const auto needle =
        test::space_path({50 + 25 * any(random), 0.004, 0.06 * any(random), 0.06 * any(random), 3 * any(random), 0});
    // The bevel's point: to a side of the axis that both cameras see from where they are.
    const double side_rad = 3 * any(random);
    const cv::Vec3d& heading = needle.tangent;
    const cv::Vec3d one = cv::normalize(heading.cross(cv::Vec3d(1, 0, 0))), other = heading.cross(one);
    const cv::Vec3d point = std::cos(side_rad) * one + std::sin(side_rad) * other;
    for (size_t c = 0; c < 2; ++c) {
      const double roll_rad = renderers[c].roll_seen_rad(needle.points_mm.back(), {heading[0], heading[1], heading[2]},
                                                         {point[0], point[1], point[2]});
      Frame frame;
      frame.camera = static_cast<int32_t>(c);
      frame.seq = n;
      frame.capture_utime = std::int64_t{1'000'000} * (n + 1);
      frame.gray = renderers[c].render(needle.points_mm, roll_rad).gray;
      frames.push_back(std::move(frame));
    }
    cv::Matx33d sum = cv::Matx33d::zeros();
    cv::Vec3d right;
    int seen_by = 0;
    for (int c = 0; c < 2; ++c) {
      const auto got = pipeline.next(std::chrono::milliseconds(0));
      const auto* tip = std::get_if<TipObservation>(&got);
      ASSERT_NE(tip, nullptr);
      if (tip->status != TipStatus::ok) continue;
      const cv::Matx33d W(tip->information_per_mm2.data());
      sum += W;
      right += W * cv::Vec3d(tip->position_mm.data());
      ++seen_by;
    }
    if (seen_by < 2) continue;
    ++found;
    const double off_mm = cv::norm(sum.inv() * right - cv::Vec3d(needle.points_mm.back().data()));
    squares_mm2 += off_mm * off_mm;
    worst_mm = std::max(worst_mm, off_mm);
  }
  std::printf("seed %llu: %d of %d needles found by both, RMS %.3f mm, largest %.3f mm; %.2f and %.2f px/mm\n", kSeed,
              found, kNeedles, std::sqrt(squares_mm2 / found), worst_mm, views[0]->px_per_mm(), views[1]->px_per_mm());
  EXPECT_GE(found, kNeedles * 9 / 10);
  EXPECT_LT(std::sqrt(squares_mm2 / found), 0.15);
}

}  // namespace
}  // namespace bevel::camera
