// SPDX-License-Identifier: MIT
#include <bevel/controller/steering_law.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <random>
#include <vector>

#include <bevel/controller/arc_law.hpp>
#include "tests/controller/agar.hpp"

namespace bevel::controller {
namespace {

// The bevel side of {B} is -e2 for k > 0; turning by +dphi lowers sigma by dphi. Seen, not derived.
TEST(SteeringLaw, TurningTheShaftTheWayTheLawSaysBringsTheBevelToTheTarget) {
  for (const double k : {0.005, -0.005}) {
    model::NeedleParameters needle;
    needle.curvature_per_mm = k;
    const Eigen::Vector3d target(20, 7, 100);
    model::Pose tip;
    const double sigma = steering_geometry(tip, needle, target, 0, 0).sigma_rad;
    model::Pose turned;
    turned.R = model::exp_so3({0, 0, sigma});
    EXPECT_NEAR(steering_geometry(turned, needle, target, 0, 0).sigma_rad, 0, 1e-12);
    // Inserting now brings the needle toward the target, the other half turn away from it.
    model::Pose away = turned;
    away.R = turned.R * model::exp_so3({0, 0, std::numbers::pi});
    const auto miss = [&](model::Pose pose) {
      model::advance(pose, {60, 0, {k, 0}}, model::slip_parameters(needle));
      return steering_geometry(pose, needle, target, 0, 0).aim_mm.norm();
    };
    EXPECT_LT(miss(turned), miss(away) - 10);
    ControllerConfig config;
    const Rates rates = steering_rates(steering_geometry(tip, needle, target, 5, 0.3), 0, 0.05, config);
    EXPECT_GT(rates.rotation_rad_s * sigma, 0) << "u2 = +(D + eta) sat(sigma/Phi)";
  }
}

TEST(SteeringLaw, SigmaFallsOutsideTheBoundaryLayerForEveryParameterSetWithinTheUncertainty) {
  constexpr unsigned kSeed = 2013;
  std::mt19937 rng(kSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  ControllerConfig config;
  config.limits.rotation_rate_rad_s = 1e3;  // the condition is the law's; where the axis is too slow, it cannot hold
  int checked = 0;
  for (int i = 0; i < 20000; ++i) {
    const model::NeedleParameters believed = agar();
    model::NeedleParameters truth = believed;
    truth.curvature_per_mm *= 1 + 0.3 * unit(rng);
    truth.lambda1_per_rad *= 1 + 0.3 * unit(rng);
    truth.lambda2 *= 1 + 0.3 * unit(rng);
    model::Pose tip;
    tip.R = model::exp_so3({0.4 * unit(rng), 0.4 * unit(rng), 3 * unit(rng)});
    const Eigen::Vector3d target = tip.R * Eigen::Vector3d(20 * unit(rng), 20 * unit(rng), 60 + 50 * unit(rng));
    const SteeringGeometry g = steering_geometry(tip, believed, target, config.limits.insertion_rate_mm_s, 0.3);
    if (!g.in_domain || g.aim_mm.norm() < 0.5) continue;
    // Near +-pi, sigma wraps: either way round is right.
    if (std::abs(g.sigma_rad) < config.gains.boundary_layer_rad || std::abs(g.sigma_rad) > 3.0) continue;
    const Rates rates = steering_rates(g, 0, 0.05, config);
    const double dt = 1e-4;
    ASSERT_TRUE(model::advance(tip, {rates.insertion_mm_s * dt, rates.rotation_rad_s * dt, {truth.curvature_per_mm, 0}},
                               model::slip_parameters(truth)));
    const SteeringGeometry after = steering_geometry(tip, believed, target, 0, 0);
    const double rate = (std::abs(after.sigma_rad) - std::abs(g.sigma_rad)) / dt;
    EXPECT_LT(rate, -0.9 * config.gains.convergence_rad_s)
        << "sigma " << g.sigma_rad << " aim " << g.aim_mm.transpose();
    ++checked;
  }
  std::cout << "seed " << kSeed << ", " << checked << " states checked\n";
  EXPECT_GT(checked, 10000);
}

TEST(SteeringLaw, KinematicInsertionsEndAtTheTarget) {
  constexpr unsigned kSeed = 500;
  std::mt19937 rng(kSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  ControllerConfig config;
  std::vector<double> misses;
  double turned = 0, inserted = 0;
  while (misses.size() < 200) {
    const model::NeedleParameters believed = agar();
    model::NeedleParameters truth = believed;
    truth.curvature_per_mm *= 1 + 0.3 * unit(rng);
    truth.lambda1_per_rad *= 1 + 0.3 * unit(rng);
    const Eigen::Vector3d target(15 * unit(rng), 15 * unit(rng), 100 + 20 * unit(rng));
    model::Pose tip;
    if (!(arc_miss_mm(arc_geometry(tip, believed, {}, target)) <= 0.5) ||
        !(arc_miss_mm(arc_geometry(tip, truth, {}, target)) <= 0.5))
      continue;
    Rates rates;
    double rotation = 0;
    const double dt = 0.02;
    double closest = 1e9;
    for (int i = 0; i < 5000; ++i) {
      const auto g = steering_geometry(tip, believed, target, config.limits.insertion_rate_mm_s, 0.3);
      if (g.ahead_mm <= 0) break;
      rates = ramp(rates, steering_rates(g, rotation, 0.05, config), dt, config.limits);
      model::advance(tip, {rates.insertion_mm_s * dt, rates.rotation_rad_s * dt, {truth.curvature_per_mm, 0}},
                     model::slip_parameters(truth));
      rotation += rates.rotation_rad_s * dt;
      turned += std::abs(rates.rotation_rad_s) * dt;
      inserted += rates.insertion_mm_s * dt;
      ASSERT_LT(std::abs(rotation), config.limits.total_rotation_rad + 0.5);
      closest = std::min(closest, (target - tip.p_mm).norm());
    }
    misses.push_back(closest);
  }
  std::sort(misses.begin(), misses.end());
  std::cout << "seed " << kSeed << ", " << misses.size() << " targets, exact state, parameters +-30 %: median "
            << misses[100] << " mm, 95 % " << misses[190] << " mm, worst " << misses.back() << " mm, "
            << turned / (2 * std::numbers::pi) / inserted * 100 << " turns per 100 mm\n";
  EXPECT_LT(misses[100], 0.2);
  EXPECT_LT(misses[190], 0.5);
}

TEST(PredictedMiss, IsZeroWithinReachAndTheDistanceThatIsLackingBeyond) {
  const auto miss_mm = [](const Eigen::Vector3d& target_mm) {
    return arc_miss_mm(arc_geometry({}, agar(), {}, target_mm));
  };
  EXPECT_LT(miss_mm({0, -10, 100}), 0.3);
  EXPECT_LT(miss_mm({6, 6, 100}), 0.3);
  EXPECT_GT(miss_mm({0, 60, 60}), 20);
}

}  // namespace
}  // namespace bevel::controller
