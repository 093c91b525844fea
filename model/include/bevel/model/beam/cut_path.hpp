// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Tissue of the mechanical plant: the path that the tip has cut, and the springs between the shaft and that path.
///
/// The depth is divided into equal cells fixed in the tissue. A cell stores the mean lateral position of the tip during
/// its first passage, the anchor of the spring. An uncut cell has no anchor, and a second passage changes nothing. Per
/// length of shaft the spring is a standard linear solid, in which a fraction r of k relaxes with time constant T:
///
///     force = -k (1 - r) e - k r (e - q),   dq/dt = (e - q) / T,   e = w - anchor
///
/// q is integrated exactly for e linear in time within the step, so the step may be long compared with T.
#include <complex>
#include <cstddef>
#include <limits>
#include <vector>

#include <bevel/model/beam/hermite_beam.hpp>

namespace bevel::model {

/// Parameters of the tissue springs.
struct TissueSpring {
  double modulus_N_mm2;      ///< instantaneous modulus k: force per mm of displacement and mm of shaft, N/mm^2
  double relaxing_fraction;  ///< fraction r of k that relaxes, 0 (elastic) to below 1
  double relaxation_time_s;  ///< time constant T, s, > 0
  double layer_from_mm = std::numeric_limits<double>::infinity();  ///< depth at which a second layer begins, mm
  double layer_share = 1;                                          ///< modulus of the second layer, as a multiple of k
};

/// Cut path with its springs.
class CutPath {
 public:
  /// Creates uncut tissue.
  /// @param spring parameters of the springs
  /// @param cell_mm length of a cell, mm, > 0
  /// @param max_depth_mm largest depth of the tip, mm
  CutPath(TissueSpring spring, double cell_mm, double max_depth_mm);

  /// Cuts along a straight motion of the tip. Only the part deeper than front_mm() is cut.
  /// @param from_z_mm depth at the start, mm
  /// @param from_mm lateral position at the start, mm in {A}
  /// @param to_z_mm depth at the end, mm, at most max_depth_mm of the constructor
  /// @param to_mm lateral position at the end, mm in {A}
  void cut(double from_z_mm, Lateral from_mm, double to_z_mm, Lateral to_mm);

  /// @return the largest depth that the tip has reached, mm; 0 for uncut tissue
  [[nodiscard]] double front_mm() const { return front_mm_; }

  /// Adds the springs along the shaft to a beam, as they act at the end of a time step.
  /// @param[in,out] beam beam whose tip is set and which is not solved yet
  /// @param dt_s length of the time step, s, >= 0
  void add_springs(HermiteBeam& beam, double dt_s) const;

  /// Computes the depth down to which the springs are final: they stay the same however the tip moves beyond.
  /// @param tip_mm depth of the tip, mm
  /// @return the depth, mm; 0 if the tissue relaxes
  [[nodiscard]] double settled_mm(double tip_mm) const;

  /// Completes the time step: updates the relaxation from the solved beam. Springs beyond the tip are unloaded.
  /// @param beam solved beam
  /// @param dt_s length of the time step, s, the same as in add_springs()
  void relax(const HermiteBeam& beam, double dt_s);

  /// Returns the number of cut cells, for drawing and tests.
  /// @return the number of cells from depth 0 on
  [[nodiscard]] std::size_t size() const { return cut_cells_; }
  /// Computes the centre of the cut part of a cell.
  /// @param cell index, below size()
  /// @return its depth, mm
  [[nodiscard]] double cell_centre_mm(std::size_t cell) const;
  /// Returns the anchor of a cell.
  /// @param cell index, below size()
  /// @return lateral position, mm in {A}
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
