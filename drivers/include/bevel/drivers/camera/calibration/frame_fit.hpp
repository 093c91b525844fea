// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Determination of {A}: origin at the entry point, z into the tissue along the needle's guide. A calibration contains
/// only the relative poses of its cameras; a board at a known place (a fiducial) or a straight first insertion
/// determines {A}.
#include <bevel/drivers/camera/calibration/calibrate.hpp>

namespace bevel::camera {

/// Pose of the fiducial in {A}: p_A = R p_B + origin, with {B} as in board.hpp.
struct FiducialPlace {
  cv::Matx33d R_AB = cv::Matx33d::eye();  ///< rotation matrix
  /// Origin of {B}, the outer corner of the first square, in {A}, mm.
  cv::Vec3d origin_A_mm;
};

/// Computes R_AB from the axes of {A} along which the board's x and y point.
/// @param board_x_along "+x", "-x", "+y", "-y", "+z" or "-z"
/// @param board_y_along the same, for another axis
/// @return rotation matrix
/// @throws ArgumentError naming the text and what is allowed
cv::Matx33d rotation_of_axes(const std::string& board_x_along, const std::string& board_y_along);

/// Quality of the determination.
struct FrameFigures {
  /// Fiducial: root mean square of the residuals of its corners, px.
  double rms_px = 0.0;
  /// Insertion: root mean square distance of the measurements from the straight line along the measured axes, mm.
  double rms_mm = 0.0;
  /// Insertion: measured length per inserted length.
  double scale = 1.0;
  double scale_sd = 0.0;  ///< standard deviation of the scale
  /// Insertion: standard deviation of the z axis, the larger of two directions, rad.
  double tilt_sd_rad = 0.0;
  int readings = 0;  ///< number of corners or measurements
};

/// Determines {A} from a fiducial.
/// @param board       board of the fiducial
/// @param fiducial    shot of the fiducial
/// @param place       pose of the fiducial in {A}
/// @param rig         cameras of the calibration
/// @param calibration calibration of `rig` in any frame; receives the new frame
/// @return quality
/// @throws ArgumentError if no camera detected the fiducial, its orientation is ambiguous (Board::oriented()), or an
///   immersed fiducial is seen by a camera without a wall
FrameFigures set_frame_by_fiducial(const Board& board, const Shot& fiducial, const FiducialPlace& place, const Rig& rig,
                                   Calibration& calibration);

/// A tip as in TIP_MEASUREMENT, in the present frame of the calibration, with the inserted length.
struct InsertedTip {
  cv::Vec3d position_mm;            ///< position, mm
  cv::Matx33d information_per_mm2;  ///< information, 1/mm^2
  double insertion_mm = 0.0;        ///< inserted length, mm
};

/// Determines {A} from a straight insertion by fitting p(s) = o + s d to the measurements. Rotate the needle steadily,
/// or use one without a bevel. The new z axis is along d, the new origin is o, where the insertion is 0. The rotation
/// about the line is not determined: -x points as closely as possible in the viewing direction of the first camera,
/// rotated by `roll_rad` about z.
/// @param tips        measurements of the insertion
/// @param roll_rad    rotation about z, rad
/// @param calibration calibration; receives the new frame
/// @return quality
/// @throws ArgumentError naming what is wrong: fewer than 20 measurements or 20 mm, one camera only (a line through the
/// rays
///   of one camera has no depth), a measured length that differs from the inserted length by more than 5 %
FrameFigures set_frame_by_insertion(const std::vector<InsertedTip>& tips, double roll_rad, Calibration& calibration);

}  // namespace bevel::camera
