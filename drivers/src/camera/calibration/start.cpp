// SPDX-License-Identifier: MIT
// First guesses for bundle.hpp: lenses by OpenCV's calibrateCamera, boards by its solvePnP, walls by trying distances.
#include <limits>
#include <opencv2/calib3d.hpp>

#include <bevel/drivers/camera/calibration/calibrate.hpp>
#include <bevel/error.hpp>

namespace bevel::camera {
namespace {

std::vector<cv::Point3f> on_board(const Board& board, const Sighting& seen) {
  std::vector<cv::Point3f> out;
  for (const int id : seen.ids) out.emplace_back(cv::Point3d(board.corner_mm(id)));
  return out;
}

std::vector<cv::Point2f> in_picture(const Sighting& seen) { return {seen.px.begin(), seen.px.end()}; }

cv::Matx33d camera_matrix(const Lens& lens) {
  const auto& p = lens.parameters;
  return {p[kFx], 0, p[kCx], 0, p[kFy], p[kCy], 0, 0, 1};
}

Lens start_lens(const Board& board, const std::vector<Shot>& shots, size_t camera, const cv::Size& size_px,
                const FitOptions& options) {
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> seen;
  for (const Shot& shot : shots) {
    if (shot.immersed || shot.seen[camera].ids.empty()) continue;
    points.push_back(on_board(board, shot.seen[camera]));
    seen.push_back(in_picture(shot.seen[camera]));
  }
  cv::Mat K, distortion;
  std::vector<cv::Mat> rotations, translations;
  try {
    cv::calibrateCamera(points, seen, size_px, K, distortion, rotations, translations,
                        options.fit_k3 ? 0 : cv::CALIB_FIX_K3);
  } catch (const cv::Exception& error) {
    throw DomainError("no lens fits the pictures to begin with: " + error.err);
  }
  Lens lens;
  lens.picture_px = size_px;
  lens.parameters = {K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2), K.at<double>(1, 2)};
  std::copy_n(distortion.ptr<double>(), 5, &lens.parameters[kK1]);
  return lens;
}

// Part of the shots that one camera sees, as if it were the only one.
std::vector<Shot> seen_by(const std::vector<Shot>& shots, size_t camera) {
  std::vector<Shot> out;
  for (const Shot& shot : shots)
    if (!shot.seen[camera].ids.empty()) out.push_back({shot.name, shot.immersed, {shot.seen[camera]}});
  return out;
}

double nearest_depth_mm(const Board& board, const Sighting& seen, const Pose& pose) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const int id : seen.ids) nearest = std::min(nearest, pose(board.corner_mm(id))[2]);
  return nearest;
}

// Seen through a wall square to it a board looks nearer: what lies `h` behind looks h / index behind.
Pose pushed_back(const Pose& apparent, double wall_mm, double index) {
  const double z = apparent.parameters[5];
  const double back = (wall_mm + index * (z - wall_mm)) / z;
  Pose pose = apparent;
  for (int i = 3; i < 6; ++i) pose.parameters[static_cast<size_t>(i)] *= back;
  return pose;
}

// One camera with its wall: a rig of its own, with the boards it sees.
Rig start_camera(const Board& board, const std::vector<Shot>& all, size_t camera, const cv::Size& size_px,
                 const FitOptions& options) {
  const std::vector<Shot> shots = seen_by(all, camera);
  Rig rig;
  rig.lenses = {start_lens(board, all, camera, size_px, options)};
  rig.from_first = {Pose{}};
  rig.walls = {std::nullopt};
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (const Shot& shot : shots) {
    rig.boards.push_back(apparent_pose(board, shot.seen[0], rig.lenses[0]));
    if (shot.immersed) nearest_mm = std::min(nearest_mm, nearest_depth_mm(board, shot.seen[0], rig.boards.back()));
  }
  if (!std::isfinite(nearest_mm)) return rig;
  Rig best;
  double best_px = std::numeric_limits<double>::infinity();
  for (const double share : {0.35, 0.65, 0.9}) {
    Rig tried = rig;
    FlatWall wall;
    wall.pane = options.pane;
    wall.parameters = {0.0, 0.0, share * nearest_mm - options.pane.thickness_mm, options.index};
    if (!(wall.parameters[kDistance] > 0.0)) continue;
    tried.walls = {wall};
    for (size_t s = 0; s < shots.size(); ++s)
      if (shots[s].immersed) tried.boards[s] = pushed_back(rig.boards[s], share * nearest_mm, options.index);
    FitOptions held = options;
    held.fit_index = false;
    try {
      fit_rig(board, shots, held, 1.0, tried);
    } catch (const DomainError&) {
      continue;  // this distance leads nowhere
    }
    const double px = rms(residuals_of(board, shots, tried));
    if (px < best_px) best = tried, best_px = px;
  }
  if (!std::isfinite(best_px))
    throw DomainError("no wall fits the immersed pictures: is the pane's thickness right, is the board behind it?");
  return best;
}

}  // namespace

