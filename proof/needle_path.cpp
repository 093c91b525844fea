// SPDX-License-Identifier: MIT
#include "proof/needle_path.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include <bevel/error.hpp>

namespace bevel::proof {
namespace {

constexpr double kLongest_mm = 0.05;   // in one step of the integration
constexpr double kSlowest_mm_s = 0.2;  // rate dependence is not continued below

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Tip {
  Vector3d p = Vector3d::Zero();
  Vector3d h = Vector3d::UnitZ();
  Vector3d e1 = Vector3d::UnitX();

  Vector3d e2() const { return h.cross(e1); }
};

struct Rate {  // per mm of advance
  Vector3d dp, dh, de1;
};

// tan(alpha) at a lean theta >= 0 of the heading from z, (25) solved for gamma.
double slip_tangent(const BaseNeedle& needle, double lean_rad) {
  const double b = 1.0 - needle.lambda2;
  const double root = b * b + 4.0 * needle.lambda1_per_rad * lean_rad;
  if (root < 0.0) throw DomainError("the tip leans too far for the slip law");
  return std::tan(2.0 * lean_rad / (b + std::sqrt(root)) - lean_rad);
}

class Tissue {
 public:
  Tissue(const BaseNeedle& needle, const HiddenPhysics& physics) : needle_(needle), physics_(physics) {
    tip_.h = Eigen::AngleAxisd(physics.entry_about_y_rad, Vector3d::UnitY()) *
             (Eigen::AngleAxisd(physics.entry_about_x_rad, Vector3d::UnitX()) * Vector3d::UnitZ());
    tip_.e1 = (Vector3d::UnitX() - Vector3d::UnitX().dot(tip_.h) * tip_.h).normalized();
  }

  double depth_mm() const { return tip_.p.z(); }

  // `speed_mm_s` and `turn_rad_s` are the base's: in the physical forms the tip's own take their place.
  void advance(double time_s, double advance_mm, double roll_before_rad, double roll_after_rad, double speed_mm_s,
               double turn_rad_s, double step_s) {
    const double roll_rad = 0.5 * (roll_before_rad + roll_after_rad);
    const double share = physics_.departure;
    speed_mm_s += share * (std::abs(advance_mm) / step_s - speed_mm_s);
    turn_rad_s += share * (std::abs(roll_after_rad - roll_before_rad) / step_s - turn_rad_s);
    reload(advance_mm, step_s);
    // A tip that sticks is at rest, whatever its base does.
    relax(advance_mm, physics_.stick_slip_mm > 0.0 ? std::abs(advance_mm) / step_s : speed_mm_s, roll_rad, step_s);
    if (std::abs(advance_mm) < 1e-12) return;
    advanced_mm_ += advance_mm;
    const double k = needle_.curvature_per_mm * softening(time_s, speed_mm_s, turn_rad_s, std::abs(advance_mm)) *
                     surroundings(roll_rad);
    const Vector2d bevel = k * Vector2d(std::cos(roll_rad), std::sin(roll_rad));
    const Vector2d own = needle_.curvature_per_mm * Vector2d(std::cos(roll_rad), std::sin(roll_rad));
    const Vector2d curvature = recover(bevel, own, std::max(advance_mm, 0.0));
    const Rate first = rate(tip_, curvature, roll_rad);
    Tip middle = tip_;
    move(middle, first, 0.5 * advance_mm);
    move(tip_, rate(middle, curvature, roll_rad), advance_mm);
  }

  Vector3d tip_mm(double time_s, int recording) const {
    Vector3d p = tip_.p;
    p.head<2>() += (offset_mm_.x() * tip_.e1 + offset_mm_.y() * tip_.e2()).head<2>();  // tissue yields sideways
    if (physics_.motion_mm > 0.0) {
      const double phase = 2.0 * std::numbers::pi * physics_.motion_hz * time_s +
                           physics_.motion_phase_rad.at(static_cast<std::size_t>(recording));
      // Breathing is not quite a sine.
      const double a = physics_.motion_mm * (std::sin(phase) + 0.03 * physics_.departure * std::sin(2.0 * phase));
      p += a * Vector3d(std::cos(physics_.motion_direction_rad), std::sin(physics_.motion_direction_rad), 0);
    }
    return p;
  }

