// SPDX-License-Identifier: MIT
#pragma once
// Motion scripts of constant rates, and effects run along them.
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <bevel/model/effects/open_loop.hpp>

namespace bevel::model::testing {

struct Segment {
  double duration_s, insertion_mm_s, rotation_rad_s;
};

class Script {
 public:
  Script(std::initializer_list<Segment> segments) : segments_(segments) {}

  double duration_s() const {
    double sum = 0;
    for (const auto& s : segments_) sum += s.duration_s;
    return sum;
  }
  BaseMotion at(double time_s) const {
    BaseMotion base{time_s, 0, 0};
    double left_s = time_s;
    for (const auto& s : segments_) {
      const double share_s = std::clamp(left_s, 0.0, s.duration_s);
      base.insertion_mm += share_s * s.insertion_mm_s;
      base.rotation_rad += share_s * s.rotation_rad_s;
      left_s -= s.duration_s;
    }
    return base;
  }
  // As a rig logs it.
  std::vector<ActuatorState> actuators(double period_s) const {
    std::vector<ActuatorState> all;
    for (int i = 0; i * period_s <= duration_s() + 1e-9; ++i) {
      const BaseMotion base = at(i * period_s);
      ActuatorState a;
      a.utime = 1'700'000'000'000'000 + std::llround(i * period_s * 1e6);
      a.seq = i;
      a.insertion_mm = base.insertion_mm;
      a.rotation_rad = base.rotation_rad;
      all.push_back(a);
    }
    return all;
  }
  // Legs as make_motion() cuts them: readings at 30 Hz, actuator states at 100 Hz.
  Motion recorded() const {
    const auto samples = actuators(0.01);
    std::vector<std::int64_t> readings;
    for (std::int64_t us = 0; us <= std::llround(duration_s() * 1e6); us += 33'333)
      readings.push_back(samples.front().utime + us);
    return make_motion(samples, readings);
  }
  // Legs so short that the effects' own rules for a leg do not matter; a reading at each 50th end.
  Motion fine(double leg_s = 1e-3) const {
    Motion motion;
    const auto count = static_cast<std::size_t>(std::llround(duration_s() / leg_s));
    for (std::size_t i = 0; i <= count; ++i) {
      motion.nodes.push_back(at(static_cast<double>(i) * leg_s));
      if (i % 50 == 0) motion.at.push_back(i);
    }
    return motion;
  }

 private:
  std::vector<Segment> segments_;
};

// Turns both ways at several depths, changes of speed, a rest, a stretch of steady turning, and retraction: excites
// every effect. 8.5 s, 62 mm at the deepest.
inline Script rich_script() {
  return {{1.0, 10, 0.4},  {0.4, 10, 3.5}, {0.6, 10, 0}, {0.6, 0, -4.0}, {1.0, 20, 0},    {0.3, 6, 5.0}, {0.9, 6, 0},
          {0.5, 12, -2.4}, {1.2, 0, 0},    {0.8, 9, 6},  {0.4, -10, 0},  {0.3, -10, 1.5}, {0.5, 8, 1.5}};
}

inline NeedleParameters agar() {
  NeedleParameters needle;
  needle.curvature_per_mm = 0.0047;
  needle.wheelbase_mm = 20;
  needle.lambda1_per_rad = 0.49;
  needle.lambda2 = 0.22;
  return needle;
}
inline NeedleParameters bicycle() {
  NeedleParameters needle;
  needle.curvature_per_mm = 0.0047;
  return needle;
}

inline ActiveEffect active(std::string_view name, const std::vector<double>& values) {
  ActiveEffect one{.effect = find_effect(name), .parameters = {}};
  if (one.effect == nullptr || one.effect->parameters().size() != values.size())
    throw std::invalid_argument("no effect " + std::string(name) + " of so many parameters");
  for (std::size_t i = 0; i < values.size(); ++i) one.parameters[i] = values[i];
  return one;
}

// Throws where the needle leaves the domain.
inline OpenLoop run(const AugmentedNeedle& needle, const Motion& motion, bool headings = false) {
  OpenLoop path;
  if (!predict(needle, motion, path, headings)) throw std::domain_error("the needle leaves the domain of (25)");
  return path;
}
inline std::vector<Eigen::Vector3d> path_of(const NeedleParameters& needle, const std::vector<ActiveEffect>& effects,
                                            const Motion& motion) {
  return run(AugmentedNeedle(needle, effects), motion).position_mm;
}

inline double largest_distance_mm(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  if (a.size() != b.size() || a.empty()) throw std::invalid_argument("paths of different lengths");
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

}  // namespace bevel::model::testing
