// SPDX-License-Identifier: MIT
#include "tests/calibration/true_optics.hpp"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace bevel::test {

using camera::Board;
using camera::Shot;
using camera::Sighting;

// Time of travel over X on the first and Y on the second face, X = d n + E a, Y = (d + t) n + E b:
//   |X| + m_g |Y - X| + m |P - Y|, a sum of norms of affine maps, so convex.
cv::Vec3d crossing_by_fermat(const TrueWall& wall, const cv::Vec3d& p) {
  const cv::Vec3d& n = wall.normal;
  const cv::Vec3d e1 = cv::normalize(n.cross(cv::Vec3d(0.3, 1, 0))), e2 = n.cross(e1);
  const double pane_mm = std::max(wall.pane_mm, 1e-9);
  cv::Vec4d at;  // a, b
  const double depth = n.dot(p);
  at = {p.dot(e1) * wall.distance_mm / depth, p.dot(e2) * wall.distance_mm / depth, 0, 0};
  at[2] = at[0] * (wall.distance_mm + pane_mm) / wall.distance_mm,
  at[3] = at[1] * (wall.distance_mm + pane_mm) / wall.distance_mm;
  const bool pane = wall.pane_mm > 0;
  const int unknowns = pane ? 4 : 2;
  const auto time = [&](const cv::Vec4d& u, cv::Mat* gradient, cv::Mat* hessian) {
    const cv::Vec3d x = wall.distance_mm * n + u[0] * e1 + u[1] * e2;
    const cv::Vec3d y = pane ? (wall.distance_mm + pane_mm) * n + u[2] * e1 + u[3] * e2 : x;
    struct Leg {
      cv::Vec3d v;
      double index;
      int plus, minus;  // first unknown that the end and the beginning depend on; -1: none
    };
    std::vector<Leg> legs{{x, 1.0, 0, -1}};
    if (pane) legs.push_back({y - x, wall.pane_index, 2, 0});
    legs.push_back({p - y, wall.index, -1, pane ? 2 : 0});
    double sum = 0;
    if (gradient)
      *gradient = cv::Mat::zeros(unknowns, 1, CV_64F), *hessian = cv::Mat::zeros(unknowns, unknowns, CV_64F);
    for (const Leg& leg : legs) {
      const double length = cv::norm(leg.v);
      sum += leg.index * length;
      if (!gradient) continue;
      cv::Mat E = cv::Mat::zeros(3, unknowns, CV_64F);
      for (int r = 0; r < 3; ++r) {
        if (leg.plus >= 0) E.at<double>(r, leg.plus) += e1[r], E.at<double>(r, leg.plus + 1) += e2[r];
        if (leg.minus >= 0) E.at<double>(r, leg.minus) -= e1[r], E.at<double>(r, leg.minus + 1) -= e2[r];
      }
      const cv::Mat v(leg.v * (1.0 / length));
      *gradient += leg.index * (E.t() * v);
      *hessian += leg.index / length * (E.t() * (cv::Mat::eye(3, 3, CV_64F) - v * v.t()) * E);
    }
    return sum;
  };
  cv::Mat gradient, hessian, step;
  for (int i = 0; i < 50; ++i) {
    const double before = time(at, &gradient, &hessian);
    cv::solve(hessian, -gradient, step, cv::DECOMP_CHOLESKY);
    double share = 1.0;
    cv::Vec4d next = at;
    do {
      next = at;
      for (int k = 0; k < unknowns; ++k) next[k] += share * step.at<double>(k);
      share *= 0.5;
    } while (time(next, nullptr, nullptr) > before + 1e-13 && share > 1e-6);
    at = next;
    if (cv::norm(step) < 1e-12) break;
  }
  return wall.distance_mm * n + at[0] * e1 + at[1] * e2;
}

cv::Point2d TrueCamera::pixel(const cv::Vec3d& p, bool immersed) const {
  cv::Vec3d p_C = in_camera(p);
  if (immersed) p_C = crossing_by_fermat(*wall, p_C);
  std::vector<cv::Point2d> out;
  cv::projectPoints(std::vector<cv::Point3d>{cv::Point3d(p_C)}, cv::Vec3d(), cv::Vec3d(), K(), distortion, out);
  return out.front();
}

