// SPDX-License-Identifier: MIT
#pragma once
// Needles that are drawn back and inserted again: axes at 100 Hz, two cameras, and any plant in between.
#include <functional>
#include <random>
#include <vector>

#include <bevel/rig/plant/plant.hpp>
#include "tests/estimator/insertion.hpp"

namespace bevel::estimator::testing {

struct Leg {
  double insertion_mm, rotation_rad;
};

// In, with half a turn at rest, turns while it is fed and a turn back; then drawn back by 30 mm after the bevel was
// turned at rest; turned again; in to the front and beyond it.
inline const std::vector<Leg> kIn{{35, 0}, {0, 3.14}, {20, 0}, {12, 2.2}, {0, -1.3}, {13, 0}};
inline const std::vector<Leg> kBack{{0, 1.2}, {-30, 0}};
inline const std::vector<Leg> kAgain{{0, 1.5}, {30, -0.6}, {20, 0}};

inline constexpr double kFeed_mm_s = 5, kTurn_rad_s = 2;

// Calls `each` after every 10 ms with the increments of that time.
inline void follow(const std::vector<Leg>& legs, const std::function<void(double mm, double rad)>& each) {
  for (const Leg& leg : legs) {
    const double seconds = std::max(std::abs(leg.insertion_mm) / kFeed_mm_s, std::abs(leg.rotation_rad) / kTurn_rad_s);
    const int steps = std::max(1, static_cast<int>(std::ceil(seconds * 100)));
    for (int i = 0; i < steps; ++i) each(leg.insertion_mm / steps, leg.rotation_rad / steps);
  }
}

// Goes on with `out`, from where it ends; both cameras see the tip at 30 Hz.
inline void record(rig::Plant& plant, const std::vector<Leg>& legs, double sigma_mm, std::mt19937_64& rng,
                   Insertion& out) {
  model::ActuatorState a;
  a.utime = kStart_utime;
  a.axis_status = {2, 2};
  if (out.actuators.empty()) {
    out.actuators.push_back(a);
    out.poses.push_back(plant.tip());
  }
  a = out.actuators.back();
  follow(legs, [&](double mm, double rad) {
    plant.advance(mm, rad, 0.01);
    a.utime += 10'000, ++a.seq;
    a.insertion_mm += mm, a.rotation_rad += rad;
    out.actuators.push_back(a);
    out.poses.push_back(plant.tip());
    if (a.seq % 3 != 0) return;
    for (const int camera : {0, 1})
      out.measurements.push_back(measure(plant.tip().p_mm, a.utime, a.seq, camera,
                                         camera == 0 ? Eigen::Vector3d(0, 1, 1) : Eigen::Vector3d(1, 0, 1), sigma_mm,
                                         rng));
  });
  out.final_pose = plant.tip();
}

}  // namespace bevel::estimator::testing
