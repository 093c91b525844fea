#include "drivers/camera/calibration/board.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "drivers/camera/calibration/number_text.hpp"

namespace bevel::camera {

struct Board::Charuco {
  cv::Ptr<cv::aruco::Dictionary> dictionary;
  cv::Ptr<cv::aruco::CharucoBoard> board;
  std::map<int, int> ours;  // number of a corner, by OpenCV's
  cv::Point2d shift_px;  // of its corners: some versions count pixels from their edge, 0.5 more than the rest of OpenCV

  Sighting find(const cv::Mat& gray) const {
    std::vector<std::vector<cv::Point2f>> markers;
    std::vector<int> marker_ids;
    cv::aruco::detectMarkers(gray, dictionary, markers, marker_ids, cv::aruco::DetectorParameters::create());
    Sighting out;
    if (marker_ids.empty()) return out;
    std::vector<cv::Point2f> corners;
    std::vector<int> ids;
    cv::aruco::interpolateCornersCharuco(markers, marker_ids, gray, board, corners, ids);
    for (size_t i = 0; i < ids.size(); ++i) {
      out.ids.push_back(ids[i]);
      out.px.push_back(cv::Point2d(corners[i]) - shift_px);
    }
    return out;
  }
};

namespace {

constexpr int kMarkers = 250;

// Whether corners lie in the picture as they do on the board, up to a lens: where the board has other columns or rows
// than this one its markers are taken for others, and corners lie squares beside where a plane would show them.
bool lie_as_on(const Board& board, const Sighting& seen) {
  constexpr size_t kFewest = 8;  // fewer are not used, and four always fit
  if (seen.ids.size() < kFewest) return true;
  std::vector<cv::Point2d> on_board;
  for (const int id : seen.ids) on_board.emplace_back(board.corner_mm(id)[0], board.corner_mm(id)[1]);
  const cv::Mat homography = cv::findHomography(on_board, seen.px);
  if (homography.empty()) return false;
  std::vector<cv::Point2d> shown, next = on_board, shown_next;
  for (cv::Point2d& p : next) p.x += board.spec().square_mm;
  cv::perspectiveTransform(on_board, shown, homography);
  cv::perspectiveTransform(next, shown_next, homography);
  std::vector<double> off_squares;
  for (size_t i = 0; i < shown.size(); ++i)
    off_squares.push_back(cv::norm(seen.px[i] - shown[i]) / std::max(1e-9, cv::norm(shown_next[i] - shown[i])));
  const auto middle = off_squares.begin() + static_cast<std::ptrdiff_t>(off_squares.size() / 2);
  std::nth_element(off_squares.begin(), middle, off_squares.end());
  return *middle < 0.25;
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
      throw std::invalid_argument(std::string("board ") + key + " is " + number_text(value) +
                                  ", allowed: " + number_text(low) + " to " + number_text(high));
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
  charuco_ = std::make_unique<Charuco>();
  charuco_->dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_250);
  charuco_->board = cv::aruco::CharucoBoard::create(spec.columns, spec.rows, static_cast<float>(spec.square_mm),
                                                    static_cast<float>(spec.marker_mm), charuco_->dictionary);
  // Versions of OpenCV number corners from above or below: asked of the drawing itself.
  constexpr int kSquare_px = 64;
  const Sighting all = charuco_->find(drawing(kSquare_px));
  cv::Point2d off;
  for (size_t i = 0; i < all.ids.size(); ++i) {
    // Its edges lie between two pixels, half a pixel before the centre of the second.
    const cv::Point2d square = (all.px[i] + cv::Point2d(0.5, 0.5)) / kSquare_px - cv::Point2d(1.5, 1.5);
    const cv::Point2d whole(std::round(square.x), std::round(square.y));
    off += (square - whole) * kSquare_px;
    charuco_->ours[all.ids[i]] = static_cast<int>(whole.y * (spec.columns - 1) + whole.x);
  }
  // Whole halves: the rest is what the corners of so perfect a picture are found to.
  if (!all.ids.empty()) off /= static_cast<double>(all.ids.size());
  charuco_->shift_px = {std::round(2.0 * off.x) / 2.0, std::round(2.0 * off.y) / 2.0};
  if (static_cast<int>(charuco_->ours.size()) != corners())
    throw std::invalid_argument("board: of its own drawing " + std::to_string(charuco_->ours.size()) + " of " +
                                std::to_string(corners()) + " corners are found, allowed: all; marker_mm is " +
                                number_text(spec.marker_mm) + " of square_mm " + number_text(spec.square_mm));
}

Board::~Board() = default;

cv::Vec3d Board::corner_mm(int id) const {
  const int across = spec_.columns - 1, row = id / across, column = id % across;
  return {(column + 1) * spec_.square_mm, (row + 1) * spec_.square_mm, 0.0};
}

Sighting Board::find(const cv::Mat& gray) const {
  if (charuco_) {
    Sighting theirs = charuco_->find(gray);
    for (int& id : theirs.ids) id = charuco_->ours.at(id);
    return lie_as_on(*this, theirs) ? theirs : Sighting{};
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

cv::Mat Board::drawing(int px_per_square) const {
  const int margin = px_per_square / 2;
  const cv::Size size(spec_.columns * px_per_square + 2 * margin, spec_.rows * px_per_square + 2 * margin);
  cv::Mat out(size, CV_8UC1, cv::Scalar(255));
  if (charuco_) {
    charuco_->board->draw(size, out, margin);
    return out;
  }
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
