// SPDX-License-Identifier: MIT
#pragma once
// Boards to calibrate with: a chessboard, or a ChArUco board (a chessboard with a marker in each white square, so that
// a part of it is enough and no corner is taken for another). {B}, mm: origin at the outer corner of the first square,
// top left as printed, x along the first row, y down, z into the board. Corners are the inner ones, numbered by rows.
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace bevel::camera {

enum class BoardKind { chessboard, charuco };

/// Which squares of a ChArUco board carry markers. The patterns differ for even numbers of rows only.
enum class CharucoPattern {
  current,  ///< the first square, top left, is black: OpenCV 4.6 and later
  legacy,   ///< the first square carries marker 0 if the number of rows is even: OpenCV up to 4.5.5, calib.io
};

/// ChArUco markers are the first of OpenCV's DICT_5X5_250.
struct BoardSpec {
  BoardKind kind = BoardKind::charuco;
  int columns = 11;  ///< squares, not inner corners
  int rows = 8;
  double square_mm = 6.0;  ///< as measured on the print, not as wished
  double marker_mm = 4.5;  ///< ChArUco only
};

class Charuco;

/// Throws ArgumentError naming the key, the value and what is allowed.
void check(const BoardSpec& spec);

/// Corners found in one picture; empty if there was no board.
struct Sighting {
  std::vector<int> ids;
  std::vector<cv::Point2d> px;                       ///< as long as ids; the centre of the first pixel is 0, 0
  CharucoPattern pattern = CharucoPattern::current;  ///< that fits; ChArUco only
  std::string rejected{};  ///< why a board that was seen is not used; empty if none was seen, or it is used
};

class Board {
 public:
  /// Throws as check() does.
  explicit Board(const BoardSpec& spec);
  ~Board();
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  const BoardSpec& spec() const { return spec_; }
  int corners() const { return (spec_.columns - 1) * (spec_.rows - 1); }
  cv::Vec3d corner_mm(int id) const;
  /// Whether a corner has the same number in whatever picture. A chessboard of as many even or odd columns as rows
  /// looks the same upside down: good for a lens, not for the pose of a second camera.
  bool oriented() const { return spec_.kind == BoardKind::charuco || (spec_.columns + spec_.rows) % 2 == 1; }

  /// Finds the corners; all or none of a chessboard. A ChArUco board may have either pattern: the one that fits the
  /// markers is used. A board whose markers fit neither is rejected.
  /// @param gray CV_8UC1
  Sighting find(const cv::Mat& gray) const;
  /// Whether the two patterns of this board differ.
  bool has_two_patterns() const { return legacy_ != nullptr; }

  /// As printed, with a white margin of half a square; CV_8UC1.
  cv::Mat drawing(int px_per_square, CharucoPattern pattern = CharucoPattern::current) const;
  /// The same as SVG in true size, for printing without scaling.
  std::string drawing_svg() const;

 private:
  BoardSpec spec_;
  std::unique_ptr<Charuco> charuco_, legacy_;  // null: a chessboard; no other pattern
};

}  // namespace bevel::camera
