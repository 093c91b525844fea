// SPDX-License-Identifier: MIT
#pragma once
// What bevel-calibrate writes and [[camera]] calibration = "..." reads: YAML as cv::FileStorage has it, so that any
// program with OpenCV reads it too. Per camera: image_width, image_height, camera_matrix and distortion_coefficients
// (k1 k2 p1 p2 k3) under OpenCV's own names; rotation_camera_from_A and translation_camera_from_A_mm (p_C = R p_A + t);
// `wall` where there is one (projection.hpp); `fit`, figures to be read by people. The last line is a checksum of all
// before it: a file that was cut, or changed by hand, is refused and not half believed.
#include <string>
#include <vector>

#include <bevel/drivers/camera/calibration/camera_model.hpp>
#include <bevel/error.hpp>

namespace bevel::camera {

inline constexpr int kCalibrationVersion = 1;

/// What {A} of a calibration is.
enum class FrameKind {
  none,       ///< provisional, of the first camera (calibrate.hpp): not yet the needle's
  fiducial,   ///< from a board at a known place
  insertion,  ///< from a straight insertion
};

/// How good a camera's fit was; px unless named otherwise.
struct FitFigures {
  int pictures = 0, corners = 0;
  double rms_px = 0.0;                            ///< per corner, both components
  double held_out_rms_px = 0.0;                   ///< on pictures that were not fitted
  std::array<double, kLensParameters> lens_sd{};  ///< standard deviations; 0 of what was held
  std::array<double, kWallParameters> wall_sd{};
};

struct CalibratedCamera {
  CameraModel model;
  FitFigures fit;
};

struct Calibration {
  std::string made_utc;  ///< ISO 8601; told to people, never compared
  FrameKind frame = FrameKind::none;
  std::vector<CalibratedCamera> cameras;
};

/// what() names the file, the thing, the value and what is allowed.
class CalibrationError : public ParseError {
  using ParseError::ParseError;
};

std::string to_yaml(const Calibration& calibration);
/// `name` is the file's, for messages. Throws CalibrationError.
Calibration from_yaml(const std::string& text, const std::string& name);

/// Throws CalibrationError also if the file cannot be read.
Calibration load_calibration(const std::string& path);
/// Written beside and renamed, so that no reader meets half of it. Throws CalibrationError.
void save_calibration(const Calibration& calibration, const std::string& path);

/// The camera of that number; throws CalibrationError naming those that `name` has.
const CalibratedCamera& camera_of(const Calibration& calibration, int number, const std::string& name);

/// `body` with its checksum as the last line; what from_yaml() demands.
std::string with_checksum(const std::string& body);

std::string_view name_of(FrameKind kind);

/// Every camera's pose, for a frame {A'} in which p_A = R p_A' + t.
void move_frame(const cv::Matx33d& R, const cv::Vec3d& t_mm, Calibration& calibration);

}  // namespace bevel::camera
