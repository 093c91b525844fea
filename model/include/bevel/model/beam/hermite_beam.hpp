// SPDX-License-Identifier: MIT
#pragma once
// Statics of a slender beam of growing length: Euler-Bernoulli, small slopes, cubic Hermite elements.
//
//   minimise  1/2 int EI |w''|^2 dz + sum_j 1/2 c_j |w(z_j)|^2 - Re sum_j conj(p_j) w(z_j)
//
// over lateral displacements w(z) = x + i y (mm) on [clamp, tip], with w = w' = 0 at the clamp. z (mm) runs along {A}'s
// insertion axis and is 0 at the tissue's surface. The mesh stands still in space: a shaft that is straight when free
// has no memory of which of its sections is where, so feeding it only moves the end. Elements left of z = 0 divide the
// free span evenly; right of it they have the nominal length; the last one ends at the tip and is 0.5 to 1.5 long.
//
// One use: set_tip, any add_spring / add_force, solve, then displacement / slope. Nothing allocates after construction.
#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstddef>
#include <limits>
#include <vector>

#include <bevel/model/beam/band_ldlt.hpp>

namespace bevel::model {

using Lateral = std::complex<double>;  // x + i y in {A}

// The unit vector that is turned from {A}'s axis toward this direction, by its length (rad).
Eigen::Vector3d turned_from_axis(Lateral angle_rad);

class HermiteBeam {
 public:
  // bending_stiffness_N_mm2 = EI > 0; element_length_mm > 0; free_span_mm = -clamp >= 0; max_tip_mm > 0: the largest
  // tip.
  HermiteBeam(double bending_stiffness_N_mm2, double element_length_mm, double free_span_mm, double max_tip_mm);

  // Starts a new problem with the tip at this depth: mesh, bending stiffness, no loads. Down to settled_mm the springs
  // are those of the problem before, solved: there its equations and their factors stay, and what is added is left out
  // (add_spring); the solution is the same to the last digit. Throws DomainError unless clamp < tip_mm <=
  // max_tip_mm.
  void set_tip(double tip_mm, double settled_mm = -std::numeric_limits<double>::infinity());
  // What is added at less depth than this changes nothing: it is in there.
  [[nodiscard]] double kept_mm() const { return nodes_mm_[settled_ > 0 ? settled_ - 1 : 0]; }

  // A point spring at depth z_mm in [clamp, tip], with force load_N - stiffness_N_mm w on the beam: a spring with its
  // rest position at w0 has load_N = stiffness_N_mm w0.
  void add_spring(double z_mm, double stiffness_N_mm, Lateral load_N);
  void add_force(double z_mm, Lateral force_N) { add_spring(z_mm, 0.0, force_N); }

  void solve();

  [[nodiscard]] double clamp_mm() const { return nodes_mm_.front(); }
  [[nodiscard]] double tip_mm() const { return tip_mm_; }

  // After solve(), for z_mm in [clamp, tip].
  [[nodiscard]] Lateral displacement_mm(double z_mm) const;
  [[nodiscard]] Lateral slope(double z_mm) const;

  // Where the tip is if z is taken as the length along the shaft and w' as the angle by which it is turned from {A}'s
  // axis, about the axis across both: the shaft's unit tangents summed from the clamp on. mm, {A}.
  [[nodiscard]] Eigen::Vector3d tip_along_shaft_mm() const;

 private:
  struct Place {
    std::size_t element;
    double length_mm;
    double xi;  // 0 at the element's left node, 1 at its right one
  };
  [[nodiscard]] Place locate(double z_mm) const;
  [[nodiscard]] double right_mm(std::size_t element) const;
  [[nodiscard]] std::array<Lateral, 4> unknowns(std::size_t element) const;
  void add_bending(std::size_t element);

  double bending_stiffness_N_mm2_;
  double element_length_mm_;
  double free_element_mm_;
  std::size_t free_elements_;
  std::vector<double> nodes_mm_;  // the mesh at rest in space; the node nearest the tip gives way to the tip itself
  std::size_t elements_ = 0;      // in the present problem
  std::size_t settled_ = 0;       // the first of them, as in the problem before
  std::size_t first_row_ = 0;     // of the equations that are not
  double tip_mm_ = 0.0;
  BandLdlt matrix_;
  std::vector<Lateral> loads_;     // half eliminated by solve()
  std::vector<Lateral> solution_;  // displacement (mm) and slope of nodes 1, 2, ...; node 0 is the clamp
};

}  // namespace bevel::model
