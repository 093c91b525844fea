// SPDX-License-Identifier: MIT
#include <bevel/controller/steering_law.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <bevel/model/shaft_end.hpp>

namespace bevel::controller {

SteeringGeometry steering_geometry(const model::Pose& tip, const model::NeedleParameters& needle,
                                   const Eigen::Vector3d& target_mm, double insertion_rate_mm_s,
                                   double parameter_uncertainty, const ShaftConfig& shaft) {
  SteeringGeometry g;
  const model::StepInput unit{1.0, 0.0, {needle.curvature_per_mm, 0}};
  model::Vector6d twist;
  if (!model::body_twist(tip.R, unit, model::slip_parameters(needle), twist)) return g;
  g.in_domain = true;
  const Eigen::Vector3d q = tip.R.transpose() * (target_mm - tip.p_mm);
  Eigen::Vector2d f = twist.head<2>();
  if (shaft.bending_mm > 0) {
    const model::ShaftEnd end = model::shaft_end((tip.p_mm.z() + shaft.guide_mm) / shaft.bending_mm);
    f.y() -= 0.5 * needle.curvature_per_mm * shaft.bending_mm * end.h;
  }
  g.ahead_mm = q.z();
  g.aim_mm = q.head<2>() - f * q.z();
  const double side = needle.curvature_per_mm < 0 ? -1.0 : 1.0;
  g.sigma_rad = std::atan2(side * g.aim_mm.x(), -side * g.aim_mm.y());

  // |w| <= |k| + |f|/ell, and df/ds follows the turning of the heading (|df/dtheta| below 1 in the whole domain of
  // use).
  const double turning_per_mm = std::abs(needle.curvature_per_mm) + f.norm() / needle.wheelbase_mm;
  const double drift_mm_s =
      insertion_rate_mm_s * (1 + parameter_uncertainty) * 2 * turning_per_mm * std::max(g.ahead_mm, 0.0);
  g.drift_bound_rad_s = drift_mm_s / std::max(g.aim_mm.norm(), 1e-6);
  return g;
}

Rates steering_rates(const SteeringGeometry& geometry, double rotation_rad, double tolerance_mm,
                     const ControllerConfig& config) {
  const SteeringLimits& limits = config.limits;
  const SteeringGains& gains = config.gains;
  if (!geometry.in_domain || geometry.ahead_mm <= 0) return {};
  Rates rates;
  // Slow where the bevel points away: what is inserted then has to be steered back.
  const double share = std::max(limits.insertion_rate_min_share, 0.5 * (1 + std::cos(geometry.sigma_rad)));
  rates.insertion_mm_s = limits.insertion_rate_mm_s * share;
  if (geometry.aim_mm.norm() < tolerance_mm) return rates;

  double sigma = geometry.sigma_rad;
  // Near the end of the cable the same side is reached the other way round.
  const double room = limits.total_rotation_rad - std::abs(rotation_rad);
  const bool outward = sigma * rotation_rad > 0;
  if (outward && std::abs(sigma) > room) sigma -= std::copysign(2 * std::numbers::pi, sigma);
  const double rate = geometry.drift_bound_rad_s + gains.convergence_rad_s;
  rates.rotation_rad_s =
      std::min(rate, limits.rotation_rate_rad_s) * std::clamp(sigma / gains.boundary_layer_rad, -1.0, 1.0);
  return rates;
}

Rates ramp(const Rates& rates, const Rates& wanted, double dt_s, const SteeringLimits& limits) {
  const auto toward = [](double from, double to, double step) { return std::clamp(to, from - step, from + step); };
  return {toward(rates.insertion_mm_s, wanted.insertion_mm_s, limits.insertion_acceleration_mm_s2 * dt_s),
          toward(rates.rotation_rad_s, wanted.rotation_rad_s, limits.rotation_acceleration_rad_s2 * dt_s)};
}

}  // namespace bevel::controller
