// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/calibration/frame_fit.hpp>

#include <algorithm>

#include <bevel/error.hpp>
#include "camera/calibration/number_text.hpp"

namespace bevel::camera {
namespace {

constexpr int kFewestReadings = 20;
constexpr double kShortest_mm = 20.0;
constexpr double kScaleWithin = 0.05;
constexpr double kLeastSeen = 1e-7;  // share of the best seen direction below which another is not seen

cv::Vec3d axis_named(const std::string& text, const char* of) {
  const bool good = text.size() == 2 && (text[0] == '+' || text[0] == '-') && text[1] >= 'x' && text[1] <= 'z';
  if (!good) throw ArgumentError(std::string(of) + " is '" + text + "', allowed: +x, -x, +y, -y, +z, -z of {A}");
  cv::Vec3d axis;
  axis[text[1] - 'x'] = text[0] == '+' ? 1.0 : -1.0;
  return axis;
}

struct Line {
  cv::Vec6d o_and_d;
  cv::Matx66d covariance;
};

// Weighted least squares: sum of (o + s d - p)^T W (o + s d - p).
Line fit_line(const std::vector<InsertedTip>& tips) {
  cv::Matx66d normal = cv::Matx66d::zeros();
  cv::Vec6d right;
  for (const InsertedTip& tip : tips) {
    const double s[2] = {1.0, tip.insertion_mm / 100.0};  // scaled, so that both halves weigh alike
    const cv::Vec3d seen = tip.information_per_mm2 * tip.position_mm;
    for (int i = 0; i < 6; ++i) {
      right[i] += s[i / 3] * seen[i % 3];
      for (int j = 0; j < 6; ++j) normal(i, j) += s[i / 3] * s[j / 3] * tip.information_per_mm2(i % 3, j % 3);
    }
  }
  cv::Vec6d values;
  cv::Matx66d vectors;
  cv::eigen(normal, values, vectors);
  if (!(values[5] > kLeastSeen * values[0]))
    throw ArgumentError(
        "the insertion's line has no depth: seen by one camera only, or along one direction; allowed: readings of two "
        "cameras "
        "that look from different sides");
  Line line;
  line.covariance = normal.inv(cv::DECOMP_CHOLESKY);
  line.o_and_d = line.covariance * right;
  for (int i = 3; i < 6; ++i) {
    line.o_and_d[i] /= 100.0;
    for (int j = 0; j < 6; ++j) line.covariance(i, j) /= 100.0, line.covariance(j, i) /= 100.0;
  }
  return line;
}

}  // namespace

cv::Matx33d rotation_of_axes(const std::string& board_x_along, const std::string& board_y_along) {
  const cv::Vec3d x = axis_named(board_x_along, "the axis along the board's x"),
                  y = axis_named(board_y_along, "the axis along the board's y");
  if (x.dot(y) != 0.0)
    throw ArgumentError("the board's x and y lie along " + board_x_along + " and " + board_y_along +
                        ", allowed: two different axes of {A}");
  const cv::Vec3d z = x.cross(y);
  return {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
}

FrameFigures set_frame_by_fiducial(const Board& board, const Shot& fiducial, const FiducialPlace& place, const Rig& rig,
                                   Calibration& calibration) {
  for (size_t c = 0; c < rig.lenses.size(); ++c)
    if (fiducial.immersed && !fiducial.seen[c].ids.empty() && !rig.walls[c])
      throw ArgumentError("'" + fiducial.name + "' is immersed and camera " + std::to_string(c) +
                          " has no wall; allowed: immersed pictures of it too");
  if (!board.oriented())
    throw ArgumentError(
        "the chessboard looks the same upside down; allowed as a fiducial: an even number of squares one "
        "way and an odd one the other, or ChArUco");
  Rig alone = rig;
  Pose pose = start_board(board, fiducial, rig);
  fit_board(board, fiducial, rig, -1, pose);
  alone.boards = {pose};
  FrameFigures figures;
  const auto residuals = residuals_of(board, {fiducial}, alone);
  figures.rms_px = rms(residuals);
  figures.readings = static_cast<int>(residuals.size());
  for (size_t c = 0; c < rig.from_first.size(); ++c) {
    calibration.cameras[c].model.R_CA = rig.from_first[c].R();
    calibration.cameras[c].model.p_CA_mm = rig.from_first[c].t_mm();
  }
  // p_C0 = pose(p_B), p_B = R_AB^T (p_A - origin).
  const cv::Matx33d R = pose.R() * place.R_AB.t();
  move_frame(R, pose.t_mm() - R * place.origin_A_mm, calibration);
  calibration.frame = FrameKind::fiducial;
  return figures;
}

FrameFigures set_frame_by_insertion(const std::vector<InsertedTip>& tips, double roll_rad, Calibration& calibration) {
  if (static_cast<int>(tips.size()) < kFewestReadings)
    throw ArgumentError("readings of the insertion are " + std::to_string(tips.size()) +
                        ", allowed: " + std::to_string(kFewestReadings) + " or more");
  const auto [low, high] = std::ranges::minmax(tips, {}, &InsertedTip::insertion_mm);
  if (!(high.insertion_mm - low.insertion_mm >= kShortest_mm))
    throw ArgumentError("the insertion is " + number_text(high.insertion_mm - low.insertion_mm) +
                        " mm long, allowed: " + number_text(kShortest_mm) + " mm or more");
  const Line line = fit_line(tips);
  const cv::Vec3d o(line.o_and_d.val), d(&line.o_and_d.val[3]);
  FrameFigures figures;
  figures.readings = static_cast<int>(tips.size());
  figures.scale = cv::norm(d);
  const cv::Vec3d z = d * (1.0 / figures.scale);
  if (!(std::abs(figures.scale - 1.0) <= kScaleWithin))
    throw ArgumentError(
        "of each millimetre inserted " + number_text(figures.scale) +
        " mm are seen, allowed: 0.95 to 1.05; the needle slips in its drive, square_mm is not that of the "
        "print, or the wall is not where it was");
  double squares = 0.0, chi2 = 0.0;
  int axes = 0;
  for (const InsertedTip& tip : tips) {
    const cv::Vec3d off = tip.position_mm - o - tip.insertion_mm * d;
    chi2 += off.dot(tip.information_per_mm2 * off);
    cv::Vec3d values;
    cv::Matx33d vectors;
    cv::eigen(tip.information_per_mm2, values, vectors);
    for (int i = 0; i < 3; ++i) {
      if (!(values[i] > kLeastSeen * values[0])) continue;
      const double along = vectors(i, 0) * off[0] + vectors(i, 1) * off[1] + vectors(i, 2) * off[2];
      squares += along * along;
      ++axes;
    }
  }
  figures.rms_mm = std::sqrt(squares / axes);
  // What the readings' scatter says, where that is more than they claim.
  const double worse = std::max(1.0, chi2 / std::max(1, axes - 6));
  const cv::Matx33d of_d = worse * line.covariance.get_minor<3, 3>(3, 3);
  figures.scale_sd = std::sqrt(z.dot(of_d * z));
  const cv::Matx33d across = cv::Matx33d::eye() - z * z.t();
  cv::Vec3d tilts;
  cv::eigen(across * of_d * across, tilts);
  figures.tilt_sd_rad = std::sqrt(std::max(0.0, tilts[0])) / figures.scale;

  const cv::Vec3d looks = calibration.cameras.front().model.R_CA.t() * cv::Vec3d(0, 0, 1);
  const cv::Vec3d beside = looks - looks.dot(z) * z;
  if (!(cv::norm(beside) > 0.3))
    throw ArgumentError("camera " + std::to_string(calibration.cameras.front().model.number) +
                        " looks along the needle; allowed: 20 degrees or more from it");
  const cv::Vec3d x0 = cv::normalize(beside), y0 = z.cross(x0);
  const cv::Vec3d x = std::cos(roll_rad) * x0 + std::sin(roll_rad) * y0, y = z.cross(x);
  move_frame({x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]}, o, calibration);
  calibration.frame = FrameKind::insertion;
  return figures;
}

}  // namespace bevel::camera
