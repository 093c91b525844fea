// SPDX-License-Identifier: MIT
#include <bevel/model/beam/cut_path.hpp>

#include <algorithm>
#include <cmath>

namespace bevel::model {

CutPath::CutPath(TissueSpring spring, double cell_mm, double max_depth_mm)
    : spring_(spring), cell_mm_(cell_mm), cells_(static_cast<std::size_t>(std::ceil(max_depth_mm / cell_mm)) + 1) {}

void CutPath::cut(double from_z_mm, Lateral from_mm, double to_z_mm, Lateral to_mm) {
  if (to_z_mm <= front_mm_) return;
  const Lateral slope = (to_mm - from_mm) / (to_z_mm - from_z_mm);
  for (auto c = static_cast<std::size_t>(front_mm_ / cell_mm_); front_mm_ < to_z_mm; ++c) {
    Cell& cell = cells_[c];
    const double end_mm = std::min(to_z_mm, cell_mm_ * static_cast<double>(c + 1));
    const double length_mm = end_mm - front_mm_;
    if (!(length_mm > 0.0)) continue;  // the front lies on the cell's far edge, to rounding
    const Lateral mean_mm = from_mm + slope * (0.5 * (front_mm_ + end_mm) - from_z_mm);
    cell.anchor_mm += (mean_mm - cell.anchor_mm) * (length_mm / (cell.cut_mm + length_mm));
    cell.cut_mm += length_mm;
    front_mm_ = end_mm;
    cut_cells_ = c + 1;
  }
}

void CutPath::add_springs(HermiteBeam& beam, double dt_s) const {
  const Step s = step(dt_s);
  const double relaxing = spring_.modulus_N_mm2 * spring_.relaxing_fraction;
  const double stiffness = spring_.modulus_N_mm2 - relaxing * s.after;
  const double tip_mm = beam.tip_mm();
  // Those before the beam has; one cell more, for rounding.
  const double known = std::max(0.0, beam.kept_mm() / cell_mm_ - 1.0);
  for (auto c = static_cast<std::size_t>(known); c < cut_cells_; ++c) {
    const double length_mm = length_on_shaft_mm(c, tip_mm);
    if (!(length_mm > 0.0)) break;
    const Cell& cell = cells_[c];
    const Lateral load =
        stiffness * cell.anchor_mm + relaxing * (s.keep * cell.dashpot_mm + s.before * cell.stretch_mm);
    const double depth_mm = cell_mm_ * static_cast<double>(c);
    const double share = (depth_mm < spring_.layer_from_mm ? 1 : spring_.layer_share) * length_mm;
    beam.add_spring(depth_mm + 0.5 * length_mm, share * stiffness, share * load);
  }
}

// Of the last whole cell a rest may still be cut, to rounding. A spring that relaxes is another in each step.
double CutPath::settled_mm(double tip_mm) const {
  if (spring_.relaxing_fraction > 0.0) return 0.0;
  return cell_mm_ * std::max(0.0, std::floor(std::min(front_mm_, tip_mm) / cell_mm_) - 1.0);
}

void CutPath::relax(const HermiteBeam& beam, double dt_s) {
  if (spring_.relaxing_fraction == 0.0) return;
  const Step s = step(dt_s);
  const double tip_mm = beam.tip_mm();
  for (std::size_t c = 0; c < cut_cells_; ++c) {
    Cell& cell = cells_[c];
    const double length_mm = length_on_shaft_mm(c, tip_mm);
    Lateral stretch_mm;
    if (length_mm > 0.0) {
      stretch_mm = beam.displacement_mm(cell_mm_ * static_cast<double>(c) + 0.5 * length_mm) - cell.anchor_mm;
    }
    cell.dashpot_mm = s.keep * cell.dashpot_mm + s.before * cell.stretch_mm + s.after * stretch_mm;
    cell.stretch_mm = stretch_mm;
  }
}

double CutPath::cell_centre_mm(std::size_t cell) const {
  return cell_mm_ * static_cast<double>(cell) + 0.5 * cells_[cell].cut_mm;
}

CutPath::Step CutPath::step(double dt_s) const {
  const double x = dt_s / spring_.relaxation_time_s;
  if (!(x > 0.0)) return {1.0, 0.0, 0.0};
  const double keep = std::exp(-x);
  const double mean_keep = -std::expm1(-x) / x;
  return {keep, mean_keep - keep, 1.0 - mean_keep};
}

double CutPath::length_on_shaft_mm(std::size_t cell, double tip_mm) const {
  return std::min(cells_[cell].cut_mm, tip_mm - cell_mm_ * static_cast<double>(cell));
}

}  // namespace bevel::model
