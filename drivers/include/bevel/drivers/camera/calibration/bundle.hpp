// SPDX-License-Identifier: MIT
#pragma once
// Cameras, walls and boards fitted to the corners of all pictures at once (bundle adjustment, by Ceres), and what such
// a fit says of pictures it has not seen. Frames: {B} of the board (board.hpp), {C0} of the first camera, in which all
// others and all boards stand until {A} is known (frame_fit.hpp).
#include <optional>
#include <string>
#include <vector>

#include <bevel/drivers/camera/calibration/board.hpp>
#include <bevel/drivers/camera/calibration/camera_model.hpp>

namespace bevel::camera {

/// p_to = R p_from + t; angle-axis, then mm: as Ceres has it.
struct Pose {
  std::array<double, 6> parameters{};
  cv::Matx33d R() const;
  cv::Vec3d t_mm() const { return {parameters[3], parameters[4], parameters[5]}; }
  cv::Vec3d operator()(const cv::Vec3d& p) const { return R() * p + t_mm(); }
  static Pose from(const cv::Matx33d& R, const cv::Vec3d& t_mm);
  Pose inverse() const;
  friend Pose operator*(const Pose& a, const Pose& b);  ///< a after b
};

/// The board at one place, as one camera or several at once see it.
struct Shot {
  std::string name;
  bool immersed = false;       ///< behind the wall, in the gel or in water
  std::vector<Sighting> seen;  ///< by camera; empty where it was not found
};

struct FitOptions {
  bool fit_k3 = false;  ///< the lens's third radial term: wide lenses only
  bool fit_index = false;
  double index = 1.333;  ///< of water at 20 C, by sodium's light; gelatin 1.335 to 1.35
  Pane pane;
};

struct Rig {
  std::vector<Lens> lenses;
  std::vector<Pose> from_first;                ///< camera from {C0}; that of the first is none
  std::vector<std::optional<FlatWall>> walls;  ///< all of one index
  std::vector<Pose> boards;                    ///< {C0} from {B}, by shot
};

/// Camera `c` with {C0} in the place of {A}, its wall left out on demand.
CameraModel camera_in(const Rig& rig, size_t c, bool immersed);

/// A corner and how far beside it the fit has it, px.
struct Residual {
  size_t camera = 0, shot = 0, corner = 0;  ///< corner: into the sighting
  cv::Point2d at_px, seen_less_fitted_px;
};
std::vector<Residual> residuals_of(const Board& board, const std::vector<Shot>& shots, const Rig& rig);
double rms(const std::vector<Residual>& residuals);  ///< px, of the distance; 0 of none

struct RigSd {
  std::vector<std::array<double, kLensParameters>> lens;
  std::vector<std::array<double, kWallParameters>> wall;
  std::vector<std::array<double, 6>> from_first;  ///< rad, mm
};

/// Improves `rig`; `loss_px`: from where on a corner counts less (Huber's), 0 for least squares. Throws
/// DomainError with the message of Ceres if Ceres fails.
void fit_rig(const Board& board, const std::vector<Shot>& shots, const FitOptions& options, double loss_px, Rig& rig);

/// Standard deviations at the end of a fit by least squares, by the residuals' own scatter. Throws
/// Error if the pictures leave something undetermined.
RigSd deviations(const Board& board, const std::vector<Shot>& shots, const FitOptions& options, const Rig& rig);

/// The board alone, in front of cameras that are known: `pose` is moved to its best; corners whose id has the parity
/// `parity`, or all if that is negative.
void fit_board(const Board& board, const Shot& shot, const Rig& rig, int parity, Pose& pose);

}  // namespace bevel::camera
