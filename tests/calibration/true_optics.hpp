// SPDX-License-Identifier: MIT
#pragma once
// Cameras whose truth is known, by other means than those under test: a point in gel is seen along the path of least
// time (Fermat), found by Newton's method over the points where it crosses the pane; pixels by OpenCV's projectPoints;
// pictures by following each pixel's ray, bent by the angles, to the board.
#include <opencv2/core.hpp>
#include <optional>
#include <random>
#include <vector>

#include <bevel/drivers/camera/calibration/calibrate.hpp>

namespace bevel::test {

struct TrueWall {
  cv::Vec3d normal{0, 0, 1};  // unit, in the camera
  double distance_mm = 120.0;
  double index = 1.333;
  double pane_mm = 0.0, pane_index = 1.52;
};

struct TrueCamera {
  cv::Size size_px{640, 480};
  double fx = 900, fy = 905, cx = 325, cy = 236;
  cv::Vec<double, 5> distortion{-0.12, 0.08, 0.001, -0.0007, 0.0};
  cv::Matx33d R = cv::Matx33d::eye();  // camera from world
  cv::Vec3d t_mm{0, 0, 0};
  std::optional<TrueWall> wall;

  cv::Matx33d K() const { return {fx, 0, cx, 0, fy, cy, 0, 0, 1}; }
  cv::Vec3d in_camera(const cv::Vec3d& p) const { return R * p + t_mm; }
  cv::Vec3d in_world(const cv::Vec3d& p_C) const { return R.t() * (p_C - t_mm); }
  // Of a point of the world; behind the wall if `immersed`.
  cv::Point2d pixel(const cv::Vec3d& p, bool immersed) const;
  camera::CameraModel model(int number) const;
};

// Where on the first face of the pane light from `p_C` passes on its way to the camera.
cv::Vec3d crossing_by_fermat(const TrueWall& wall, const cv::Vec3d& p_C);

// p_world = R p_board + t
struct BoardPlace {
  cv::Matx33d R;
  cv::Vec3d t_mm;
};
cv::Matx33d turned(double about_x_rad, double about_y_rad, double about_z_rad);
// Middle of the board at `middle`, turned.
BoardPlace place_board(const camera::Board& board, const cv::Vec3d& middle, const cv::Matx33d& R);

// Corners within the picture, with Gaussian noise of `noise_px` each way.
camera::Sighting see(const TrueCamera& camera, const camera::Board& board, const BoardPlace& place, bool immersed,
                     double noise_px, std::mt19937_64& random);

// A picture of the board: gray wall, blur of the optics, noise.
cv::Mat photograph(const TrueCamera& camera, const camera::Board& board, const BoardPlace& place, bool immersed,
                   std::uint64_t seed, camera::CharucoPattern pattern = camera::CharucoPattern::current);

// Two cameras about 70 degrees apart that look at a box of gel, its middle at `kBox`, each through a wall of its own.
// World: first camera.
std::vector<TrueCamera> two_cameras();
inline const cv::Vec3d kBox_mm(0, 0, 230);

// Boards in both cameras' sight, `count` in air and `immersed` in the gel, as both see them.
std::vector<camera::Shot> shots_of(const std::vector<TrueCamera>& cameras, const camera::Board& board, int in_air,
                                   int immersed, double noise_px, std::uint64_t seed,
                                   std::vector<BoardPlace>* places = nullptr);

camera::CalibrationInput input_of(const std::vector<TrueCamera>& cameras, std::vector<camera::Shot> shots);

}  // namespace bevel::test
