// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/calibration/board.hpp>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <bevel/error.hpp>
#include "camera/calibration/charuco.hpp"
#include "camera/calibration/number_text.hpp"

namespace bevel::camera {
namespace {

constexpr int kMarkers = 250;
// Corners and markers of another board are off by a square or more; distortion and noise leave a few hundredths.
constexpr double kMisplaced_squares = 0.25;

// Returns whether the corners fit a plane, up to lens distortion. They do not if the board in the picture has other
// columns or rows than this one.
bool lie_as_on(const Board& board, const Sighting& seen) {
  constexpr size_t kFewest = 8;  // fewer are not used, and four always fit
  if (seen.ids.size() < kFewest) return true;
  std::vector<cv::Point2d> on_board;
  for (const int id : seen.ids) on_board.emplace_back(board.corner_mm(id)[0], board.corner_mm(id)[1]);
  return misfit_squares(on_board, seen.px, board.spec().square_mm) < kMisplaced_squares;
}

// Chessboards come in any of the orders that look alike; `grid` is turned so that it runs as printed.
void turn_as_printed(const cv::Mat& gray, int across, int down, std::vector<cv::Point2f>& grid) {
  const auto at = [&](int row, int col) -> cv::Point2f& {
    return grid[static_cast<size_t>(row) * static_cast<size_t>(across) + static_cast<size_t>(col)];
  };
  const cv::Point2f right = at(0, across - 1) - at(0, 0), below = at(down - 1, 0) - at(0, 0);
  if (right.cross(below) < 0.0F)
    for (int row = 0; row < down; ++row) std::reverse(&at(row, 0), &at(row, 0) + across);
  // The first square is black, its neighbour white; a board on its head has them the other way, if it can be told.
  const cv::Point2f u = at(0, 1) - at(0, 0), v = at(1, 0) - at(0, 0);
  const auto gray_at = [&](const cv::Point2f& p) {
    cv::Mat patch;
    cv::getRectSubPix(gray, {3, 3}, p, patch);
    return cv::mean(patch)[0];
  };
  if (gray_at(at(0, 0) - 0.5F * u - 0.5F * v) > gray_at(at(0, 0) + 0.5F * u - 0.5F * v))
    std::reverse(grid.begin(), grid.end());
}

}  // namespace

void check(const BoardSpec& spec) {
  const auto within = [](const char* key, double value, double low, double high) {
    if (!(value >= low && value <= high))
      throw ArgumentError(std::string("board ") + key + " is " + number_text(value) + ", allowed: " + number_text(low) +
                          " to " + number_text(high));
  };
  within("columns", spec.columns, 4, 60);
  within("rows", spec.rows, 4, 60);
  within("square_mm", spec.square_mm, 0.2, 500.0);
  if (spec.kind == BoardKind::chessboard) return;
  within("marker_mm", spec.marker_mm, 0.3 * spec.square_mm, 0.95 * spec.square_mm);
  within("columns times rows", spec.columns * spec.rows, 16, 2 * kMarkers);
}

Board::Board(const BoardSpec& spec) : spec_(spec) {
  check(spec);
  if (spec.kind == BoardKind::chessboard) return;
  charuco_ = std::make_unique<Charuco>(spec, CharucoPattern::current);
  if (spec.rows % 2 == 0) legacy_ = std::make_unique<Charuco>(spec, CharucoPattern::legacy);
}

Board::~Board() = default;

cv::Vec3d Board::corner_mm(int id) const {
  const int across = spec_.columns - 1, row = id / across, column = id % across;
  return {(column + 1) * spec_.square_mm, (row + 1) * spec_.square_mm, 0.0};
}

Sighting Board::find(const cv::Mat& gray) const {
  if (charuco_) {
    const FoundMarkers markers = charuco_->find_markers(gray);
    if (markers.ids.size() < 2) return {};
    double misfit = charuco_->misfit_squares(markers);
    const Charuco* fits = charuco_.get();
    if (const double other = legacy_ ? legacy_->misfit_squares(markers) : misfit; other < misfit)
      misfit = other, fits = legacy_.get();
    Sighting seen = fits->find_corners(gray, markers);
    if (misfit < kMisplaced_squares && lie_as_on(*this, seen)) return seen;
    Sighting none;
    if (std::isfinite(misfit))
      none.rejected = std::to_string(markers.ids.size()) + " markers are " +
                      number_text(std::round(100 * misfit) / 100) + " squares from where a board of " +
                      std::to_string(spec_.columns) + " x " + std::to_string(spec_.rows) +
                      " squares has them, allowed: " + number_text(kMisplaced_squares) +
                      (legacy_ ? " (current and legacy pattern)" : "") + "; check --columns and --rows";
    return none;
  }
  const cv::Size inner(spec_.columns - 1, spec_.rows - 1);
  std::vector<cv::Point2f> grid;
  Sighting out;
  if (!cv::findChessboardCornersSB(gray, inner, grid, cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY)) return out;
  if (grid.size() != static_cast<size_t>(inner.area())) return out;
  turn_as_printed(gray, inner.width, inner.height, grid);
  for (size_t i = 0; i < grid.size(); ++i) {
    out.ids.push_back(static_cast<int>(i));
    out.px.emplace_back(grid[i]);
  }
  return out;
}

cv::Mat Board::drawing(int px_per_square, CharucoPattern pattern) const {
  if (charuco_) return (pattern == CharucoPattern::legacy && legacy_ ? legacy_ : charuco_)->drawing(px_per_square);
  const int margin = px_per_square / 2;
  const cv::Size size(spec_.columns * px_per_square + 2 * margin, spec_.rows * px_per_square + 2 * margin);
  cv::Mat out(size, CV_8UC1, cv::Scalar(255));
  for (int row = 0; row < spec_.rows; ++row)
    for (int col = row % 2; col < spec_.columns; col += 2)
      out(cv::Rect(margin + col * px_per_square, margin + row * px_per_square, px_per_square, px_per_square)) = 0;
  return out;
}

// Black runs of the drawing as rectangles; runs alike in neighbouring rows are one.
std::string Board::drawing_svg() const {
  constexpr int kSquare_px = 140;  // markers of 7 modules: any usual ratio of marker to square comes out to 0.4 %
  const cv::Mat drawn = drawing(kSquare_px);
  const double mm = spec_.square_mm / kSquare_px;
  const auto length = [&](int px) { return number_text(px * mm); };
  const std::string w = length(drawn.cols), h = length(drawn.rows);
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + w + "mm\" height=\"" + h +
                    "mm\" viewBox=\"0 0 " + w + " " + h + "\">\n<rect width=\"" + w + "\" height=\"" + h +
                    "\" fill=\"#fff\"/>\n<path d=\"";
  const auto runs_of = [&](int row) {
    std::vector<std::pair<int, int>> runs;
    for (int col = 0; col < drawn.cols; ++col) {
      if (drawn.at<uchar>(row, col) >= 128) continue;
      if (runs.empty() || runs.back().second != col) runs.emplace_back(col, col);
      runs.back().second = col + 1;
    }
    return runs;
  };
  for (int row = 0; row < drawn.rows;) {
    const auto runs = runs_of(row);
    int next = row + 1;
    while (next < drawn.rows && runs_of(next) == runs) ++next;
    for (const auto& [from, to] : runs)
      out += "M" + length(from) + " " + length(row) + "H" + length(to) + "V" + length(next) + "H" + length(from) + "z";
    row = next;
  }
  return out + "\"/>\n</svg>\n";
}

}  // namespace bevel::camera
