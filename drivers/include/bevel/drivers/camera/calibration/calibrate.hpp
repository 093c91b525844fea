// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Calibration of cameras from sightings of a board, in the order of the source files: initial values (start.cpp), fit
/// without outliers, evaluation by held-out images (held_out.cpp). Uses no files and no clock.
#include <array>
#include <cstdint>

#include <bevel/drivers/camera/calibration/bundle.hpp>
#include <bevel/drivers/camera/calibration/calibration_file.hpp>

namespace bevel::camera {

/// Least number of images in air of one camera that determine a lens.
inline constexpr int kFewestPictures = 6;
/// Least number of corners of a usable image.
inline constexpr int kFewestCorners = 8;

/// Two pictures show the same view if the corners differ by less than this share of the image width, RMS. Distortion
/// and perspective change by less than 1 % over such a displacement, so the second picture adds nothing about the lens.
inline constexpr double kSameViewShare = 0.01;
/// Boards whose normals differ by less than this have the same orientation, degrees: half of the smallest tilt that is
/// requested.
inline constexpr double kDistinctTilt_deg = 10.0;

/// An image that is not used.
struct LeftOut {
  std::string name,  ///< name of the shot
      why;           ///< reason
};

/// Quality of one image.
struct PictureFigures {
  std::string name;       ///< name of the shot
  size_t camera = 0;      ///< index in Calibrated::numbers
  bool immersed = false;  ///< the board is behind the wall
  int corners = 0;        ///< number of corners
  double rms_px = 0.0;    ///< root mean square of the residuals, px
  /// Root mean square of the residuals of a held-out image, px; negative: the image was not held out.
  double held_out_rms_px = -1.0;
};

/// Triangulation by two cameras of the corners of boards that were not fitted.
struct TriangulationFigures {
  int shots = 0,    ///< number of shots
      corners = 0;  ///< number of corners
  /// Root mean square distance of the corners from the board's shape, at any pose, mm.
  double shape_rms_mm = 0.0;
  /// For immersed boards and straight rays of cameras calibrated in air: displacement of the corners, mm.
  double misplaced_without_wall_mm = 0.0;
  /// For the same rays: root mean square distance of the corners from the board's shape, mm.
  double shape_without_wall_rms_mm = 0.0;
  bool immersed = false;  ///< the boards are behind the wall
};

/// Result of a calibration.
struct Calibrated {
  std::vector<int> numbers;  ///< camera numbers
  /// Calibration with FrameKind::none: {A} is provisional, z down in the first camera's image, x ahead, origin among
  /// the boards.
  Calibration calibration;
  Rig rig;   ///< cameras, walls and boards
  RigSd sd;  ///< standard deviations
  /// Shots; sightings that were left out are empty.
  std::vector<Shot> shots;
  std::vector<Residual> residuals;       ///< residuals of the fit
  std::vector<PictureFigures> pictures;  ///< quality of each image
  std::vector<LeftOut> left_out;         ///< images that are not used
  /// In air and immersed; with two cameras only.
  std::vector<TriangulationFigures> triangulation;
  int corners_left_out = 0;  ///< number of corners rejected as outliers
  std::vector<int> tilts;    ///< by camera: board orientations that differ by kDistinctTilt_deg or more
};

/// Input of a calibration.
struct CalibrationInput {
  std::vector<int> numbers;        ///< camera numbers, one or two
  std::vector<cv::Size> sizes_px;  ///< size of the images of each camera, px
  /// Shots with unique names; each with one sighting per camera, empty if nothing was detected.
  std::vector<Shot> shots;
  FitOptions options;  ///< options of the fit
};

/// Calibrates one or two cameras.
/// @param board board
/// @param input sightings
/// @return calibration with its figures
/// @throws ArgumentError naming what is wrong with the input, the value and what is allowed
/// @throws Error if the fit fails or leaves a parameter undetermined
Calibrated calibrate(const Board& board, const CalibrationInput& input);

/// Numbers of repeated views by camera: in air, immersed.
using Copies = std::vector<std::array<int, 2>>;
/// Empties the sightings that repeat the view of an earlier shot (kSameViewShare). Copies are not independent: they
/// reduce the standard errors without reason, and a held-out copy is predicted by the image that it repeats. views.cpp.
/// @param input    input of the calibration
/// @param shots    shots to change
/// @param left_out receives the images that are left out
/// @return numbers of copies
Copies leave_out_copies(const CalibrationInput& input, std::vector<Shot>& shots, std::vector<LeftOut>& left_out);

/// Counts the board orientations that one camera sees, each at least kDistinctTilt_deg from the others. Each
/// orientation gives two constraints on the camera matrix, parallel boards give no more than one of them: Zhang, "A
/// flexible new technique for camera calibration", PAMI 2000, sections 3.1 and 4. views.cpp.
/// @param shots  shots
/// @param rig    cameras and boards
/// @param camera index of the camera
/// @return number of orientations
int distinct_tilts(const std::vector<Shot>& shots, const Rig& rig, size_t camera);

/// Computes initial values of all parameters; start.cpp.
/// @param board    board
/// @param shots    shots
/// @param sizes_px size of the images of each camera, px
/// @param options  options
/// @return initial values
/// @throws DomainError if no lens or wall fits the images
Rig start_rig(const Board& board, const std::vector<Shot>& shots, const std::vector<cv::Size>& sizes_px,
              const FitOptions& options);

/// Computes the pose of a board from one sighting, without a wall; start.cpp.
/// @param board board
/// @param seen  sighting
/// @param lens  lens of the camera
/// @return {C} from {B}
/// @throws DomainError if the corners determine no pose
Pose apparent_pose(const Board& board, const Sighting& seen, const Lens& lens);

/// Computes an initial pose of the board in front of known cameras; start.cpp.
/// @param board board
/// @param shot  shot
/// @param rig   cameras and walls
/// @return {C0} from {B}
/// @throws ArgumentError if no camera detected the board
Pose start_board(const Board& board, const Shot& shot, const Rig& rig);

/// Evaluates a calibration by held-out images: every fourth shot in air and every fourth immersed shot. The other shots
/// are fitted, starting from `rig`; held_out.cpp.
/// @param board  board
/// @param input  input of the calibration
/// @param result calibration; receives held_out_rms_px of the images, that of the cameras, and the triangulation
void hold_out(const Board& board, const CalibrationInput& input, Calibrated& result);

}  // namespace bevel::camera
