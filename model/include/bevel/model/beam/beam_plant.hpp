// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Mechanical model of a needle in tissue: a plant that differs from the kinematic model, for tests of steering.
///
/// Problem
///   The shaft is a straight elastic beam in a guide, clamped at z = -guide_gap_mm. The bevel force F pushes it
///   sideways at the tip. Distributed springs of modulus k hold the inserted part to the path that the tip has cut. The
///   shape is the equilibrium at each time (quasi-static, small slopes):
///
///       EI w'''' + k (w - cut) = 0,   w = w' = 0 at the guide,   w'' = 0 and EI w''' = -F at the tip
///
///   The tip cuts at its own position: cut(L) = w(L) at the time when the tip first reaches depth L.
///   Here z is the length along the shaft, and w' is the angle between its tangent and the axis of {A}. Tissue has no
///   preferred direction, so a path that is cut steadily is a circle. (With z as the depth and w' as a slope, the
///   curvature would fall with the cube of the heading's cosine.) The integral of the unit tangents is the shaft in
///   space. A turn of the heading out of its plane is assumed small.
///
/// Frames and signs
///   {A} has its origin at the entry point and z into the tissue; w = x + i y. {B} is at the tip: e3 is the tangent of
///   the shaft, and e1 and e2 are rotated by the roll phi of the tip. The bevel force F points to -e2:
///
///       F = -i |F| exp(i phi)
///
///   With phi = 0 the needle bends toward -y.
///
/// Consequences (lambda^4 = k / (4 EI); steady state, deep in uniform tissue)
///   The curvature of the path is F / (EI lambda). The tip moves at the slip angle F / (2 EI lambda^2) to its tangent,
///   on the side of the bevel. The kinematic models postulate these two results. Rotation of a stationary needle swings
///   the tip on a circle of radius up to 2 F lambda / k, because the springs at the tip carry the rotated force. Over
///   130 mm, 2-100 kPa and 0.2-1 N deflect the tip by 3.5-42 mm with the guide 15 mm from the tissue, and by 2.8-33 mm
///   with the guide on it. The best circle through the entry point has an error of 0.1-1.1 mm.
///
/// Source: Euler-Bernoulli beam on a Winkler foundation, Hetenyi, "Beams on Elastic Foundation", 1946.
///
/// Limits: the shaft lies near the path that it has cut, exerts no axial force on the tissue, and neighbouring springs
/// are not coupled.
#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <vector>

#include <bevel/model/beam/cut_path.hpp>
#include <bevel/model/beam/hermite_beam.hpp>
#include <bevel/model/beam/windup.hpp>

namespace bevel::model {

/// Parameters of the plant.
struct BeamPlantConfig {
  double bending_stiffness_N_mm2 = 1.6e4;  ///< EI, N mm^2, > 0; the default is 18 gauge steel
  /// Instantaneous modulus k, kPa, > 0: force per mm of shaft and mm of displacement; 1 kPa = 1e-3 N/mm^2.
  double foundation_modulus_kPa = 20.0;
  /// Depth at which a second layer of tissue begins, mm, >= 0; infinity: uniform tissue.
  double layer_from_mm = std::numeric_limits<double>::infinity();
  double layer_modulus_kPa = 20.0;   ///< modulus k of the second layer, kPa, > 0
  double layer_force_N = 0.5;        ///< bevel force in the second layer, N, >= 0
  double relaxing_fraction = 0.0;    ///< fraction of k that relaxes, in [0, 1)
  double relaxation_time_s = 1.0;    ///< time constant of that fraction at constant displacement, s, > 0
  double bevel_force_N = 0.5;        ///< lateral force toward the bevel side during cutting, N, >= 0
  double bevel_length_mm = 3.5;      ///< retraction from the uncut tissue over which the force falls to zero, mm, > 0
  double guide_gap_mm = 15.0;        ///< free length from the mouth of the guide to the tissue, mm, >= 0
  double windup_at_100mm_rad = 0.0;  ///< lag of the tip's roll at 100 mm inserted (windup.hpp), rad, >= 0; 0: rigid
  bool feed_is_arc_length = true;    ///< false: small slopes; z and the feed are the depth
  double max_depth_mm = 200.0;       ///< largest feed, mm, > 0; memory is allocated for it
  double element_length_mm = 2.0;    ///< length of the beam elements, mm, > 0
  double cell_length_mm = 0.5;       ///< length of the tissue cells, mm, > 0
  double max_step_mm = 0.5;          ///< largest step, mm, > 0; longer feeds are divided

  /// Checks all fields.
  /// @throws bevel::ArgumentError with the first field out of range, its value and the allowed range
  void validate() const;
};

/// Mechanical plant: beam, cut path and torsional wind-up.
class BeamPlant {
 public:
  /// Places the tip at the entry point, unrolled.
  /// @param config parameters
  /// @throws bevel::ArgumentError as BeamPlantConfig::validate()
  explicit BeamPlant(const BeamPlantConfig& config);

  /// Feeds and rotates the needle base at constant rates. The function does not allocate. If it throws, the plant is
  /// unchanged.
  /// @param insertion_increment_mm feed of the shaft, mm; negative retracts
  /// @param rotation_increment_rad rotation of the needle base, rad, right-handed about the heading
  /// @param dt_s duration, s, >= 0
  /// @throws bevel::ArgumentError if an argument is not finite, or \p dt_s is negative
  /// @throws bevel::DomainError if the feed exceeds max_depth_mm
  void advance(double insertion_increment_mm, double rotation_increment_rad, double dt_s);

  /// @return the position of the tip, mm in {A}
  [[nodiscard]] const Eigen::Vector3d& tip_position_mm() const { return tip_mm_; }
  /// @return the heading: unit tangent of the shaft at the tip, in {A}
  [[nodiscard]] Eigen::Vector3d tip_heading() const;
  /// @return the orientation of {B} in {A}, 3 x 3; its columns are e1, e2 and e3
  [[nodiscard]] Eigen::Matrix3d tip_rotation() const;
  /// @return the roll of the tip, rad
  [[nodiscard]] double tip_roll_rad() const { return windup_.tip_roll_rad(); }
  /// @return the roll of the needle base, rad
  [[nodiscard]] double base_roll_rad() const { return base_roll_rad_; }
  /// @return the sum of the feeds, which is the arc length of the inserted shaft, mm
  [[nodiscard]] double fed_mm() const { return fed_mm_; }
  /// @return the present magnitude of the bevel force, N
  [[nodiscard]] double bevel_force_N() const;
  /// @return the cut path
  [[nodiscard]] const CutPath& cut_path() const { return cut_; }

  /// Computes the shape of the shaft for drawing. The function allocates.
  /// @param points number of points, >= 2
  /// @return points at even spacing from the mouth of the guide to the tip, mm in {A}
  /// @throws bevel::ArgumentError if \p points is below 2
  [[nodiscard]] std::vector<Eigen::Vector3d> shaft_polyline_mm(std::size_t points) const;

 private:
  void step(double insertion_mm, double rotation_rad, double dt_s);

  BeamPlantConfig config_;
  HermiteBeam beam_;
  CutPath cut_;
  Windup windup_;
  bool bent_ = false;        // the beam has been solved for the present depth
  double settled_mm_ = 0.0;  // depth down to which the springs of the last solved problem were final
  double base_roll_rad_ = 0.0;
  double fed_mm_ = 0.0;
  Eigen::Vector3d tip_mm_ = Eigen::Vector3d::Zero();
  Lateral tip_aside_mm_, tip_angle_rad_;  // w and w' at the tip
};

}  // namespace bevel::model
