// SPDX-License-Identifier: MIT
#pragma once
// Where {A} is: origin at the entry point, z into the tissue along the needle's guide. A calibration knows its cameras
// among each other only; a board at a known place (a fiducial) or a straight first insertion gives the rest.
#include <bevel/drivers/camera/calibration/calibrate.hpp>

namespace bevel::camera {

/// How the fiducial lies in {A}: p_A = R p_B + origin, {B} as in board.hpp.
struct FiducialPlace {
  cv::Matx33d R_AB = cv::Matx33d::eye();
  cv::Vec3d origin_A_mm;  ///< of {B}, the outer corner of the first square
};

/// R_AB of axes "+z", "-x" and so on of {A} along which the board's x and y run. Throws ArgumentError naming
/// the text and what is allowed.
cv::Matx33d rotation_of_axes(const std::string& board_x_along, const std::string& board_y_along);

struct FrameFigures {
  double rms_px = 0.0;  ///< fiducial: of its corners
  double rms_mm = 0.0;  ///< insertion: of the readings beside the straight line, along the axes they see
  double scale = 1.0;   ///< insertion: millimetres seen per millimetre inserted
  double scale_sd = 0.0;
  double tilt_sd_rad = 0.0;  ///< insertion: of the z axis, the worse of its two directions
  int readings = 0;
};

/// `calibration` is that of `rig`, whatever frame it has. Throws ArgumentError if no
/// camera found the fiducial.
FrameFigures set_frame_by_fiducial(const Board& board, const Shot& fiducial, const FiducialPlace& place, const Rig& rig,
                                   Calibration& calibration);

/// A tip as TIP_MEASUREMENT has it, in the frame the calibration has so far, and how far the needle was in.
struct InsertedTip {
  cv::Vec3d position_mm;
  cv::Matx33d information_per_mm2;
  double insertion_mm = 0.0;
};

/// Fits p(s) = o + s d to the readings of a needle that goes in straight (rotate it steadily, or use one without a
/// bevel). The new z runs along d, the new origin is o, where the insertion is 0; the line knows nothing of the angle
/// about it, so -x points, as near as may be, the way the first camera looks, turned by `roll_rad` about z. Throws
/// ArgumentError naming what is wrong: fewer than 20 readings or 20 mm, one camera only (a line through rays of
/// one eye has no depth), a length seen that is not the length inserted within 5 %.
FrameFigures set_frame_by_insertion(const std::vector<InsertedTip>& tips, double roll_rad, Calibration& calibration);

}  // namespace bevel::camera
