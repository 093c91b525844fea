// SPDX-License-Identifier: MIT
#pragma once
// The tissue's side of the plant: where the tip has cut, and the springs that hold the shaft to that cut.
//
// Depth is divided into equal cells that stay with the tissue. A cell remembers the mean lateral position of the tip as
// it passed (the spring's anchor: an uncut cell has none), for good: a second passage through an existing cut changes
// nothing. Per length of shaft the spring is a standard linear solid; a fraction r of k relaxes with time T:
//   force = -k (1 - r) e - k r (e - q),   dq/dt = (e - q) / T,   e = w - anchor.
// q is stepped exactly for an e that varies linearly over the step, so the step may be long beside T.
#include <complex>
#include <cstddef>
#include <limits>
#include <vector>

#include <bevel/model/beam/hermite_beam.hpp>

namespace bevel::model {

struct TissueSpring {
  double modulus_N_mm2;      // k, at once; force per mm of displacement and mm of shaft
  double relaxing_fraction;  // r, 0 (elastic) to below 1
  double relaxation_time_s;  // T > 0
  double layer_from_mm = std::numeric_limits<double>::infinity();  // below this depth k is this many times as large
  double layer_share = 1;
};

class CutPath {
 public:
  CutPath(TissueSpring spring, double cell_mm, double max_depth_mm);

  // The tip went straight from one point to the other; what of this lies deeper than front_mm() is cut.
  // Allowed: to_z_mm <= max_depth_mm of the constructor.
  void cut(double from_z_mm, Lateral from_mm, double to_z_mm, Lateral to_mm);

  // The deepest point the tip has reached, mm; 0 for whole tissue.
  [[nodiscard]] double front_mm() const { return front_mm_; }

  // Adds the springs along the beam, as they act at the end of a step of dt_s >= 0, to a beam not yet solved.
  void add_springs(HermiteBeam& beam, double dt_s) const;

  // Down to here the springs on a shaft with its tip at this depth are what they will be, however the tip moves beyond.
  [[nodiscard]] double settled_mm(double tip_mm) const;

  // Ends that step: takes the relaxation up to the solved beam. Springs beyond the tip are free.
  void relax(const HermiteBeam& beam, double dt_s);

  // For drawing and tests: the cells with a cut, their centres and anchors.
  [[nodiscard]] std::size_t size() const { return cut_cells_; }
  [[nodiscard]] double cell_centre_mm(std::size_t cell) const;
  [[nodiscard]] Lateral anchor_mm(std::size_t cell) const { return cells_[cell].anchor_mm; }

 private:
  struct Cell {
    Lateral anchor_mm;
    double cut_mm = 0.0;  // how much of the cell's depth has been cut
    Lateral dashpot_mm;   // q
    Lateral stretch_mm;   // e at the end of the last step
  };
  struct Step {  // q_new = keep q + before e_old + after e_new
    double keep;
    double before;
    double after;
  };
  [[nodiscard]] Step step(double dt_s) const;
  [[nodiscard]] double length_on_shaft_mm(std::size_t cell, double tip_mm) const;

  TissueSpring spring_;
  double cell_mm_;
  std::vector<Cell> cells_;
  std::size_t cut_cells_ = 0;
  double front_mm_ = 0.0;
};

}  // namespace bevel::model