camera::CameraModel TrueCamera::model(int number) const {
  camera::CameraModel m;
  m.number = number;
  m.lens.picture_px = size_px;
  m.lens.parameters = {fx, fy, cx, cy, distortion[0], distortion[1], distortion[2], distortion[3], distortion[4]};
  m.R_CA = R;
  m.p_CA_mm = t_mm;
  if (wall)
    m.wall = camera::FlatWall{{wall->normal[0], wall->normal[1], wall->distance_mm, wall->index},
                              {wall->pane_mm, wall->pane_index}};
  return m;
}

cv::Matx33d turned(double about_x_rad, double about_y_rad, double about_z_rad) {
  cv::Matx33d out = cv::Matx33d::eye();
  for (const cv::Vec3d& axis :
       {cv::Vec3d(0, 0, about_z_rad), cv::Vec3d(0, about_y_rad, 0), cv::Vec3d(about_x_rad, 0, 0)}) {
    cv::Matx33d R;
    cv::Rodrigues(axis, R);
    out = R * out;
  }
  return out;
}

BoardPlace place_board(const Board& board, const cv::Vec3d& middle, const cv::Matx33d& R) {
  const cv::Vec3d centre(0.5 * board.spec().columns * board.spec().square_mm,
                         0.5 * board.spec().rows * board.spec().square_mm, 0);
  return {R, middle - R * centre};
}

Sighting see(const TrueCamera& camera, const Board& board, const BoardPlace& place, bool immersed, double noise_px,
             std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, noise_px);
  Sighting out;
  for (int id = 0; id < board.corners(); ++id) {
    const cv::Point2d px = camera.pixel(place.R * board.corner_mm(id) + place.t_mm, immersed);
    if (px.x < 0 || px.y < 0 || px.x > camera.size_px.width - 1 || px.y > camera.size_px.height - 1) continue;
    out.ids.push_back(id);
    out.px.push_back(px + cv::Point2d(noise(random), noise(random)));
  }
  return out;
}

cv::Mat photograph(const TrueCamera& camera, const Board& board, const BoardPlace& place, bool immersed,
                   std::uint64_t seed, camera::CharucoPattern pattern) {
  constexpr int kPrint_px = 80, kFine = 2;  // a square of the print; subpixels each way
  cv::Mat print;
  cv::GaussianBlur(board.drawing(kPrint_px, pattern), print, {}, 1.2);
  const double px_per_mm = kPrint_px / board.spec().square_mm;
  // The same lens takes many pictures.
  static std::vector<double> last_lens;
  static std::vector<cv::Point2d> normalised;
  std::vector<double> lens(camera.distortion.val, camera.distortion.val + 5);
  lens.insert(lens.end(), {camera.fx, camera.fy, camera.cx, camera.cy});
  if (lens != last_lens) {
    std::vector<cv::Point2d> pixels;
    for (int v = 0; v < camera.size_px.height * kFine; ++v)
      for (int u = 0; u < camera.size_px.width * kFine; ++u)
        pixels.emplace_back((u + 0.5) / kFine - 0.5, (v + 0.5) / kFine - 0.5);
    cv::undistortPoints(pixels, normalised, camera.K(), camera.distortion, cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 1e-9));
    last_lens = lens;
  }
  const cv::Matx33d R_BC = place.R.t() * camera.R.t();
  const cv::Vec3d origin = camera.in_camera(place.t_mm);  // of the board, in the camera
  cv::Mat map(camera.size_px.height * kFine, camera.size_px.width * kFine, CV_32FC2);
  for (size_t i = 0; i < normalised.size(); ++i) {
    cv::Vec3d from(0, 0, 0), along = cv::normalize(cv::Vec3d(normalised[i].x, normalised[i].y, 1));
    if (immersed) {
      const TrueWall& wall = *camera.wall;
      const double angle = std::acos(along.dot(wall.normal));
      const cv::Vec3d aside = angle > 1e-12 ? cv::normalize(along - std::cos(angle) * wall.normal) : cv::Vec3d(0, 0, 0);
      const double in_pane = std::asin(std::sin(angle) / wall.pane_index),
                   in_gel = std::asin(std::sin(angle) / wall.index);
      from = (wall.distance_mm + wall.pane_mm) * wall.normal +
             (wall.distance_mm * std::tan(angle) + wall.pane_mm * std::tan(in_pane)) * aside;
      along = std::cos(in_gel) * wall.normal + std::sin(in_gel) * aside;
    }
    const cv::Vec3d from_B = R_BC * (from - origin), along_B = R_BC * along;
    const cv::Vec3d hit = from_B - from_B[2] / along_B[2] * along_B;
    // The print has a margin of half a square, and its first pixel's centre is at half a pixel.
    map.ptr<cv::Vec2f>()[i] = {static_cast<float>(hit[0] * px_per_mm + 0.5 * kPrint_px - 0.5),
                               static_cast<float>(hit[1] * px_per_mm + 0.5 * kPrint_px - 0.5)};
  }
  cv::Mat fine, out;
  cv::remap(print, fine, map, {}, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(140));
  cv::resize(fine, out, camera.size_px, 0, 0, cv::INTER_AREA);
  out.convertTo(out, CV_32F, 0.7, 30);
  cv::GaussianBlur(out, out, {}, 0.6);
  cv::Mat noise(out.size(), CV_32F);
  cv::RNG(seed).fill(noise, cv::RNG::NORMAL, 0, 2.0);
  out += noise;
  out.convertTo(out, CV_8U);
  return out;
}

