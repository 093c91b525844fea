// SPDX-License-Identifier: MIT
// The way of real pictures: boards rendered ray by ray, found by the detector, fitted.
#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>

#include <bevel/error.hpp>
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

// The layout that OpenCV up to 4.5.5 draws for even numbers of rows: markers from the top left, in the first square and
// every second one after it (charuco.cpp of 4.5.4 counts rows from the bottom, and there square 0, 0 is black).
cv::Mat legacy_by_definition(const BoardSpec& spec, int px_per_square) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_250);
  const int margin = px_per_square / 2, side = static_cast<int>(px_per_square * spec.marker_mm / spec.square_mm);
  cv::Mat out(spec.rows * px_per_square + 2 * margin, spec.columns * px_per_square + 2 * margin, CV_8UC1,
              cv::Scalar(255));
  int id = 0;
  for (int row_up = spec.rows - 1; row_up >= 0; --row_up)
    for (int column = 0; column < spec.columns; ++column) {
      const int x = margin + column * px_per_square, y = margin + (spec.rows - 1 - row_up) * px_per_square;
      if (row_up % 2 == column % 2) {
        out(cv::Rect(x, y, px_per_square, px_per_square)) = 0;
      } else {
        cv::Mat marker;
        cv::aruco::drawMarker(dictionary, id++, side, marker);
        marker.copyTo(out(cv::Rect(x + (px_per_square - side) / 2, y + (px_per_square - side) / 2, side, side)));
      }
    }
  return out;
}

TEST(CharucoPatterns, AreThoseOfOpenCv) {
  for (const auto& [columns, rows] : {std::pair(11, 8), {8, 6}, {7, 5}, {6, 9}, {5, 4}}) {
    const BoardSpec spec{BoardKind::charuco, columns, rows, 8.0, 6.0};
    const Board board(spec);
    EXPECT_EQ(board.has_two_patterns(), rows % 2 == 0);
    EXPECT_EQ(cv::norm(board.drawing(80, CharucoPattern::legacy), legacy_by_definition(spec, 80), cv::NORM_INF), 0.0);
    const Sighting legacy = board.find(legacy_by_definition(spec, 80));
    ASSERT_EQ(legacy.ids.size(), static_cast<size_t>(board.corners()));
    EXPECT_EQ(legacy.pattern == CharucoPattern::legacy, rows % 2 == 0) << columns << " x " << rows;
    for (size_t i = 0; i < legacy.ids.size(); ++i) {
      const cv::Vec3d corner = board.corner_mm(legacy.ids[i]);
      EXPECT_NEAR(legacy.px[i].x, 10 * corner[0] + 40 - 0.5, 0.1);
      EXPECT_NEAR(legacy.px[i].y, 10 * corner[1] + 40 - 0.5, 0.1);
    }
    // And the current one as OpenCV 4.6 draws it itself.
    if (CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 6) {
      cv::Mat theirs;
      cv::aruco::CharucoBoard::create(columns, rows, 8.0F, 6.0F,
                                      cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_250))
          ->draw(board.drawing(80).size(), theirs, 40);
      const Sighting current = board.find(theirs);
      EXPECT_EQ(current.ids.size(), static_cast<size_t>(board.corners()));
      EXPECT_EQ(current.pattern, CharucoPattern::current);
    }
  }
}

// In photographs: the lens comes out as well with the legacy pattern as with the current one.
TEST(CharucoPatterns, ALensFromPicturesOfALegacyBoard) {
  const Board board({BoardKind::charuco, 11, 8, 6.0, 4.5});
  const TrueCamera truth;
  std::vector<test::BoardPlace> places;
  auto shots = test::shots_of({truth}, board, 14, 0, 0.0, kSeed, &places);
  for (size_t s = 0; s < shots.size(); ++s) {
    places[s].t_mm -= cv::Vec3d(0, 0, 60);
    shots[s].seen[0] = board.find(test::photograph(truth, board, places[s], false, kSeed + s, CharucoPattern::legacy));
    ASSERT_GE(shots[s].seen[0].ids.size(), 20U) << s;
    EXPECT_EQ(shots[s].seen[0].pattern, CharucoPattern::legacy) << s;
    EXPECT_LT(detection_rms_px(truth, board, places[s], false, shots[s].seen[0]), 0.2) << s;
  }
  const Calibrated got = calibrate(board, test::input_of({truth}, shots));
  const auto& p = got.calibration.cameras[0].model.lens.parameters;
  std::printf("fx %.2f (900), cx %.2f (325), cy %.2f (236), RMS %.3f px\n", p[kFx], p[kCx], p[kCy],
              got.calibration.cameras[0].fit.rms_px);
  EXPECT_NEAR(p[kFx], 900, 4.5);
  EXPECT_NEAR(p[kCx], 325, 4);
  EXPECT_NEAR(p[kCy], 236, 4);
}

// Markers that fit neither pattern: the board has another number of columns, or its rows are displaced.
TEST(CharucoPatterns, ABoardThatFitsNeitherIsRejectedWithTheReason) {
  const Board narrow({BoardKind::charuco, 8, 6, 9.0, 6.75}), wide({BoardKind::charuco, 9, 6, 9.0, 6.75});
  cv::Mat displaced = narrow.drawing(80);
  for (int row = 1; row < 6; row += 2) {  // every second row by a square to the right
    const cv::Mat strip = displaced(cv::Rect(40, 40 + 80 * row, 8 * 80, 80));
    cv::Mat moved(strip.size(), CV_8UC1, cv::Scalar(255));
    strip.colRange(0, 7 * 80).copyTo(moved.colRange(80, 8 * 80));
    moved.copyTo(strip);
  }
  for (const cv::Mat& drawn : {wide.drawing(80), displaced, wide.drawing(80, CharucoPattern::legacy)}) {
    const Sighting seen = narrow.find(drawn);
    EXPECT_TRUE(seen.ids.empty());
    EXPECT_NE(seen.rejected.find("squares from where a board of 8 x 6 squares has them, allowed: 0.25"),
              std::string::npos)
        << seen.rejected;
  }
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
    } catch (const ArgumentError& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("allowed"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace bevel::camera