 private:
  Rate rate(const Tip& tip, const Vector2d& curvature, double roll_rad) const {
    const double sine = std::hypot(tip.h.x(), tip.h.y());
    const double lean = std::atan2(sine, tip.h.z());
    Vector3d f = Vector3d::Zero();
    if (sine > 1e-12) {
      const Vector3d t = (tip.h * tip.h.z() - Vector3d::UnitZ()) / sine;
      f = slip_tangent(needle_, lean) * t;
    }
    if (physics_.other_slip != 0.0) {
      const Vector3d bevel = -std::sin(roll_rad) * tip.e1 + std::cos(roll_rad) * tip.e2();
      f = f.dot(bevel) * bevel;
    }
    Vector3d omega = curvature.x() * tip.e1 + curvature.y() * tip.e2() + tip.h.cross(f) / needle_.wheelbase_mm;
    if (physics_.bias_x_per_mm != 0.0 || physics_.bias_y_per_mm != 0.0) {
      const double growth = 1.0 + 0.2 * physics_.departure * (advanced_mm_ / 50.0 - 0.5);
      omega += growth * tip.h.cross(Vector3d(physics_.bias_x_per_mm, physics_.bias_y_per_mm, 0));
    }
    // Where one tissue meets another askew the tip slides along the interface before it is through: Mahvash and Dupont
    // 2009, "Fast needle insertion to minimize tissue deformation and damage", ICRA (transitions drive it off course).
    if (physics_.interface_rad != 0.0) {
      constexpr double kSlope = 0.5;     // of the interface
      constexpr double kWidth_mm = 1.5;  // of the transition
      const Vector3d toward(std::cos(physics_.interface_toward_rad), std::sin(physics_.interface_toward_rad), 0);
      const Vector3d across = Vector3d::UnitZ() - kSlope * toward;
      const double sech = 1.0 / std::cosh((across.dot(tip.p) - physics_.interface_depth_mm) / kWidth_mm);
      // One interface leads aside by its angle at whatever angle it is crossed, and back on the way back.
      const double crossing_per_mm = 0.5 * sech * sech / kWidth_mm * across.dot(tip.h + f);
      omega += physics_.interface_rad * crossing_per_mm * tip.h.cross(toward);
    }
    return {tip.h + f, omega.cross(tip.h), omega.cross(tip.e1)};
  }

  static void move(Tip& tip, const Rate& rate, double advance_mm) {
    tip.p += advance_mm * rate.dp;
    tip.h = (tip.h + advance_mm * rate.dh).normalized();
    tip.e1 += advance_mm * rate.de1;
    tip.e1 = (tip.e1 - tip.e1.dot(tip.h) * tip.h).normalized();
  }

  // Everything that changes the curvature's size.
  double softening(double time_s, double speed_mm_s, double turn_rad_s, double travel_mm) {
    double factor = 1.0 + physics_.curvature_drift_per_s * time_s;
    const double z = tip_.p.z();
    const double round = physics_.departure;
    if (physics_.rate_exponent != 0.0)
      factor *= std::pow(std::hypot(std::max(speed_mm_s, kSlowest_mm_s), 0.3 * round) / 10.0, -physics_.rate_exponent);
    if (physics_.layer_ratio != 1.0) {
      const double width_mm = 1.5 * round;
      const double share = width_mm > 0.0 ? 0.5 * (1.0 + std::tanh((z - physics_.layer_depth_mm) / width_mm))
                                          : (z > physics_.layer_depth_mm ? 1.0 : 0.0);
      factor *= 1.0 + (physics_.layer_ratio - 1.0) * share;
    }
    if (physics_.reloading_share != 0.0) factor *= 1.0 - physics_.reloading_share * unloaded_;
    // The shaft's elasticity knows its length rather than the depth.
    factor *= 1.0 + physics_.curvature_per_100mm * ((1.0 - round) * z + round * advanced_mm_) / 100.0;
    if (physics_.fibre_share != 0.0)
      factor *= 1.0 + physics_.fibre_share * std::sin(2.0 * std::numbers::pi * z / physics_.fibre_period_mm);
    if (physics_.drilling_mm_per_rad != 0.0) {
      // The cutting face needs a little way to feel the change.
      const double wanted = 1.0 / (1.0 + physics_.drilling_mm_per_rad * turn_rad_s / std::max(speed_mm_s, 1e-3));
      const double way_mm = 0.8 * round;
      const double keep = way_mm > 0.0 ? std::exp(-travel_mm / way_mm) : 0.0;
      drilled_ = keep * drilled_ + (1.0 - keep) * wanted;
      factor *= drilled_;
    }
    return factor;
  }

  // What the tissue about the needle makes of its curvature.
  double surroundings(double roll_rad) const {
    double factor = 1.0;
    // Fibres wind onto a shaft that turns, grasp it, and are unwound when it turns back: Langevin and others 2001,
    // "Biomechanical response to acupuncture needling in humans", J. Appl. Physiol. 91.
    if (physics_.winding_per_rad != 0.0)
      factor /= 1.0 + physics_.winding_per_rad * std::abs(roll_rad - physics_.bevel_offset_rad);
    // A stiffer side bends the needle more.
    if (physics_.side_per_mm != 0.0) {
      const Vector2d side(std::cos(physics_.side_direction_rad), std::sin(physics_.side_direction_rad));
      factor *= std::max(0.2, 1.0 + physics_.side_per_mm * side.dot(tip_.p.head<2>()));
    }
    return factor;
  }

