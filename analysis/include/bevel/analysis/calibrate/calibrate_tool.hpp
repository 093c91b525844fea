// SPDX-License-Identifier: MIT
#pragma once
// bevel-calibrate: pictures of a board to a YAML of cameras and a page that says how good they are; the frame {A} from
// a fiducial or from the log of a straight insertion; a board to print; how late the stamps of cameras are.
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include <bevel/drivers/camera/calibration/frame_fit.hpp>

namespace bevel::analysis {

struct CalibrateOptions {
  std::string pattern = "charuco";
  camera::BoardSpec board;
  std::string print_board;  // file to draw the board into, .svg or .png; nothing else is done

  std::vector<double> numbers{0, 1};       // of the cameras, in the order of the folders
  std::vector<std::string> air, immersed;  // a folder per camera; pictures of one name are of one moment
  std::vector<std::string> fiducial;       // a picture per camera
  bool fiducial_immersed = false;
  std::string fiducial_x = "+z", fiducial_y = "+y";
  std::vector<double> fiducial_origin_mm{0, 0, 0};
  camera::FitOptions fit;
  double gel_index = 0;  // of the gel that takes the water's place after the pictures; 0: what the pictures have

  std::string calibration;  // a YAML to give a frame to ...
  std::string insertion;    // ... by this log
  double roll_deg = 0;

  std::string latency;  // log of an insertion that stops and goes: how late its cameras are ...
  std::string model;    // ... by the needle of this model file

  std::string out_folder = "calibration";
};

// What there is to do, by the options; the exit status. Throws with a message that names what is wrong.
int run(const CalibrateOptions& options, std::ostream& out, std::ostream& err);

// Of --latency; the exit status, kFailed where nothing can be said of a camera.
int fit_latency(const CalibrateOptions& options, std::ostream& out, std::ostream& err);

// The pictures of all folders, found boards and what was left out already.
struct BoardPictures {
  camera::CalibrationInput input;
  camera::Shot fiducial;  // no sightings if there is none
  std::vector<camera::LeftOut> left_out;
  int unreadable = 0;
  std::optional<camera::CharucoPattern> pattern;  // of the board, if it has two and was found
  std::vector<std::string> remarks;               // on orientation tags and bit depths, once per folder
};
// Throws ArgumentError: a folder without pictures, pictures of different sizes or of boards with different
// patterns.
BoardPictures read_pictures(const camera::Board& board, const CalibrateOptions& options);
std::string name_of(camera::CharucoPattern pattern);

// Settings that the report prints in addition to the calibration.
struct BoardSettings {
  std::string board;  // in words
  std::vector<camera::LeftOut> left_out;
  std::string frame;  // how {A} was found, in words
  std::string yaml_path;
  std::vector<std::string> tables;  // [[camera]] of a system file
};
/// Largest standard error of the focal lengths and the principal point of a camera, relative to fx: what a length of
/// one mm is wrong by, in mm.
double lens_error(const camera::Calibrated& calibrated, std::size_t camera);

/// Whether a calibration can be used: from the error on pictures that were held out, the standard errors of the lens,
/// the orientations of the board, systematic residuals, and the part of the image that the board covered.
struct CalibrationVerdict {
  enum class Tone { good, warning, bad } tone = Tone::good;
  std::string title, reason;
};
CalibrationVerdict verdict_of(const camera::Calibrated& calibrated);

void write_report(const camera::Calibrated& calibrated, const BoardSettings& told, const std::string& folder);
void write_figures(const camera::Calibrated& calibrated, const std::string& folder);  // figures.json

// How much of the residuals is not chance: root mean square of their means over cells of the picture, over what noise
// of the same size would leave. 1 if there is nothing but noise.
double systematic_ratio(const camera::Calibrated& calibrated, std::size_t camera);

}  // namespace bevel::analysis
