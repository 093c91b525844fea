// SPDX-License-Identifier: MIT
#pragma once
// Whether the estimate has been there since the needle entered the tissue. An estimator that begins with the needle
// inside knows where the axes stand, but not the way: its attitude is a guess that measurements of position mend
// slowly. Pure; lengths in mm, depths along z of {A}.
namespace bevel::nodes {

class EntryWatch {
 public:
  // The axes; true where the estimate is to begin anew, at the entry point.
  bool see_axes(double insertion_mm);
  // Where a camera sees the tip; of cameras that see the depth.
  void see_tip(double depth_mm);
  // The estimate begins with the next axes.
  void restart() { *this = EntryWatch{}; }
  // The operator says that all is as if it had been watched.
  void confirm() { from_entry_ = true; }

  bool from_entry() const { return from_entry_; }

 private:
  bool begun_ = false;
  bool from_entry_ = false;
  bool at_entry_ = false;  // by the axes
  int deep_in_row_ = 0;
};

}  // namespace bevel::nodes
