// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// File that bevel-calibrate writes and [[camera]] calibration = "..." reads: YAML of cv::FileStorage, so that any
/// program with OpenCV can read it. Per camera: image_width, image_height, camera_matrix and distortion_coefficients
/// (k1 k2 p1 p2 k3) under OpenCV's names; rotation_camera_from_A and translation_camera_from_A_mm (p_C = R p_A + t);
/// `wall` if there is one (projection.hpp); `fit`, figures for readers. The last line is a checksum of all lines before
/// it: a truncated or edited file is rejected.
#include <string>
#include <vector>

#include <bevel/drivers/camera/calibration/camera_model.hpp>
#include <bevel/error.hpp>

namespace bevel::camera {

inline constexpr int kCalibrationVersion = 1;  ///< version of the format

/// Definition of the frame {A} of a calibration.
enum class FrameKind {
  none,       ///< provisional, of the first camera (calibrate.hpp): not yet the needle's
  fiducial,   ///< from a board at a known place
  insertion,  ///< from a straight insertion
};

/// Quality of the fit of a camera; px unless stated otherwise.
struct FitFigures {
  int pictures = 0,  ///< number of images
      corners = 0;   ///< number of corners
  /// Root mean square of the residuals per corner, both components, px.
  double rms_px = 0.0;
  /// Root mean square of the residuals of images that were not fitted, px.
  double held_out_rms_px = 0.0;
  /// Standard deviations of the lens parameters; 0 for those that were fixed.
  std::array<double, kLensParameters> lens_sd{};
  /// Standard deviations of the wall parameters; 0 for those that were fixed.
  std::array<double, kWallParameters> wall_sd{};
};

/// One camera of a calibration.
struct CalibratedCamera {
  CameraModel model;  ///< calibrated camera
  FitFigures fit;     ///< quality of the fit
};

/// Content of a calibration file.
struct Calibration {
  std::string made_utc;                   ///< time of the calibration, ISO 8601; for readers only
  FrameKind frame = FrameKind::none;      ///< definition of {A}
  std::vector<CalibratedCamera> cameras;  ///< cameras
};

/// Wrong calibration file. what() names the file, the item, the value and what is allowed.
class CalibrationError : public ParseError {
  using ParseError::ParseError;
};

/// Formats a calibration.
/// @param calibration calibration
/// @return text of the file
std::string to_yaml(const Calibration& calibration);
/// Parses a calibration.
/// @param text text of the file
/// @param name name of the file, for messages
/// @return calibration
/// @throws CalibrationError if the text is not a valid calibration
Calibration from_yaml(const std::string& text, const std::string& name);

/// Reads a calibration file.
/// @param path path of the file
/// @return calibration
/// @throws CalibrationError if the file cannot be read or is not a valid calibration
Calibration load_calibration(const std::string& path);
/// Writes a calibration file: to a temporary file that is then renamed, so that readers never find a partial file.
/// @param calibration calibration
/// @param path        path of the file
/// @throws CalibrationError if the file cannot be written
void save_calibration(const Calibration& calibration, const std::string& path);

/// Returns a camera of a calibration.
/// @param calibration calibration
/// @param number      camera number
/// @param name        name of the file, for messages
/// @return camera; valid as long as the calibration
/// @throws CalibrationError naming the camera numbers of the file if `number` is not one of them
const CalibratedCamera& camera_of(const Calibration& calibration, int number, const std::string& name);

/// Appends the checksum that from_yaml() requires.
/// @param body text of the file without the last line
/// @return text of the file
std::string with_checksum(const std::string& body);

/// Returns the name of a frame definition, as in the file.
/// @param kind definition
/// @return static string
std::string_view name_of(FrameKind kind);

/// Expresses all cameras in a frame {A'} with p_A = R p_A' + t.
/// @param R           rotation matrix
/// @param t_mm        translation, mm
/// @param calibration calibration to change
void move_frame(const cv::Matx33d& R, const cv::Vec3d& t_mm, Calibration& calibration);

}  // namespace bevel::camera
