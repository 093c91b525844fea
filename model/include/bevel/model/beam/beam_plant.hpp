// SPDX-License-Identifier: MIT
#pragma once
// A needle in tissue, from mechanics: the plant on which steering is tried when the plant must not be the model.
//
// Problem
//   The shaft is a straight elastic beam held by a guide (clamped at z = -guide_gap_mm). Inserted, it is pushed
//   sideways at the tip by the force F on the bevel, and held by springs of modulus k, spread along it, to the path the
//   tip has cut. At each moment the shape is the equilibrium (quasi-static, small slopes)
//       EI w'''' + k (w - cut) = 0,   w = w' = 0 at the guide,   w'' = 0 and EI w''' = -F at the tip.
//   The tip cuts where it is: cut(L) = w(L) at the moment when the tip first reaches depth L.
//   Here z is the length along the shaft and w' the angle by which its tangent is turned from {A}'s axis, so that a
//   bent needle bends on as it began: tissue has no direction of its own, and a path that is cut steadily is a circle.
//   (With z as the depth and w' as a slope its curvature would fall with the cube of the heading's cosine.) The sum of
//   the unit tangents is the shaft in space. A turn of the heading out of the plane in which it lies is taken as small.
// Frames and signs
//   {A}: origin at the entry point, z into the tissue; w = x + i y. {B} on the tip: e3 the shaft's tangent, e1 and e2
//   turned by the tip's roll phi. The bevel force points to -e2: F = -i |F| exp(i phi), so phi = 0 bends toward -y.
// What follows (lambda^4 = k / (4 EI); steady state, deep in uniform tissue)
//   Curvature of the path F / (EI lambda), and the tip moves at the slip angle F / (2 EI lambda^2) from its own
//   tangent, on the bevel's side: the two things that the kinematic models postulate. Turning the base at rest swings
//   the tip on a circle of radius up to 2 F lambda / k, since the springs at the tip have to carry the turned force.
//   Over 130 mm, 2-100 kPa and 0.2-1 N deflect the tip by 3.5-42 mm with the guide 15 mm off the tissue, and by 2.8-33
//   mm with the guide on it; the best circle through the entry point errs by 0.1-1.1 mm.
// Source: Euler-Bernoulli beam on a Winkler foundation, Hetenyi, "Beams on Elastic Foundation", 1946.
// Limits: the shaft lies near the path it has cut, the shaft does not pull along its axis on the tissue, tissue does
// not couple neighbouring springs.
#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <vector>

#include <bevel/model/beam/cut_path.hpp>
#include <bevel/model/beam/hermite_beam.hpp>
#include <bevel/model/beam/windup.hpp>

namespace bevel::model {

struct BeamPlantConfig {
  double bending_stiffness_N_mm2 = 1.6e4;  // EI; 18 gauge steel
  double foundation_modulus_kPa = 20.0;  // k at once, force per mm of shaft and mm of displacement; 1 kPa = 1e-3 N/mm^2
  /// A second layer of tissue below this depth, mm; infinity: uniform tissue. There the modulus and the bevel's force
  /// are these.
  double layer_from_mm = std::numeric_limits<double>::infinity();
  double layer_modulus_kPa = 20.0;
  double layer_force_N = 0.5;
  double relaxing_fraction = 0.0;    // part of k that relaxes, in [0, 1)
  double relaxation_time_s = 1.0;    // of that part, at constant displacement; > 0
  double bevel_force_N = 0.5;        // lateral, toward the bevel's side, while the bevel cuts; >= 0
  double bevel_length_mm = 3.5;      // the force falls to none as the tip backs off the uncut tissue by this
  double guide_gap_mm = 15.0;        // from the guide's mouth to the tissue; the shaft is free in between
  double windup_at_100mm_rad = 0.0;  // lag of the tip's roll at 100 mm inserted, see windup.hpp; 0 = stiff shaft
  bool feed_is_arc_length = true;    // false: small slopes, z is the depth, which is what is fed
  double max_depth_mm = 200.0;       // room is kept for this depth
  double element_length_mm = 2.0;    // of the beam's elements
  double cell_length_mm = 0.5;       // of the tissue's memory
  double max_step_mm = 0.5;          // longer feeds are cut into steps of at most this

  // Throws ArgumentError naming the field, its value and what is allowed.
  void validate() const;
};

class BeamPlant {
 public:
  // The tip starts at the entry point, unrolled. Throws as validate().
  explicit BeamPlant(const BeamPlantConfig& config);

  // Feeds the shaft by insertion_increment_mm (< 0 retracts) while its base turns by rotation_increment_rad
  // (right-handed about the heading) and dt_s >= 0 passes, all at constant rates. Allocates nothing. Throws
  // ArgumentError for input that is not finite or dt_s < 0, DomainError for a feed beyond max_depth_mm;
  // the plant is then unchanged.
  void advance(double insertion_increment_mm, double rotation_increment_rad, double dt_s);

  [[nodiscard]] const Eigen::Vector3d& tip_position_mm() const { return tip_mm_; }  // {A}
  [[nodiscard]] Eigen::Vector3d tip_heading() const;   // unit tangent of the shaft at the tip, {A}
  [[nodiscard]] Eigen::Matrix3d tip_rotation() const;  // R_AB: columns e1, e2, e3 of {B} in {A}
  [[nodiscard]] double tip_roll_rad() const { return windup_.tip_roll_rad(); }
  [[nodiscard]] double base_roll_rad() const { return base_roll_rad_; }
  [[nodiscard]] double fed_mm() const { return fed_mm_; }  // sum of the increments; arc length of the inserted shaft
  [[nodiscard]] double bevel_force_N() const;              // acting now
  [[nodiscard]] const CutPath& cut_path() const { return cut_; }

  // For drawing: `points` >= 2 points in {A}, mm, evenly spaced along the shaft from the guide's mouth to the tip.
  // Allocates.
  [[nodiscard]] std::vector<Eigen::Vector3d> shaft_polyline_mm(std::size_t points) const;

 private:
  void step(double insertion_mm, double rotation_rad, double dt_s);

  BeamPlantConfig config_;
  HermiteBeam beam_;
  CutPath cut_;
  Windup windup_;
  bool bent_ = false;        // the beam has been solved for the present depth
  double settled_mm_ = 0.0;  // down to here the springs of the problem last solved were what they will be
  double base_roll_rad_ = 0.0;
  double fed_mm_ = 0.0;
  Eigen::Vector3d tip_mm_ = Eigen::Vector3d::Zero();
  Lateral tip_aside_mm_, tip_angle_rad_;  // w and w' there
};

}  // namespace bevel::model
