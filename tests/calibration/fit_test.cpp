// SPDX-License-Identifier: MIT
// Lens, stereo and wall from synthetic boards, projected by other means (true_optics.hpp).
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>

#include <bevel/error.hpp>
#include "tests/calibration/true_optics.hpp"

namespace bevel::camera {
namespace {

using test::TrueCamera;

constexpr double kNoise_px = 0.1;
constexpr unsigned long long kSeed = 20260714;

const Board& board() {
  static const Board one({BoardKind::charuco, 11, 8, 6.0, 4.5});
  return one;
}

double angle_rad(const cv::Matx33d& a, const cv::Matx33d& b) {
  const Pose turn = Pose::from(a * b.t(), {});
  return cv::norm(cv::Vec3d(turn.parameters.data()));
}

TEST(Fit, ALensFromBoardsInAir) {
  TrueCamera truth;
  const std::vector<TrueCamera> cameras{truth};
  std::printf("seed %llu, noise %.2f px each way\n", kSeed, kNoise_px);
  const Calibrated got =
      calibrate(board(), test::input_of(cameras, test::shots_of(cameras, board(), 24, 0, kNoise_px, kSeed)));
  const CalibratedCamera& c = got.calibration.cameras.at(0);
  const auto& p = c.model.lens.parameters;
  const auto& sd = c.fit.lens_sd;
  const double expected[] = {truth.fx, truth.fy, truth.cx, truth.cy, -0.12, 0.08, 0.001, -0.0007};
  const char* names[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"};
  double squares = 0;
  for (size_t i = 0; i < 8; ++i) {
    std::printf("%s: %.5g, true %.5g, sd %.2g\n", names[i], p[i], expected[i], sd[i]);
    EXPECT_LT(std::abs(p[i] - expected[i]), 4 * sd[i]) << names[i];
    squares += std::pow((p[i] - expected[i]) / sd[i], 2);
  }
  EXPECT_LT(squares / 8, 3.0) << "its standard deviations are too small";
  EXPECT_LT(std::abs(p[kFx] - truth.fx), 0.005 * truth.fx);
  EXPECT_LT(std::abs(p[kCx] - truth.cx), 2.0);
  EXPECT_LT(sd[kFx], 0.002 * truth.fx) << "and not so large that anything is within them";
  // Of a distance in two dimensions: noise times the square root of 2.
  std::printf("RMS %.4f px, held out %.4f px; noise %.4f px\n", c.fit.rms_px, c.fit.held_out_rms_px,
              kNoise_px * std::sqrt(2.0));
  EXPECT_NEAR(c.fit.rms_px, kNoise_px * std::sqrt(2.0), 0.01);
  EXPECT_NEAR(c.fit.held_out_rms_px, kNoise_px * std::sqrt(2.0), 0.02);
  EXPECT_GT(c.fit.held_out_rms_px, c.fit.rms_px) << "unseen corners fit no better than those fitted";
}

TEST(Fit, TwoCamerasAndTheirWalls) {
  const auto cameras = test::two_cameras();
  for (const bool fit_index : {false, true}) {
    CalibrationInput in = test::input_of(cameras, test::shots_of(cameras, board(), 20, 16, kNoise_px, kSeed + 1));
    in.options.fit_index = fit_index;
    const Calibrated got = calibrate(board(), in);
    std::printf("--- index %s; seed %llu\n", fit_index ? "fitted" : "held", kSeed + 1);
    for (size_t c = 0; c < 2; ++c) {
      const CalibratedCamera& camera = got.calibration.cameras[c];
      ASSERT_TRUE(camera.model.wall);
      const auto& wall = camera.model.wall->parameters;
      const auto& sd = camera.fit.wall_sd;
      const test::TrueWall& truth = *cameras[c].wall;
      std::printf(
          "camera %zu: wall at %.3f mm (true %.1f, sd %.3f), normal %.5f %.5f (true %.5f %.5f, sd %.5f %.5f), index "
          "%.5f (sd %.5f), RMS %.4f, held out %.4f px\n",
          c, wall[kDistance], truth.distance_mm, sd[kDistance], wall[kNormalX], wall[kNormalY], truth.normal[0],
          truth.normal[1], sd[kNormalX], sd[kNormalY], wall[kIndex], sd[kIndex], camera.fit.rms_px,
          camera.fit.held_out_rms_px);
      EXPECT_LT(std::abs(wall[kDistance] - truth.distance_mm), 4 * sd[kDistance]);
      EXPECT_LT(std::abs(wall[kNormalX] - truth.normal[0]), 4 * sd[kNormalX]);
      EXPECT_LT(std::abs(wall[kNormalY] - truth.normal[1]), 4 * sd[kNormalY]);
      EXPECT_LT(std::abs(wall[kDistance] - truth.distance_mm), fit_index ? 4.0 : 1.0);
      EXPECT_LT(std::abs(wall[kIndex] - 1.333), fit_index ? std::min(4 * sd[kIndex], 0.02) : 1e-12);
      EXPECT_NEAR(camera.fit.held_out_rms_px, kNoise_px * std::sqrt(2.0), 0.02);
    }
    const CameraModel second = camera_in(got.rig, 1, true);
    const double off_mm = cv::norm(second.p_CA_mm - cameras[1].t_mm), off_rad = angle_rad(second.R_CA, cameras[1].R);
    std::printf("second camera: off by %.3f mm and %.5f rad\n", off_mm, off_rad);
    EXPECT_LT(off_mm, 1.0);
    EXPECT_LT(off_rad, 0.004);
    const auto& sd = got.sd.from_first[1];
    for (size_t i = 0; i < 3; ++i)
      EXPECT_LT(std::abs(second.p_CA_mm[static_cast<int>(i)] - cameras[1].t_mm[static_cast<int>(i)]), 4 * sd[3 + i]);
    EXPECT_LT(off_rad, 4 * cv::norm(cv::Vec3d(sd.data())));
    for (const TriangulationFigures& t : got.triangulation)
      std::printf(
          "%s: %d corners of %d shots held out, %.4f mm from the board's shape; by straight rays %.3f mm and misplaced "
          "by %.2f mm\n",
          t.immersed ? "immersed" : "in air", t.corners, t.shots, t.shape_rms_mm, t.shape_without_wall_rms_mm,
          t.misplaced_without_wall_mm);
    ASSERT_EQ(got.triangulation.size(), 2U);
    EXPECT_LT(got.triangulation[0].shape_rms_mm, 0.06);
    EXPECT_LT(got.triangulation[1].shape_rms_mm, 0.06);
    EXPECT_GT(got.triangulation[1].misplaced_without_wall_mm, 1.5) << "what refraction does is seen";
    EXPECT_GT(got.triangulation[1].shape_without_wall_rms_mm, 5 * got.triangulation[1].shape_rms_mm);
  }
}

// What the figure above calls misplaced, by the truth: rays of cameras that are known exactly, but for what lies behind
// the wall.
TEST(Fit, WhatIgnoringRefractionCosts) {
  const auto cameras = test::two_cameras();
  const auto rms_mm = [&](const std::function<void(CameraModel&)>& change) {
    double squares = 0;
    int count = 0;
    for (const double x : {-15.0, 0.0, 15.0})
      for (const double y : {-15.0, 0.0, 15.0})
        for (const double z : {-15.0, 0.0, 15.0}) {
          const cv::Vec3d truth = test::kBox_mm + cv::Vec3d(x, y, z);
          std::vector<Ray> rays;
          for (const TrueCamera& camera : cameras) {
            CameraModel model = camera.model(0);
            change(model);
            rays.push_back(*model.ray(camera.pixel(truth, true)));
          }
          const cv::Vec3d off = *nearest_to_rays(rays) - truth;
          squares += off.dot(off);
          ++count;
        }
    return std::sqrt(squares / count);
  };
  const double straight_mm = rms_mm([](CameraModel& m) { m.wall.reset(); });
  const double index_mm = rms_mm([](CameraModel& m) { m.wall->parameters[kIndex] += 0.01; });
  const double pane_mm =
      rms_mm([](CameraModel& m) { m.wall->pane.thickness_mm = 5.0, m.wall->parameters[kDistance] -= 5.0; });
  std::printf(
      "RMS over a box of 30 mm: without refraction %.2f mm, index wrong by 0.01 %.3f mm, a pane of 5 mm that is not "
      "there %.3f mm\n",
      straight_mm, index_mm, pane_mm);
  EXPECT_LT(rms_mm([](CameraModel&) {}), 1e-6);
  // Near its axis a camera that looks over D of air and h of gel sees what is x beside it at x (D + h) / (D + h / n):
  // at 150 and 80 mm 9.5 % of some 20 mm.
  EXPECT_GT(straight_mm, 1.5);
  EXPECT_LT(straight_mm, 6.0);
  EXPECT_LT(index_mm, 0.1 * straight_mm);
  EXPECT_LT(pane_mm, 0.1 * straight_mm);
}

TEST(Fit, WrongCornersAndMovedBoardsAreLeftOutAndNamed) {
  const std::vector<TrueCamera> cameras{TrueCamera{}};
  auto shots = test::shots_of(cameras, board(), 16, 0, kNoise_px, kSeed + 2);
  std::mt19937_64 random(kSeed + 3);
  std::normal_distribution<double> far(0, 6);
  for (cv::Point2d& px : shots[5].seen[0].px) px += cv::Point2d(far(random), far(random));
  shots[9].seen[0].px[20] += cv::Point2d(4, -3);
  const Calibrated got = calibrate(board(), test::input_of(cameras, shots));
  ASSERT_EQ(got.left_out.size(), 1U);
  EXPECT_NE(got.left_out[0].name.find(shots[5].name), std::string::npos);
  EXPECT_NE(got.left_out[0].why.find("allowed"), std::string::npos);
  EXPECT_GE(got.corners_left_out, 1);
  EXPECT_LE(got.corners_left_out, 3);
  EXPECT_NEAR(got.calibration.cameras[0].fit.rms_px, kNoise_px * std::sqrt(2.0), 0.01);
  EXPECT_NEAR(got.calibration.cameras[0].model.lens.parameters[kFx], 900, 4.5);
}

struct BadInput {
  const char* message;
  std::function<void(CalibrationInput&)> spoil;
};

TEST(Fit, BadInputNamesTheThing) {
  const auto cameras = test::two_cameras();
  const auto good = test::input_of(cameras, test::shots_of(cameras, board(), 8, 4, kNoise_px, kSeed + 4));
  const BadInput cases[] = {
      {"pictures in air with a board are 5",
       [](CalibrationInput& in) { in.shots.erase(in.shots.begin() + 5, in.shots.begin() + 8); }},
      {"immersed pictures with a board are 2", [](CalibrationInput& in) { in.shots.resize(10); }},
      {"both cameras found the board are 2",
       [](CalibrationInput& in) {
         in.shots.resize(8);
         for (size_t s = 2; s < 8; ++s)
           in.shots.push_back({"other", false, {{}, std::exchange(in.shots[s].seen[1], {})}});
       }},
      {"both cameras have the number 0",
       [](CalibrationInput& in) {
         in.numbers = {0, 0};
       }},
      {"cameras are 0", [](CalibrationInput& in) { in.numbers.clear(); }},
  };
  for (const BadInput& bad : cases) {
    CalibrationInput in = good;
    bad.spoil(in);
    try {
      calibrate(board(), in);
      ADD_FAILURE() << bad.message << ": was accepted";
    } catch (const std::exception& error) {
      EXPECT_NE(std::string(error.what()).find(bad.message), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("allowed"), std::string::npos) << error.what();
    }
  }
}

std::vector<Shot> copies_of(const TrueCamera& camera, int count, double noise_px, double shake_mm) {
  std::mt19937_64 random(kSeed + 6);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Shot> shots;
  Sighting first;
  for (int s = 0; s < count; ++s) {
    const cv::Vec3d shake(shake_mm * any(random), shake_mm * any(random), shake_mm * any(random));
    const auto place = test::place_board(board(), test::kBox_mm + shake, test::turned(0.4, 0.3, 0.1));
    Sighting seen = test::see(camera, board(), place, false, noise_px, random);
    if (s == 0) first = seen;
    shots.push_back({"copy" + std::to_string(s) + ".png", false, {noise_px == 0 && shake_mm == 0 ? first : seen}});
  }
  return shots;
}

// A copy looks like a picture that was held out and is predicted by the one that it repeats.
TEST(Fit, CopiesOfOneViewAreRefused) {
  const TrueCamera camera;
  for (const auto& [noise_px, shake_mm] : {std::pair(0.0, 0.0), {kNoise_px, 0.0}, {kNoise_px, 0.5}}) {
    try {
      const auto got = calibrate(board(), test::input_of({camera}, copies_of(camera, 16, noise_px, shake_mm)));
      ADD_FAILURE() << "accepted with fx " << got.calibration.cameras[0].model.lens.parameters[kFx];
    } catch (const ArgumentError& error) {
      EXPECT_NE(std::string(error.what()).find("pictures in air with a board are 1, allowed: 6"), std::string::npos)
          << error.what();
      EXPECT_NE(std::string(error.what()).find("15 more repeat the view of another picture"), std::string::npos)
          << error.what();
    }
  }
}

// Each of 12 views three times: the fit, its standard errors and its held-out figure are those of the 12.
TEST(Fit, CopiesDoNotReduceTheStandardErrors) {
  const std::vector<TrueCamera> cameras{TrueCamera{}};
  const auto once = test::shots_of(cameras, board(), 12, 0, kNoise_px, kSeed + 7);
  auto thrice = once;
  for (const char* copy : {"b", "c"})
    for (const Shot& shot : once) thrice.push_back({copy + shot.name, false, shot.seen});
  const Calibrated alone = calibrate(board(), test::input_of(cameras, once));
  const Calibrated repeated = calibrate(board(), test::input_of(cameras, thrice));
  EXPECT_EQ(repeated.left_out.size(), 24U);
  EXPECT_EQ(repeated.pictures.size(), 12U);
  EXPECT_NE(repeated.left_out[0].why.find("allowed: 6.4 px or more"), std::string::npos) << repeated.left_out[0].why;
  const FitFigures &a = alone.calibration.cameras[0].fit, &b = repeated.calibration.cameras[0].fit;
  for (size_t i = 0; i < kLensParameters; ++i) EXPECT_NEAR(b.lens_sd[i], a.lens_sd[i], 0.01 * a.lens_sd[i]);
  EXPECT_NEAR(b.held_out_rms_px, a.held_out_rms_px, 1e-3);
}

TEST(Fit, CountsTheOrientationsOfTheBoard) {
  const std::vector<TrueCamera> cameras{TrueCamera{}};
  Rig rig;
  std::vector<Shot> shots;
  // Turns about the normal and shifts are no other orientation; 8 degrees are not, 25 degrees are.
  const double eight = 8 * CV_PI / 180, twenty_five = 25 * CV_PI / 180;
  for (const auto& [R, tilts] : {std::pair(test::turned(0, 0, 0), 1),
                                 {test::turned(0, 0, 1.5), 1},
                                 {test::turned(eight, 0, 0), 1},
                                 {test::turned(twenty_five, 0, 0), 2},
                                 {test::turned(0, -twenty_five, 0), 3},
                                 {test::turned(0, -twenty_five, 0.7), 3}}) {
    shots.push_back({"", false, {{{0}, {{1, 1}}}}});
    rig.boards.push_back(Pose::from(R, {1.0 * tilts, 2, 200}));
    EXPECT_EQ(distinct_tilts(shots, rig, 0), tilts);
  }
}

// Boards that are all square to the camera leave the focal length and their distance the same thing.
TEST(Fit, BoardsThatAreNeverTurnedAreRefused) {
  const TrueCamera camera;
  std::mt19937_64 random(kSeed + 5);
  std::vector<Shot> shots;
  for (int s = 0; s < 10; ++s) {
    const auto place = test::place_board(board(), {2.0 * s - 10, 5.0 - s, 230}, cv::Matx33d::eye());
    shots.push_back({std::to_string(s), false, {test::see(camera, board(), place, false, kNoise_px, random)}});
  }
  try {
    const auto got = calibrate(board(), test::input_of({camera}, shots));
    ADD_FAILURE() << "accepted with fx " << got.calibration.cameras[0].model.lens.parameters[kFx] << ", sd "
                  << got.calibration.cameras[0].fit.lens_sd[kFx];
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("turn"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace bevel::camera
