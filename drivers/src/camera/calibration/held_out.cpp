// SPDX-License-Identifier: MIT
// What a calibration is worth: boards that it has not seen. Of such a board the pose is not known, so it is fitted to
// one half of the corners, the cameras held, and judged by the other half; and the other way round. Where two cameras
// see it, its corners are triangulated and compared with the board's own shape.
#include <algorithm>
#include <opencv2/core.hpp>

#include <bevel/drivers/camera/calibration/calibrate.hpp>

namespace bevel::camera {
namespace {

constexpr size_t kEvery = 4;

// Every fourth of those in air and of those immersed; none of a kind of which fewer than four are there.
std::vector<bool> choose(const std::vector<Shot>& shots) {
  std::vector<bool> held(shots.size(), false);
  for (const bool immersed : {false, true}) {
    size_t count = 0;
    for (size_t s = 0; s < shots.size(); ++s)
      if (shots[s].immersed == immersed) held[s] = ++count % kEvery == 0;
  }
  return held;
}

// Root mean square distance after the best turn and shift of `found` onto `true_mm` (Kabsch 1976).
double shape_squares_mm2(const std::vector<cv::Vec3d>& found, const std::vector<cv::Vec3d>& true_mm) {
  cv::Vec3d a, b;
  for (size_t i = 0; i < found.size(); ++i) a += found[i], b += true_mm[i];
  const double count = static_cast<double>(found.size());
  a *= 1.0 / count, b *= 1.0 / count;
  cv::Matx33d cross = cv::Matx33d::zeros();
  for (size_t i = 0; i < found.size(); ++i) cross += (found[i] - a) * (true_mm[i] - b).t();
  cv::Matx33d u, vt;
  cv::Matx31d w;
  cv::SVD::compute(cross, w, u, vt);
  cv::Matx33d flip = cv::Matx33d::eye();
  flip(2, 2) = cv::determinant(u * vt) < 0.0 ? -1.0 : 1.0;
  const cv::Matx33d R = u * flip * vt;
  double squares = 0.0;
  for (size_t i = 0; i < found.size(); ++i) {
    const cv::Vec3d off = found[i] - a - R * (true_mm[i] - b);
    squares += off.dot(off);
  }
  return squares;
}

struct Corners {
  std::vector<cv::Vec3d> board_mm, bent_mm, straight_mm;
};

// Corners that both cameras see, by `rig` as it is and by `straight` without its walls.
Corners triangulate(const Board& board, const Shot& shot, const Rig& rig, const Rig& straight) {
  Corners out;
  for (size_t i = 0; i < shot.seen[0].ids.size(); ++i) {
    const auto& other = shot.seen[1].ids;
    const auto j = std::ranges::find(other, shot.seen[0].ids[i]) - other.begin();
    if (j == static_cast<std::ptrdiff_t>(other.size())) continue;
    const cv::Point2d px[2] = {shot.seen[0].px[i], shot.seen[1].px[static_cast<size_t>(j)]};
    const auto meet = [&](const Rig& by, bool immersed) -> std::optional<cv::Vec3d> {
      std::vector<Ray> rays;
      for (size_t c = 0; c < 2; ++c)
        if (const auto ray = camera_in(by, c, immersed).ray(px[c])) rays.push_back(*ray);
      return rays.size() == 2 ? nearest_to_rays(rays) : std::nullopt;
    };
    const auto bent = meet(rig, shot.immersed), plain = meet(straight, false);
    if (!bent || !plain) continue;
    out.board_mm.push_back(board.corner_mm(shot.seen[0].ids[i]));
    out.bent_mm.push_back(*bent);
    out.straight_mm.push_back(*plain);
  }
  return out;
}

// The lenses and the second camera's place as pictures in air alone have them; `all` where those see no shot together.
Rig in_air(const Board& board, const std::vector<Shot>& shots, const FitOptions& options, const Rig& all) {
  std::vector<Shot> dry;
  Rig rig = all;
  rig.boards.clear();
  int together = 0;
  for (size_t s = 0; s < shots.size(); ++s) {
    if (shots[s].immersed) continue;
    dry.push_back(shots[s]);
    rig.boards.push_back(all.boards[s]);
    together += !shots[s].seen[0].ids.empty() && !shots[s].seen[1].ids.empty() ? 1 : 0;
  }
  if (together >= 3) fit_rig(board, dry, options, 0.0, rig);
  return rig;
}

TriangulationFigures judge(const Board& board, const std::vector<Shot>& held, bool immersed, const Rig& rig,
                           const Rig& straight) {
  TriangulationFigures out;
  out.immersed = immersed;
  double shape = 0.0, shape_straight = 0.0, misplaced = 0.0;
  for (const Shot& shot : held) {
    if (shot.immersed != immersed) continue;
    const Corners corners = triangulate(board, shot, rig, straight);
    if (corners.board_mm.size() < 4) continue;
    ++out.shots;
    out.corners += static_cast<int>(corners.board_mm.size());
    shape += shape_squares_mm2(corners.bent_mm, corners.board_mm);
    shape_straight += shape_squares_mm2(corners.straight_mm, corners.board_mm);
    for (size_t i = 0; i < corners.bent_mm.size(); ++i) {
      const cv::Vec3d off = corners.straight_mm[i] - corners.bent_mm[i];
      misplaced += off.dot(off);
    }
  }
  if (out.corners == 0) return out;
  out.shape_rms_mm = std::sqrt(shape / out.corners);
  if (!immersed) return out;
  out.shape_without_wall_rms_mm = std::sqrt(shape_straight / out.corners);
  out.misplaced_without_wall_mm = std::sqrt(misplaced / out.corners);
  return out;
}

// Corners of a shot that the fit of the other half of them did not use.
std::vector<Residual> unseen_residuals(const Board& board, const Shot& shot, Rig rig) {
  std::vector<Residual> out;
  for (const int parity : {0, 1}) {
    rig.boards = {start_board(board, shot, rig)};
    fit_board(board, shot, rig, parity, rig.boards.front());
    for (const Residual& r : residuals_of(board, {shot}, rig))
      if (shot.seen[r.camera].ids[r.corner] % 2 != parity) out.push_back(r);
  }
  return out;
}

}  // namespace

void hold_out(const Board& board, const CalibrationInput& input, Calibrated& result) {
  const std::vector<bool> held = choose(result.shots);
  std::vector<Shot> fitted, unseen;
  Rig rig = result.rig;
  rig.boards.clear();
  for (size_t s = 0; s < held.size(); ++s) {
    (held[s] ? unseen : fitted).push_back(result.shots[s]);
    if (!held[s]) rig.boards.push_back(result.rig.boards[s]);
  }
  fit_rig(board, fitted, input.options, 0.0, rig);

  std::vector<std::vector<Residual>> by_camera(input.numbers.size());
  for (const Shot& shot : unseen) {
    const auto residuals = unseen_residuals(board, shot, rig);
    for (size_t c = 0; c < input.numbers.size(); ++c) {
      std::vector<Residual> own;
      std::ranges::copy_if(residuals, std::back_inserter(own), [c](const Residual& r) { return r.camera == c; });
      for (PictureFigures& picture : result.pictures)
        if (picture.camera == c && picture.name == shot.name && picture.immersed == shot.immersed && !own.empty())
          picture.held_out_rms_px = rms(own);
      by_camera[c].insert(by_camera[c].end(), own.begin(), own.end());
    }
  }
  for (size_t c = 0; c < by_camera.size(); ++c) result.calibration.cameras[c].fit.held_out_rms_px = rms(by_camera[c]);
  if (input.numbers.size() < 2) return;
  const Rig straight = in_air(board, fitted, input.options, rig);
  for (const bool immersed : {false, true})
    if (const auto figures = judge(board, unseen, immersed, rig, straight); figures.corners > 0)
      result.triangulation.push_back(figures);
}

}  // namespace bevel::camera