std::vector<TrueCamera> two_cameras() {
  TrueCamera left, right;
  left.wall = TrueWall{cv::normalize(cv::Vec3d(0.04, -0.03, 1)), 150.0, 1.333, 0.0, 1.52};
  right.fx = 870, right.fy = 868, right.cx = 314, right.cy = 243;
  right.distortion = {-0.09, 0.05, -0.0006, 0.0009, 0.0};
  right.wall = TrueWall{cv::normalize(cv::Vec3d(-0.05, 0.02, 1)), 160.0, 1.333, 0.0, 1.52};
  // Turned about the box's vertical by 70 degrees, and back by 240 mm from it.
  const cv::Matx33d R = turned(0.05, 70.0 * CV_PI / 180.0, 0.02);
  right.R = R;
  right.t_mm = cv::Vec3d(2, -3, 240) - R * kBox_mm;
  return {left, right};
}

std::vector<Shot> shots_of(const std::vector<TrueCamera>& cameras, const Board& board, int in_air, int immersed,
                           double noise_px, std::uint64_t seed, std::vector<BoardPlace>* places) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Shot> shots;
  // A board is turned toward the middle between the cameras, or toward the only one.
  const double between_rad = cameras.size() > 1 ? -35.0 * CV_PI / 180.0 : 0.0;
  for (int s = 0; s < in_air + immersed; ++s) {
    Shot shot;
    shot.immersed = s >= in_air;
    shot.name = (shot.immersed ? "wet" : "dry") + std::to_string(s) + ".png";
    const double tilt = cameras.size() > 1 ? 0.30 : 0.45;
    const cv::Matx33d R = turned(tilt * any(random), between_rad + tilt * any(random), 0.5 * any(random));
    const double reach = shot.immersed ? 12 : 20;
    const cv::Vec3d middle = kBox_mm + cv::Vec3d(reach * any(random), reach * any(random), reach * any(random));
    const BoardPlace place = place_board(board, middle, R);
    for (const TrueCamera& camera : cameras)
      shot.seen.push_back(see(camera, board, place, shot.immersed, noise_px, random));
    shots.push_back(std::move(shot));
    if (places) places->push_back(place);
  }
  return shots;
}

camera::CalibrationInput input_of(const std::vector<TrueCamera>& cameras, std::vector<Shot> shots) {
  camera::CalibrationInput in;
  for (size_t c = 0; c < cameras.size(); ++c) {
    in.numbers.push_back(static_cast<int>(c));
    in.sizes_px.push_back(cameras[c].size_px);
  }
  in.shots = std::move(shots);
  return in;
}

}  // namespace bevel::test