  // Curvature follows the bevel over a length, in two stages of which the second is short.
  Vector2d recover(const Vector2d& bevel, const Vector2d& own, double cut_mm) {
    const double length_mm = physics_.flip_length_mm;
    if (length_mm <= 0.0) return bevel;
    if (!recovering_) first_ = second_ = own;
    recovering_ = true;
    const double short_mm = 0.15 * physics_.departure * length_mm;
    first_ = bevel + (first_ - bevel) * std::exp(-cut_mm / (length_mm - short_mm));
    second_ = short_mm > 0.0 ? Vector2d(first_ + (second_ - first_) * std::exp(-cut_mm / short_mm)) : first_;
    return second_;
  }

  // Tissue pressed on by the bevel relaxes in time, as all soft tissue does (Fung, Biomechanics), and cutting
  // presses on fresh tissue: a Maxwell body that advance renews. The needle enters unloaded.
  void reload(double advance_mm, double step_s) {
    if (physics_.reloading_share == 0.0) return;
    const double relaxed = step_s / physics_.reloading_tau_s;
    const double renewed = std::max(advance_mm, 0.0) / physics_.reloading_length_mm;
    const double rest = relaxed / (relaxed + renewed);
    unloaded_ = rest + (unloaded_ - rest) * std::exp(-relaxed - renewed);
  }

  // An elastic offset toward the bevel: builds while the tip cuts, goes at rest.
  void relax(double advance_mm, double speed_mm_s, double roll_rad, double step_s) {
    if (physics_.relaxation_mm <= 0.0) return;
    const Vector2d full = physics_.relaxation_mm * Vector2d(std::sin(roll_rad), -std::cos(roll_rad));
    if (advance_mm > 0.0) {
      const Vector2d missing = full - offset_mm_;
      // From proportional to ever slower near the end.
      const double slowing =
          1.0 - 0.35 * physics_.departure * std::min(1.0, offset_mm_.norm() / physics_.relaxation_mm);
      offset_mm_ += missing * std::min(1.0, slowing * advance_mm / physics_.relaxation_build_mm);
    }
    if (speed_mm_s < 0.3) offset_mm_ *= std::exp(-step_s / physics_.relaxation_tau_s);
  }

  BaseNeedle needle_;
  const HiddenPhysics& physics_;
  Tip tip_;
  double advanced_mm_ = 0;
  double drilled_ = 1;
  Vector2d first_ = Vector2d::Zero();
  Vector2d second_ = Vector2d::Zero();
  Vector2d offset_mm_ = Vector2d::Zero();
  bool recovering_ = false;
  double unloaded_ = 1;  // share of the load on the bevel that has relaxed
};

}  // namespace

TipPath travel(const BaseNeedle& needle, const AxisMotion& motion, const HiddenPhysics& physics,
               const DriveRipple& ripple, int recording) {
  DriveTrain drive(physics, ripple, recording);
  Tissue tissue(needle, physics);
  TipPath path;
  path.reserve(motion.size());
  DriveTrain::Tip before = drive.step(0.0, motion.insertion_mm[0], motion.rotation_rad[0], 0.0);
  path.push_back(tissue.tip_mm(0.0, recording));
  for (std::size_t i = 1; i < motion.size(); ++i) {
    const double time_s = kStep_s * static_cast<double>(i);
    const auto now = drive.step(time_s, motion.insertion_mm[i], motion.rotation_rad[i], tissue.depth_mm());
    // A jump goes a long way in a step: bit by bit.
    const double advance_mm = now.advance_mm - before.advance_mm;
    const int parts = physics.stick_slip_mm > 0.0 ? 1 + static_cast<int>(std::abs(advance_mm) / kLongest_mm) : 1;
    const double turn_rad = now.roll_rad - before.roll_rad;
    for (int part = 0; part < parts; ++part)
      tissue.advance(time_s, advance_mm / parts, before.roll_rad + turn_rad * part / parts,
                     part + 1 == parts ? now.roll_rad : before.roll_rad + turn_rad * (part + 1) / parts,
                     std::abs(motion.insertion_mm[i] - motion.insertion_mm[i - 1]) / kStep_s,
                     std::abs(motion.rotation_rad[i] - motion.rotation_rad[i - 1]) / kStep_s, kStep_s / parts);
    path.push_back(tissue.tip_mm(time_s, recording));
    before = now;
  }
  return path;
}

}  // namespace bevel::proof
