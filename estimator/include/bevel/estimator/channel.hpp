// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Channel that the tip has cut.
#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace bevel::estimator {

/// Records the bevel angle at each depth of the channel that the tip has cut. A retracted needle follows this channel,
/// whatever its present bevel angle is.
///
/// The inserted length is divided into cells of 0.5 mm. A cell holds the mean direction of the bevel while the cell was
/// cut, a vector of length up to 1. The length is the share of the curvature that remains of a cell in which the bevel
/// rotated, so that the heading after a cell is exact. The position within it is off by k h^2 / 4, 3e-4 mm. The class
/// is a plain value of fixed size: it is copied with the filter state, so a history of states can be rolled back.
/// Insertion (mm) and roll (rad) count from the start of the estimate.
class Channel {
 public:
  static constexpr double kCell_mm = 0.5;     ///< length of a cell, mm
  static constexpr std::size_t kCells = 400;  ///< number of cells; parts deeper than 200 mm are not recorded

  /// Bend of one cell.
  struct Bend {
    double share = 0;       ///< share of the needle's curvature, in [0, 1]
    double toward_rad = 0;  ///< roll of the bevel when the cell was cut, rad
  };
  /// First part of a motion: up to the edge of a cell, the end of the channel or the end of the motion.
  struct Part {
    double insertion_mm = 0;  ///< increment of the insertion, mm; negative for a retraction
    double to_mm = 0;         ///< insertion at the end of the part, mm
    bool cut_before = false;  ///< the part lies in a recorded cell
    Bend bend;                ///< bend of that cell
  };

  /// Returns the insertion.
  /// @return insertion of the tip, mm
  double inserted_mm() const { return inserted_mm_; }
  /// Returns the roll.
  /// @return roll of the bevel, rad
  double rolled_rad() const { return rolled_rad_; }
  /// Computes the retraction from the deepest insertion.
  /// @return distance, mm; 0 if the tip cuts
  double drawn_back_mm() const { return front_mm_ - inserted_mm_; }

  /// Computes the first part of a motion.
  /// @param target_mm insertion at the end of the motion, mm
  /// @return part toward \p target_mm, with the cell that it lies in
  Part next(double target_mm) const;
  /// Moves the tip by one part, and records the channel where the part cuts new tissue.
  /// @param part part of the motion, from next()
  /// @param rotation_rad rotation of the shaft during the part, at a constant rate, rad
  /// @param bend_known false: the bevel angle was not observed, and the new channel is recorded as straight
  void pass(const Part& part, double rotation_rad, bool bend_known = true);

 private:
  void cut(double to_mm, double rotation_rad, bool bend_known);

  double inserted_mm_ = 0, rolled_rad_ = 0, front_mm_ = 0;
  std::array<Eigen::Vector2f, kCells> cells_{};  // direction of the bevel times cut length, mm
};

}  // namespace bevel::estimator
