// SPDX-License-Identifier: MIT
#pragma once
// The channel that the tip has cut, as far as the model does not know it from where the tip is: how the bevel stood at
// each depth. A needle that is drawn back goes through it again, whichever way the bevel points by then.
//
// Inserted length is divided into cells of half a millimetre. A cell keeps the mean direction of the bevel while it was
// cut, a vector of length one and less: the length is the share of the needle's curvature that is left of a cell in
// which the bevel turned, so that the heading behind a cell comes out right whatever happened in it; within it the path
// is off by k h^2 / 4, 3e-4 mm. Values only, of fixed size: copied with the state that it belongs to, it makes a
// history that is rolled back right by itself. mm and rad, counted from where the estimate began.
#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace bevel::estimator {

class Channel {
 public:
  static constexpr double kCell_mm = 0.5;
  static constexpr std::size_t kCells = 400;  // what is deeper than 200 mm is not kept

  struct Bend {
    double share = 0;       // of the needle's curvature, in [0, 1]
    double toward_rad = 0;  // roll at which it was cut
  };
  // The first part of a motion: up to an edge of a cell, the front or the end.
  struct Part {
    double insertion_mm = 0;
    double to_mm = 0;
    bool cut_before = false;  // in a cell that is kept
    Bend bend;                // of it
  };

  double inserted_mm() const { return inserted_mm_; }
  double rolled_rad() const { return rolled_rad_; }
  // From the deepest point that was reached; 0 where the tip cuts.
  double drawn_back_mm() const { return front_mm_ - inserted_mm_; }

  Part next(double target_mm) const;
  /// Takes in that part, made while the shaft turned by so much at a constant rate.
  /// @param bend_known false: nothing is known of how the bevel stood while it was cut; the channel is kept straight.
  void pass(const Part& part, double rotation_rad, bool bend_known = true);

 private:
  void cut(double to_mm, double rotation_rad, bool bend_known);

  double inserted_mm_ = 0, rolled_rad_ = 0, front_mm_ = 0;
  std::array<Eigen::Vector2f, kCells> cells_{};  // direction of the bevel times length, mm
};

}  // namespace bevel::estimator
