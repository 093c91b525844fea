// The way of real pictures: boards rendered ray by ray, found by the detector, fitted.
#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "tests/calibration/true_optics.hpp"

namespace bevel::camera {
namespace {

using test::TrueCamera;

constexpr unsigned long long kSeed = 4711;

double detection_rms_px(const TrueCamera& camera, const Board& board, const test::BoardPlace& place, bool immersed,
                        const Sighting& seen) {
  double squares = 0;
  for (size_t i = 0; i < seen.ids.size(); ++i) {
    const cv::Point2d off = seen.px[i] - camera.pixel(place.R * board.corner_mm(seen.ids[i]) + place.t_mm, immersed);
    squares += off.dot(off);
  }
  return std::sqrt(squares / static_cast<double>(seen.ids.size()));
}

class Pictures : public testing::TestWithParam<BoardKind> {
 protected:
  Board board_{{GetParam(), 11, 8, 6.0, 4.5}};
};

// Found where it is, with the numbers it has, whichever way round the board is held.
TEST_P(Pictures, CornersAreFoundWhereTheyAre) {
  const TrueCamera camera;
  double worst = 0;
  for (const double roll : {0.0, 1.4, 3.1, -1.7}) {
    const auto place = test::place_board(board_, {3, -2, 150}, test::turned(0.3, -0.25, roll));
    const Sighting seen = board_.find(test::photograph(camera, board_, place, false, kSeed));
    ASSERT_GE(seen.ids.size(), 60U) << "roll " << roll;
    const double rms = detection_rms_px(camera, board_, place, false, seen);
    worst = std::max(worst, rms);
    EXPECT_LT(rms, 0.15) << "roll " << roll << ", or the numbers are others";
  }
  std::printf("%s: corners within %.3f px RMS of the truth, seed %llu\n",
              GetParam() == BoardKind::charuco ? "charuco" : "chessboard", worst, kSeed);
}

TEST_P(Pictures, ALensFromPictures) {
  const TrueCamera truth;
  std::vector<test::BoardPlace> places;
  auto shots = test::shots_of({truth}, board_, 14, 0, 0.0, kSeed, &places);
  for (size_t s = 0; s < shots.size(); ++s) {
    places[s].t_mm -= cv::Vec3d(0, 0, 60);  // nearer: the board fills the picture
    shots[s].seen[0] = board_.find(test::photograph(truth, board_, places[s], false, kSeed + s));
  }
  const Calibrated got = calibrate(board_, test::input_of({truth}, shots));
  const auto& camera = got.calibration.cameras[0];
  const auto& p = camera.model.lens.parameters;
  std::printf(
      "fx %.2f (900, sd %.2f), fy %.2f (905), cx %.2f (325), cy %.2f (236), k1 %.4f (-0.12); %d pictures, RMS %.3f, "
      "held out %.3f px\n",
      p[kFx], camera.fit.lens_sd[kFx], p[kFy], p[kCx], p[kCy], p[kK1], camera.fit.pictures, camera.fit.rms_px,
      camera.fit.held_out_rms_px);
  EXPECT_NEAR(p[kFx], 900, 4.5);
  EXPECT_NEAR(p[kFy], 905, 4.5);
  EXPECT_NEAR(p[kCx], 325, 4);
  EXPECT_NEAR(p[kCy], 236, 4);
  EXPECT_LT(camera.fit.held_out_rms_px, 0.15);
}

INSTANTIATE_TEST_SUITE_P(Boards, Pictures, testing::Values(BoardKind::charuco, BoardKind::chessboard),
                         [](const auto& of) { return of.param == BoardKind::charuco ? "ChArUco" : "Chessboard"; });

TEST(PictureOfABoard, PartOfACharucoIsEnough) {
  const Board board({BoardKind::charuco, 11, 8, 6.0, 4.5});
  const TrueCamera camera;
  const auto place = test::place_board(board, {38, 0, 120}, test::turned(0.2, 0.2, 0.1));
  const Sighting seen = board.find(test::photograph(camera, board, place, false, kSeed));
  EXPECT_GE(seen.ids.size(), 12U);
  EXPECT_LT(seen.ids.size(), static_cast<size_t>(board.corners()));
  EXPECT_LT(detection_rms_px(camera, board, place, false, seen), 0.2);
}

TEST(PictureOfABoard, NoBoardIsNone) {
  for (const BoardKind kind : {BoardKind::charuco, BoardKind::chessboard}) {
    const Board board({kind, 11, 8, 6.0, 4.5});
    cv::Mat gray(480, 640, CV_8UC1);
    cv::RNG(3).fill(gray, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(gray, gray, {}, 3);
    EXPECT_TRUE(board.find(gray).ids.empty());
    EXPECT_TRUE(board.find(cv::Mat(480, 640, CV_8UC1, cv::Scalar(128))).ids.empty());
  }
  // And a board of another size is not taken for this one.
  const Board small({BoardKind::chessboard, 8, 6, 6.0, 4.5}), large({BoardKind::chessboard, 11, 8, 6.0, 4.5});
  const auto place = test::place_board(small, {0, 0, 150}, test::turned(0.1, 0.1, 0));
  EXPECT_TRUE(large.find(test::photograph(TrueCamera{}, small, place, false, 1)).ids.empty());
}

TEST(PictureOfABoard, ThePrintIsInTrueSize) {
  const Board board({BoardKind::charuco, 7, 5, 8.0, 6.0});
  const std::string svg = board.drawing_svg();
  EXPECT_NE(svg.find("width=\"64mm\" height=\"48mm\""), std::string::npos) << svg.substr(0, 200);
  EXPECT_NE(svg.find("M4 4H12"), std::string::npos) << "the first square is black, 8 mm wide, after a margin of 4 mm";
  EXPECT_EQ(board.find(board.drawing(80)).ids.size(), 24U);
}

TEST(PictureOfABoard, BadBoardsNameTheKey) {
  const std::pair<const char*, BoardSpec> cases[] = {
      {"columns", {BoardKind::charuco, 1, 8, 6, 4}},      {"rows", {BoardKind::chessboard, 8, 3, 6, 4}},
      {"square_mm", {BoardKind::chessboard, 8, 6, 0, 4}}, {"square_mm", {BoardKind::charuco, 8, 6, std::nan(""), 4}},
      {"marker_mm", {BoardKind::charuco, 8, 6, 6, 6}},    {"columns times rows", {BoardKind::charuco, 30, 30, 6, 4}}};
  for (const auto& [key, spec] : cases) {
    try {
      const Board board(spec);
      ADD_FAILURE() << key << " was accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("allowed"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace bevel::camera
