// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Bundle adjustment: cameras, walls and boards fitted to the corners of all images simultaneously (by Ceres), and the
/// prediction of images that were not fitted. Frames: {B} of the board (board.hpp), and {C0} of the first camera, in
/// which all other cameras and boards are expressed until {A} is known (frame_fit.hpp).
#include <optional>
#include <string>
#include <vector>

#include <bevel/drivers/camera/calibration/board.hpp>
#include <bevel/drivers/camera/calibration/camera_model.hpp>

namespace bevel::camera {

/// Rigid transformation p_to = R p_from + t.
struct Pose {
  std::array<double, 6> parameters{};  ///< angle-axis, rad, then translation, mm, as Ceres expects them
  /// @return rotation matrix
  cv::Matx33d R() const;
  /// @return translation, mm
  cv::Vec3d t_mm() const { return {parameters[3], parameters[4], parameters[5]}; }
  /// Transforms a point.
  /// @param p point in the source frame, mm
  /// @return point in the target frame, mm
  cv::Vec3d operator()(const cv::Vec3d& p) const { return R() * p + t_mm(); }
  /// Creates a pose.
  /// @param R    rotation matrix
  /// @param t_mm translation, mm
  /// @return pose
  static Pose from(const cv::Matx33d& R, const cv::Vec3d& t_mm);
  /// @return inverse transformation
  Pose inverse() const;
  /// Composes two poses.
  /// @param a pose applied second
  /// @param b pose applied first
  /// @return a after b
  friend Pose operator*(const Pose& a, const Pose& b);
};

/// The board at one place, observed by one or several cameras simultaneously.
struct Shot {
  std::string name;  ///< name of the shot
  /// The board is behind the wall, in the gel or in water.
  bool immersed = false;
  std::vector<Sighting> seen;  ///< by camera; empty if the board was not detected
};

/// Options of the fit.
struct FitOptions {
  bool fit_k3 = false;     ///< fit the third radial coefficient of the lens; for wide lenses only
  bool fit_index = false;  ///< fit the refractive index of the gel
  /// Refractive index: 1.333 for water at 20 C at the sodium line; gelatin 1.335 to 1.35.
  double index = 1.333;
  Pane pane;  ///< pane between air and gel
};

/// Cameras, walls and boards.
struct Rig {
  std::vector<Lens> lenses;                    ///< by camera
  std::vector<Pose> from_first;                ///< camera from {C0}, by camera; identity for the first
  std::vector<std::optional<FlatWall>> walls;  ///< by camera; all with one index
  std::vector<Pose> boards;                    ///< {C0} from {B}, by shot
};

/// Returns the model of a camera with {C0} in the place of {A}.
/// @param rig      cameras
/// @param c        index of the camera
/// @param immersed false: without its wall
/// @return model
CameraModel camera_in(const Rig& rig, size_t c, bool immersed);

/// A corner and its residual.
struct Residual {
  size_t camera = 0,        ///< index of the camera
      shot = 0,             ///< index of the shot
      corner = 0;           ///< index of the corner in the sighting
  cv::Point2d at_px,        ///< measured corner, px
      seen_less_fitted_px;  ///< measured minus fitted corner, px
};
/// Computes the residuals of all corners.
/// @param board board
/// @param shots shots
/// @param rig   cameras, walls and boards
/// @return residuals
std::vector<Residual> residuals_of(const Board& board, const std::vector<Shot>& shots, const Rig& rig);
/// Computes the root mean square of the distances.
/// @param residuals residuals
/// @return px; 0 without residuals
double rms(const std::vector<Residual>& residuals);

/// Standard deviations of the parameters of a rig.
struct RigSd {
  std::vector<std::array<double, kLensParameters>> lens;  ///< by camera, in the units of LensParameter
  std::vector<std::array<double, kWallParameters>> wall;  ///< by camera, in the units of WallParameter
  std::vector<std::array<double, 6>> from_first;          ///< by camera, rad and mm
};

/// Fits all parameters.
/// @param board   board
/// @param shots   shots
/// @param options options
/// @param loss_px distance from which a corner has less weight (Huber loss), px; 0: least squares
/// @param rig     initial values; receives the result
/// @throws DomainError with the message of Ceres if Ceres fails
void fit_rig(const Board& board, const std::vector<Shot>& shots, const FitOptions& options, double loss_px, Rig& rig);

/// Computes the standard deviations after a least-squares fit, from the scatter of the residuals.
/// @param board   board
/// @param shots   shots
/// @param options options
/// @param rig     result of fit_rig()
/// @return standard deviations
/// @throws DomainError if the images leave a parameter undetermined
RigSd deviations(const Board& board, const std::vector<Shot>& shots, const FitOptions& options, const Rig& rig);

/// Fits the pose of the board in front of known cameras.
/// @param board  board
/// @param shot   shot
/// @param rig    cameras and walls
/// @param parity parity of the numbers of the corners that are used; negative: all
/// @param pose   initial pose, {C0} from {B}; receives the result
void fit_board(const Board& board, const Shot& shot, const Rig& rig, int parity, Pose& pose);

}  // namespace bevel::camera
