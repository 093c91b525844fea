#include "controller/reach.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::controller {
namespace {

constexpr double kStep_mm = 2.0;

// Closest distance of the path to the target for one duty, the bevel turned toward the target's side in the beginning.
double closest_approach(model::Pose pose, const model::NeedleParameters& needle, const Eigen::Vector3d& target_mm,
                        double duty) {
  const model::SlipParameters slip = model::slip_parameters(needle);
  double best = (target_mm - pose.p_mm).norm();
  const double longest = 1.5 * best + 10;
  const int steps = static_cast<int>(longest / kStep_mm);
  for (int i = 0; i < steps; ++i) {
    const double ahead = (pose.R.transpose() * (target_mm - pose.p_mm)).z();
    if (ahead <= 0) break;
    const double step = std::min(kStep_mm, std::max(ahead, 0.01));
    if (!model::step(pose, {step, 0, {duty * needle.curvature_per_mm, 0}}, slip)) break;
    best = std::min(best, (target_mm - pose.p_mm).norm());
  }
  return best;
}

}  // namespace

Reach predict_reach(const model::Pose& tip, const model::NeedleParameters& needle, const Eigen::Vector3d& target_mm,
                    double tolerance_mm, double enough_mm) {
  Reach reach;
  reach.miss_mm = std::numeric_limits<double>::infinity();
  const SteeringGeometry geometry = steering_geometry(tip, needle, target_mm, 0, 0);
  if (!geometry.in_domain) return reach;
  // The plane of the best constant arc holds the line of motion and the target: turning by sigma puts the bevel there.
  model::Pose turned = tip;
  turned.R = tip.R * model::exp_so3({0, 0, geometry.sigma_rad});
  reach.roll_rad = geometry.sigma_rad;

  const auto try_duty = [&](double duty) {
    const double miss_mm = closest_approach(turned, needle, target_mm, duty);
    if (miss_mm < reach.miss_mm) reach.miss_mm = miss_mm, reach.duty = duty;
    return miss_mm;
  };
  const auto enough = [&] { return reach.miss_mm <= enough_mm; };
  // The miss is smooth in the duty with one minimum: golden section, and the ends.
  double low = 0, high = 1;
  const double ratio = 0.5 * (std::sqrt(5.0) - 1);
  double x1 = high - ratio * (high - low), x2 = low + ratio * (high - low);
  double f1 = try_duty(x1), f2 = enough() ? f1 : try_duty(x2);
  for (int i = 0; i < 24 && !enough(); ++i) {
    if (f1 < f2) {
      high = x2, x2 = x1, f2 = f1;
      x1 = high - ratio * (high - low), f1 = try_duty(x1);
    } else {
      low = x1, x1 = x2, f1 = f2;
      x2 = low + ratio * (high - low), f2 = try_duty(x2);
    }
  }
  for (const double duty : {0.0, 1.0})
    if (!enough()) try_duty(duty);
  reach.reachable = reach.miss_mm <= tolerance_mm;
  return reach;
}

}  // namespace bevel::controller
