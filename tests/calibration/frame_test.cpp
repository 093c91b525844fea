// SPDX-License-Identifier: MIT
// The frame {A}: from a board at a known place, and from a straight insertion; then, end to end, the tip of a needle in
// the gel from a YAML that was fitted to pictures of boards.
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>

#include <bevel/drivers/camera/calibrated_view.hpp>
#include <bevel/drivers/camera/calibration/frame_fit.hpp>
#include <bevel/error.hpp>
#include "tests/calibration/true_optics.hpp"

namespace bevel::camera {
namespace {

constexpr double kNoise_px = 0.1;
constexpr unsigned long long kSeed = 99;

// {A} of the truth: z down in the pictures, y to the right of the first camera, which looks along x; entry 35 mm above
// the box's middle.
const cv::Matx33d kR_WA = test::turned(0.04, -0.02, 0.03) * cv::Matx33d(0, 1, 0, 0, 0, 1, 1, 0, 0);
const cv::Vec3d kEntry_W = test::kBox_mm + cv::Vec3d(2, -35, -3);
cv::Vec3d to_world(const cv::Vec3d& p_A) { return kR_WA * p_A + kEntry_W; }

struct Fitted {
  Board board{{BoardKind::charuco, 11, 8, 6.0, 4.5}};
  std::vector<test::TrueCamera> cameras = test::two_cameras();
  Calibrated calibrated =
      calibrate(board, test::input_of(cameras, test::shots_of(cameras, board, 20, 16, kNoise_px, kSeed)));
};
const Fitted& fitted() {
  static const Fitted one;
  return one;
}

cv::Vec3d triangulate(const Calibration& calibration, const cv::Vec3d& truth_A, double noise_px,
                      std::mt19937_64& random, bool by_yaml) {
  // As the camera process has it: from the file's text.
  static std::string last_text;
  static std::vector<CalibratedView> views;
  const std::string text = to_yaml(calibration);
  if (text != last_text) {
    views.clear();
    const Calibration read = by_yaml ? from_yaml(text, "rig.yaml") : calibration;
    for (const auto& camera : read.cameras) views.emplace_back(camera.model);
    last_text = text;
  }
  std::normal_distribution<double> noise(0, noise_px);
  cv::Matx33d sum = cv::Matx33d::zeros();
  cv::Vec3d right;
  for (size_t c = 0; c < 2; ++c) {
    const cv::Point2d px =
        fitted().cameras[c].pixel(to_world(truth_A), true) + cv::Point2d(noise(random), noise(random));
    const cv::Matx33d W(views[c].information_per_mm2(px, cv::Matx22d(0.01, 0, 0, 0.01)).data());
    const Vector3 p = views[c].position_mm(px);
    sum += W;
    right += W * cv::Vec3d(p.data());
  }
  return sum.inv() * right;
}

// Largest and RMS error over the box in which a needle goes.
std::pair<double, double> tip_errors_mm(const Calibration& calibration, double noise_px) {
  std::mt19937_64 random(kSeed + 1);
  double squares = 0, worst = 0;
  int count = 0;
  for (const double x : {-10.0, 0.0, 10.0})
    for (const double y : {-10.0, 0.0, 10.0})
      for (const double z : {5.0, 20.0, 35.0, 50.0, 65.0}) {
        const double off = cv::norm(triangulate(calibration, {x, y, z}, noise_px, random, true) - cv::Vec3d(x, y, z));
        squares += off * off;
        worst = std::max(worst, off);
        ++count;
      }
  return {worst, std::sqrt(squares / count)};
}

TEST(Frame, AFiducialGivesTheFrameAndTwoCamerasTheTip) {
  // Immersed at the needle's plane: its x along z of {A}, its y along y; its first corner at (0, -20, 5).
  const FiducialPlace place{rotation_of_axes("+z", "+y"), {0, -20, 5}};
  const test::BoardPlace in_world{kR_WA * place.R_AB, to_world(place.origin_A_mm)};
  std::mt19937_64 random(kSeed + 2);
  Shot fiducial{"fiducial.png", true, {}};
  for (const auto& camera : fitted().cameras)
    fiducial.seen.push_back(test::see(camera, fitted().board, in_world, true, kNoise_px, random));
  Calibration calibration = fitted().calibrated.calibration;
  const FrameFigures figures =
      set_frame_by_fiducial(fitted().board, fiducial, place, fitted().calibrated.rig, calibration);
  const auto [worst_mm, rms_mm] = tip_errors_mm(calibration, kNoise_px);
  std::printf("seed %llu: fiducial RMS %.3f px; tips by the YAML: RMS %.3f mm, largest %.3f mm\n", kSeed,
              figures.rms_px, rms_mm, worst_mm);
  EXPECT_NEAR(figures.rms_px, kNoise_px * std::sqrt(2.0), 0.04);
  EXPECT_LT(rms_mm, 0.15);
  EXPECT_LT(worst_mm, 0.4);
  EXPECT_EQ(calibration.frame, FrameKind::fiducial);
  // The same cameras without their walls.
  for (auto& camera : calibration.cameras) camera.model.wall.reset();
  const auto [straight_worst_mm, straight_rms_mm] = tip_errors_mm(calibration, kNoise_px);
  std::printf("without the walls: RMS %.2f mm, largest %.2f mm\n", straight_rms_mm, straight_worst_mm);
  EXPECT_GT(straight_rms_mm, 5 * rms_mm);
}

std::vector<InsertedTip> straight_insertion(const Calibration& calibration, double noise_px, std::uint64_t seed,
                                            double slip = 1.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  std::vector<InsertedTip> tips;
  for (int half_mm = 8; half_mm <= 128; ++half_mm)
    for (size_t c = 0; c < 2; ++c) {
      const double s = 0.5 * half_mm;
      // The ray and its information as a camera gives them whose frame is that of the first camera: any point of it.
      const cv::Point2d px =
          fitted().cameras[c].pixel(to_world({0, 0, s * slip}), true) + cv::Point2d(noise(random), noise(random));
      const Ray ray = *calibration.cameras[c].model.ray(px);
      const cv::Matx33d across = cv::Matx33d::eye() - ray.direction * ray.direction.t();
      tips.push_back({ray.origin_mm + 37.0 * ray.direction, across * 2000.0, s});
    }
  return tips;
}

TEST(Frame, AStraightInsertionGivesTheFrame) {
  Calibration calibration = fitted().calibrated.calibration;
  const FrameFigures figures =
      set_frame_by_insertion(straight_insertion(calibration, kNoise_px, kSeed + 3), 0.0, calibration);
  std::printf("seed %llu: line RMS %.3f mm, scale %.5f (sd %.5f), tilt sd %.5f rad\n", kSeed + 3, figures.rms_mm,
              figures.scale, figures.scale_sd, figures.tilt_sd_rad);
  EXPECT_NEAR(figures.scale, 1.0, 0.005);
  EXPECT_EQ(calibration.frame, FrameKind::insertion);
  // The angle about z is by the first camera's line of sight; the truth's x is turned from it by what the truth says.
  const cv::Vec3d looks = kR_WA.t() * cv::Vec3d(0, 0, 1);
  const double roll_rad = std::atan2(looks[1], looks[0]);
  Calibration turned = fitted().calibrated.calibration;
  set_frame_by_insertion(straight_insertion(turned, kNoise_px, kSeed + 3), -roll_rad, turned);
  const auto [worst_mm, rms_mm] = tip_errors_mm(turned, kNoise_px);
  std::printf("tips by the YAML: RMS %.3f mm, largest %.3f mm\n", rms_mm, worst_mm);
  EXPECT_LT(rms_mm, 0.15);
  EXPECT_LT(worst_mm, 0.4);
}

TEST(Frame, AnInsertionThatSlipsOrIsSeenByOneEyeIsRefused) {
  struct Case {
    const char* message;
    std::function<std::vector<InsertedTip>(const Calibration&)> tips;
  };
  const Case cases[] = {
      {"of each millimetre inserted 0.8",
       [](const Calibration& c) { return straight_insertion(c, kNoise_px, 1, 0.8); }},
      {"has no depth",
       [](const Calibration& c) {
         std::vector<InsertedTip> one;
         const auto all = straight_insertion(c, kNoise_px, 1);
         for (size_t i = 0; i < all.size(); i += 2) one.push_back(all[i]);
         return one;
       }},
      {"readings of the insertion are 10",
       [](const Calibration& c) {
         auto few = straight_insertion(c, kNoise_px, 1);
         few.resize(10);
         return few;
       }},
      {"mm long",
       [](const Calibration& c) {
         auto tips = straight_insertion(c, kNoise_px, 1);
         tips.resize(30);
         return tips;
       }},
  };
  for (const Case& bad : cases) {
    Calibration calibration = fitted().calibrated.calibration;
    try {
      set_frame_by_insertion(bad.tips(calibration), 0.0, calibration);
      ADD_FAILURE() << bad.message << ": was accepted";
    } catch (const ArgumentError& error) {
      EXPECT_NE(std::string(error.what()).find(bad.message), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("allowed"), std::string::npos) << error.what();
      EXPECT_EQ(calibration.frame, FrameKind::none) << "and nothing was changed";
    }
  }
}

TEST(Frame, AxesOfTheFiducialAreChecked) {
  EXPECT_THROW(rotation_of_axes("+z", "-z"), bevel::ArgumentError);
  EXPECT_THROW(rotation_of_axes("z", "+x"), bevel::ArgumentError);
  const cv::Matx33d R = rotation_of_axes("+z", "+x");
  EXPECT_NEAR(cv::determinant(R), 1.0, 1e-12);
  EXPECT_EQ(R(2, 0), 1.0);
  EXPECT_EQ(R(0, 1), 1.0);
  EXPECT_EQ(R(1, 2), 1.0) << "the way into the board";
}

}  // namespace
}  // namespace bevel::camera