Pose apparent_pose(const Board& board, const Sighting& seen, const Lens& lens) {
  const auto& p = lens.parameters;
  const cv::Vec<double, 5> distortion(p[kK1], p[kK2], p[kP1], p[kP2], p[kK3]);
  cv::Vec3d rotation, translation;
  if (!cv::solvePnP(on_board(board, seen), in_picture(seen), camera_matrix(lens), distortion, rotation, translation))
    throw DomainError("a board of " + std::to_string(seen.ids.size()) + " corners has no pose");
  Pose pose;
  std::copy_n(rotation.val, 3, pose.parameters.begin());
  std::copy_n(translation.val, 3, &pose.parameters[3]);
  return pose;
}

Pose start_board(const Board& board, const Shot& shot, const Rig& rig) {
  for (size_t c = 0; c < shot.seen.size(); ++c) {
    if (shot.seen[c].ids.empty()) continue;
    Pose pose = apparent_pose(board, shot.seen[c], rig.lenses[c]);
    if (shot.immersed)
      pose = pushed_back(pose, rig.walls[c]->parameters[kDistance] + rig.walls[c]->pane.thickness_mm,
                         rig.walls[c]->parameters[kIndex]);
    return rig.from_first[c].inverse() * pose;
  }
  throw ArgumentError("'" + shot.name + "': no camera found the board in it, allowed: one at least");
}

Rig start_rig(const Board& board, const std::vector<Shot>& shots, const std::vector<cv::Size>& sizes_px,
              const FitOptions& options) {
  Rig rig;
  std::vector<Rig> alone;
  for (size_t c = 0; c < sizes_px.size(); ++c) {
    alone.push_back(start_camera(board, shots, c, sizes_px[c], options));
    rig.lenses.push_back(alone[c].lenses[0]);
    rig.walls.push_back(alone[c].walls[0]);
    rig.from_first.emplace_back();
  }
  // Where each camera alone has the board of each shot: its place in the others follows.
  std::vector<std::vector<std::optional<Pose>>> poses(sizes_px.size(), std::vector<std::optional<Pose>>(shots.size()));
  for (size_t c = 0; c < sizes_px.size(); ++c) {
    size_t own = 0;
    for (size_t s = 0; s < shots.size(); ++s)
      if (!shots[s].seen[c].ids.empty()) poses[c][s] = alone[c].boards[own++];
  }
  for (size_t c = 1; c < sizes_px.size(); ++c) {
    // Of all shots that both see, the one whose answer is nearest to all others'.
    std::vector<Pose> answers;
    for (size_t s = 0; s < shots.size(); ++s)
      if (poses[0][s] && poses[c][s]) answers.push_back(*poses[c][s] * poses[0][s]->inverse());
    const auto sum_of_distances = [&](const Pose& pose) {
      double sum = 0.0;
      for (const Pose& other : answers)
        sum += cv::norm(pose.t_mm() - other.t_mm()) + 100.0 * cv::norm(pose.R(), other.R());
      return sum;
    };
    double best = std::numeric_limits<double>::infinity();
    for (const Pose& answer : answers)
      if (const double sum = sum_of_distances(answer); sum < best) best = sum, rig.from_first[c] = answer;
  }
  for (size_t s = 0; s < shots.size(); ++s) {
    rig.boards.emplace_back();
    for (size_t c = sizes_px.size(); c-- > 0;)
      if (poses[c][s]) rig.boards.back() = rig.from_first[c].inverse() * *poses[c][s];
  }
  return rig;
}

}  // namespace bevel::camera
