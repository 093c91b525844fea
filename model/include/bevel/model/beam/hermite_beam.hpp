// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Statics of a slender beam of variable length: Euler-Bernoulli theory, small slopes, cubic Hermite elements. The
/// solution minimises
///
///     1/2 int EI |w''|^2 dz + sum_j 1/2 c_j |w(z_j)|^2 - Re sum_j conj(p_j) w(z_j)
///
/// over lateral displacements w(z) = x + i y (mm) on [clamp, tip], with w = w' = 0 at the clamp. z (mm) runs along the
/// insertion axis of {A} and is 0 at the tissue surface.
///
/// The mesh is fixed in space. A shaft that is straight without load has identical sections, so feeding it only moves
/// its end. Elements with z < 0 divide the free span evenly; those with z > 0 have the nominal length. The last element
/// ends at the tip and has 0.5 to 1.5 times the nominal length.
///
/// Sequence of calls: set_tip, any number of add_spring and add_force, solve, then displacement_mm and slope. No call
/// allocates after construction.
#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstddef>
#include <limits>
#include <vector>

#include <bevel/model/beam/band_ldlt.hpp>

namespace bevel::model {

/// Lateral vector x + i y in {A}; the unit depends on the quantity.
using Lateral = std::complex<double>;

/// Computes the unit vector that results from rotating z of {A} toward a lateral direction.
/// @param angle_rad direction, with the angle as its magnitude, rad
/// @return unit vector in {A}
Eigen::Vector3d turned_from_axis(Lateral angle_rad);

/// Beam problem on a mesh that is fixed in space.
class HermiteBeam {
 public:
  /// Creates the mesh and allocates all memory.
  /// @param bending_stiffness_N_mm2 bending stiffness EI, N mm^2, > 0
  /// @param element_length_mm nominal length of an element, mm, > 0
  /// @param free_span_mm distance from the clamp to the tissue surface, mm, >= 0; the clamp is at z = -free_span_mm
  /// @param max_tip_mm largest depth of the tip, mm, > 0
  /// @throws bevel::ArgumentError if \p element_length_mm is not above 0
  HermiteBeam(double bending_stiffness_N_mm2, double element_length_mm, double free_span_mm, double max_tip_mm);

  /// Starts a new problem: mesh and bending stiffness, without loads. Down to \p settled_mm the equations and factors
  /// of the previous problem are kept, and add_spring() has no effect there. The solution is the same to the last
  /// digit.
  /// @param tip_mm depth of the tip, mm; required: clamp < tip_mm <= max_tip_mm
  /// @param settled_mm depth down to which the springs are those of the previous, solved problem, mm
  /// @throws bevel::DomainError if \p tip_mm is outside its range
  void set_tip(double tip_mm, double settled_mm = -std::numeric_limits<double>::infinity());
  /// Returns the depth above which springs are kept from the previous problem. Loads at smaller depths have no effect.
  /// @return the depth, mm
  [[nodiscard]] double kept_mm() const { return nodes_mm_[settled_ > 0 ? settled_ - 1 : 0]; }

  /// Adds a point spring, which exerts the force load_N - stiffness_N_mm w on the beam. A spring with rest position w0
  /// has load_N = stiffness_N_mm w0.
  /// @param z_mm depth, mm, in [clamp, tip]
  /// @param stiffness_N_mm stiffness, N/mm
  /// @param load_N force at w = 0, N in {A}
  void add_spring(double z_mm, double stiffness_N_mm, Lateral load_N);
  /// Adds a point force.
  /// @param z_mm depth, mm, in [clamp, tip]
  /// @param force_N force on the beam, N in {A}
  void add_force(double z_mm, Lateral force_N) { add_spring(z_mm, 0.0, force_N); }

  /// Solves the problem.
  /// @throws bevel::DomainError if the stiffness matrix is not positive definite
  void solve();

  /// @return the z coordinate of the clamp, mm
  [[nodiscard]] double clamp_mm() const { return nodes_mm_.front(); }
  /// @return the depth of the tip, mm
  [[nodiscard]] double tip_mm() const { return tip_mm_; }

  /// Evaluates the displacement w, after solve().
  /// @param z_mm depth, mm, in [clamp, tip]
  /// @return w, mm in {A}
  [[nodiscard]] Lateral displacement_mm(double z_mm) const;
  /// Evaluates the slope w', after solve().
  /// @param z_mm depth, mm, in [clamp, tip]
  /// @return w', dimensionless
  [[nodiscard]] Lateral slope(double z_mm) const;

  /// Computes the position of the tip with z as the length along the shaft. w' is then the angle between the tangent
  /// and the axis of {A}. The unit tangents are integrated from the clamp, by Simpson's rule per element.
  /// @return position, mm in {A}
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
  std::vector<double> nodes_mm_;  // mesh, fixed in space; the tip replaces the node nearest to it
  std::size_t elements_ = 0;      // in the present problem
  std::size_t settled_ = 0;       // leading elements that equal those of the previous problem
  std::size_t first_row_ = 0;     // first equation that differs
  double tip_mm_ = 0.0;
  BandLdlt matrix_;
  std::vector<Lateral> loads_;     // half eliminated by solve()
  std::vector<Lateral> solution_;  // displacement (mm) and slope of nodes 1, 2, ...; node 0 is the clamp
};

}  // namespace bevel::model
