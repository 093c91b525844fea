// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Check whether the needle was observed since it entered the tissue.
namespace bevel::nodes {

/// Decides whether the estimate has observed the whole insertion. An estimator that starts with the needle inside knows
/// the positions of the axes, but not the path: its orientation is a guess that position measurements correct slowly.
/// Uses no clock. Lengths in mm, depths along z of {A}.
class EntryWatch {
 public:
  /// Records the position of the insertion axis.
  /// @param insertion_mm position, mm
  /// @return true if the estimate is to start again at the entry point
  bool see_axes(double insertion_mm);
  /// Records a tip measurement of a camera that measures the depth.
  /// @param depth_mm measured z of the tip in {A}, mm
  void see_tip(double depth_mm);
  /// Restarts the watch with the next position of the axes.
  void restart() { *this = EntryWatch{}; }
  /// Records the operator's confirmation: the needle counts as observed since the entry.
  void confirm() { from_entry_ = true; }

  /// @return true if the needle was observed since the entry
  bool from_entry() const { return from_entry_; }

 private:
  bool begun_ = false;
  bool from_entry_ = false;
  bool at_entry_ = false;  // by the axes
  int deep_in_row_ = 0;
};

}  // namespace bevel::nodes
