// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Calibration boards: a chessboard, or a ChArUco board (a chessboard with a marker in each white square, so that a
/// part of it suffices and corners are identified). Frame {B}, mm: origin at the outer corner of the first square, top
/// left as printed, x along the first row, y down, z into the board. Corners are the inner ones, numbered by rows.
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace bevel::camera {

/// Kind of a board.
enum class BoardKind {
  chessboard,  ///< chessboard
  charuco      ///< ChArUco board
};

/// Which squares of a ChArUco board carry markers. The patterns differ for even numbers of rows only.
enum class CharucoPattern {
  current,  ///< the first square, top left, is black: OpenCV 4.6 and later
  legacy,   ///< the first square carries marker 0 if the number of rows is even: OpenCV up to 4.5.5, calib.io
};

/// Dimensions of a board. ChArUco markers are the first of OpenCV's DICT_5X5_250.
struct BoardSpec {
  BoardKind kind = BoardKind::charuco;  ///< kind of the board
  /// Number of squares in a row, not of inner corners.
  int columns = 11;
  int rows = 8;  ///< number of rows of squares
  /// Side of a square as measured on the print, mm.
  double square_mm = 6.0;
  /// Side of a marker, mm; ChArUco only.
  double marker_mm = 4.5;
};

class Charuco;

/// Checks the dimensions of a board.
/// @param spec dimensions
/// @throws ArgumentError naming the key, the value and what is allowed
void check(const BoardSpec& spec);

/// Corners detected in one image; empty if no board was detected.
struct Sighting {
  std::vector<int> ids;         ///< numbers of the corners
  std::vector<cv::Point2d> px;  ///< as long as ids; the centre of the first pixel is 0, 0
  /// Pattern that fits; ChArUco only.
  CharucoPattern pattern = CharucoPattern::current;
  std::string rejected{};  ///< why a board that was seen is not used; empty if none was seen, or it is used
};

/// Detects and draws a board.
class Board {
 public:
  /// Creates a board.
  /// @param spec dimensions
  /// @throws ArgumentError as check() does
  explicit Board(const BoardSpec& spec);
  ~Board();
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  /// @return dimensions
  const BoardSpec& spec() const { return spec_; }
  /// @return number of inner corners
  int corners() const { return (spec_.columns - 1) * (spec_.rows - 1); }
  /// Computes the position of a corner.
  /// @param id number of the corner
  /// @return position in {B}, mm
  cv::Vec3d corner_mm(int id) const;
  /// Returns whether a corner has the same number in every image. A chessboard whose numbers of columns and rows are
  /// both even or both odd looks identical after a rotation by 180 degrees: it suffices for a lens, not for the pose of
  /// a second camera.
  /// @return true if the orientation is unambiguous
  bool oriented() const { return spec_.kind == BoardKind::charuco || (spec_.columns + spec_.rows) % 2 == 1; }

  /// Detects the corners; all or none of a chessboard. A ChArUco board may have either pattern: the one that fits the
  /// markers is used. A board whose markers fit neither is rejected.
  /// @param gray image, CV_8UC1
  /// @return detected corners
  Sighting find(const cv::Mat& gray) const;
  /// @return true if the two patterns of this board differ
  bool has_two_patterns() const { return legacy_ != nullptr; }

  /// Draws the board with a white margin of half a square.
  /// @param px_per_square side of a square, px
  /// @param pattern       pattern; ChArUco only
  /// @return image, CV_8UC1
  cv::Mat drawing(int px_per_square, CharucoPattern pattern = CharucoPattern::current) const;
  /// @return drawing as SVG in true size, for printing without scaling
  std::string drawing_svg() const;

 private:
  BoardSpec spec_;
  std::unique_ptr<Charuco> charuco_, legacy_;  // null: a chessboard; no other pattern
};

}  // namespace bevel::camera
