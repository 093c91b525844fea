// SPDX-License-Identifier: MIT
#pragma once
// Sightings of a board into calibrated cameras, in the order of the files: a start (start.cpp), the fit with what is
// far out left out, pictures held out (held_out.cpp). Pure: no files, no clock.
#include <array>
#include <cstdint>

#include <bevel/drivers/camera/calibration/bundle.hpp>
#include <bevel/drivers/camera/calibration/calibration_file.hpp>

namespace bevel::camera {

/// Fewer pictures in air, of one camera, fix no lens.
inline constexpr int kFewestPictures = 6;
/// Fewer corners in a picture are no picture.
inline constexpr int kFewestCorners = 8;

/// Two pictures show the same view if the corners differ by less than this share of the image width, RMS. Distortion
/// and perspective change by less than 1 % over such a displacement, so the second picture adds nothing about the lens.
inline constexpr double kSameViewShare = 0.01;
/// Boards whose normals differ by less than this have the same orientation: half of the smallest tilt that is asked
/// for.
inline constexpr double kDistinctTilt_deg = 10.0;

struct LeftOut {
  std::string name, why;
};

/// How one picture fared.
struct PictureFigures {
  std::string name;
  size_t camera = 0;  ///< place in Calibrated::numbers
  bool immersed = false;
  int corners = 0;
  double rms_px = 0.0;
  double held_out_rms_px = -1.0;  ///< of pictures that were held out; negative: was not
};

/// What two cameras say of the corners of a board that was not fitted, mm.
struct TriangulationFigures {
  int shots = 0, corners = 0;
  double shape_rms_mm = 0.0;  ///< corners against the board's own shape, wherever it lies
  /// Of immersed boards, by straight rays of cameras calibrated in air: how far corners are put elsewhere, and against
  /// the board's shape.
  double misplaced_without_wall_mm = 0.0;
  double shape_without_wall_rms_mm = 0.0;
  bool immersed = false;
};

struct Calibrated {
  std::vector<int> numbers;
  /// FrameKind::none: {A} is provisional, z down in the first camera's picture, x ahead, origin among the boards.
  Calibration calibration;
  Rig rig;
  RigSd sd;
  std::vector<Shot> shots;  ///< with what was left out emptied
  std::vector<Residual> residuals;
  std::vector<PictureFigures> pictures;
  std::vector<LeftOut> left_out;
  std::vector<TriangulationFigures> triangulation;  ///< in air, immersed; where there are two cameras
  int corners_left_out = 0;
  std::vector<int> tilts;  ///< by camera: board orientations that differ by kDistinctTilt_deg or more
};

struct CalibrationInput {
  std::vector<int> numbers;        ///< of the cameras, one or two
  std::vector<cv::Size> sizes_px;  ///< of their pictures
  std::vector<Shot> shots;         ///< named uniquely; each with one sighting per camera, empty where nothing was found
  FitOptions options;
};

/// Throws ArgumentError (what is wrong with the input: the thing, the value, what is allowed) or
/// Error (the fit failed or leaves something undetermined).
Calibrated calibrate(const Board& board, const CalibrationInput& input);

/// Numbers of repeated views, by camera: in air, immersed.
using Copies = std::vector<std::array<int, 2>>;
/// Empties the sightings that repeat the view of an earlier shot (kSameViewShare) and appends them to `left_out`.
/// Copies are not independent: they reduce the standard errors without reason, and a copy that is held out is predicted
/// by the picture that it repeats. views.cpp.
Copies leave_out_copies(const CalibrationInput& input, std::vector<Shot>& shots, std::vector<LeftOut>& left_out);

/// Number of board orientations that one camera sees, each at least kDistinctTilt_deg from the others. Each orientation
/// gives two constraints on the camera matrix, parallel boards give no more than one of them: Zhang, "A flexible new
/// technique for camera calibration", PAMI 2000, sections 3.1 and 4. views.cpp.
int distinct_tilts(const std::vector<Shot>& shots, const Rig& rig, size_t camera);

/// First guess of everything; start.cpp.
Rig start_rig(const Board& board, const std::vector<Shot>& shots, const std::vector<cv::Size>& sizes_px,
              const FitOptions& options);

/// Where a board stands by what one camera saw of it, as if there were no wall: {C} from {B}; start.cpp.
Pose apparent_pose(const Board& board, const Sighting& seen, const Lens& lens);

/// A start for the board of a shot in front of known cameras: {C0} from {B}; start.cpp.
Pose start_board(const Board& board, const Shot& shot, const Rig& rig);

/// Holds every fourth shot in air and every fourth immersed out, fits the others from `rig` on, and fills
/// held_out_rms_px of `result.pictures`, of its cameras' fit, and its triangulation; held_out.cpp.
void hold_out(const Board& board, const CalibrationInput& input, Calibrated& result);

}  // namespace bevel::camera
