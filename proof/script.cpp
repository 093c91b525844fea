// SPDX-License-Identifier: MIT
#include "proof/script.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bevel::proof {
namespace {

constexpr double kAcceleration_mm_s2 = 180.0;
constexpr double kAcceleration_rad_s2 = 45.0;
constexpr double kRest_s = 0.6;  // at the end of every recording
constexpr double kDeepest_mm = 90.0;

Script plain(Random& random, double low_mm_s, double high_mm_s) {
  const double speed = random.uniform(low_mm_s, high_mm_s);
  const double duration = std::min(random.uniform(45.0, 75.0) / speed, 11.5);
  return {"plain insertion", {{duration, speed, 0}}};
}

Script stop_and_hold(Random& random) {
  const double speed = random.uniform(7, 11);
  Script script{"stop and hold", {}};
  for (int i = 0; i < 3; ++i) {
    script.segments.push_back({random.uniform(1.5, 2.3), speed, 0});
    script.segments.push_back({random.uniform(1.2, 3.0), 0, 0});
  }
  return script;
}

// Turned at rest to one side and back, ever deeper.
Script ladder_at_rest(Random& random) {
  const double speed = random.uniform(8, 12);
  Script script{"ladder at rest", {{random.uniform(1.4, 2.4), speed, 0}}};
  double side = random.sign();
  for (int i = 0; i < 3; ++i) {
    const double angle = random.uniform(1.2, 3.2);
    const double rate = random.uniform(2.0, 3.5);
    script.segments.push_back({angle / rate, 0, side * rate});
    script.segments.push_back({random.uniform(1.2, 1.9), speed, 0});
    side = -side;
  }
  return script;
}

Script ladder_moving(Random& random) {
  const double speed = random.uniform(6, 9.5);
  Script script{"ladder while inserting", {{random.uniform(1.0, 1.8), speed, 0}}};
  double side = random.sign();
  for (int i = 0; i < 6; ++i) {
    script.segments.push_back({random.uniform(0.8, 1.1), speed, side * random.uniform(1.0, 2.2)});
    side = -side;
  }
  script.segments.push_back({random.uniform(0.6, 1.2), speed, 0});
  return script;
}

Script spin(Random& random) {
  const double speed = random.uniform(7, 11);
  return {"spin",
          {{random.uniform(1.5, 2.5), speed, 0},
           {random.uniform(2.0, 3.0), speed, random.sign() * random.uniform(4.5, 8.0)},
           {random.uniform(1.5, 2.5), speed, 0}}};
}

Script retraction(Random& random) {
  const double speed = random.uniform(8, 11);
  const double back = random.uniform(9, 14);
  const double rate = random.sign() * random.uniform(2.0, 3.0);
  return {"retraction and re-insertion",
          {{random.uniform(3.0, 4.2), speed, 0},
           {random.uniform(0.8, 1.5), -back, 0},
           {random.uniform(0.5, 0.9), 0, rate},
           {random.uniform(2.8, 3.8), speed, 0}}};
}

// Half turns at speed: the needle's double bend.
Script flips(Random& random) {
  const double speed = random.uniform(7, 10);
  Script script{"flips", {{random.uniform(1.6, 2.6), speed, 0}}};
  const double side = random.sign();
  const int count = random.integer(2, 3);
  for (int i = 0; i < count; ++i) {
    const double rate = random.uniform(3.5, 5.5);
    const double way = random.chance(0.7) ? side : -side;
    script.segments.push_back({std::numbers::pi / rate, speed, way * rate});
    script.segments.push_back({random.uniform(1.1, 1.9), speed, 0});
  }
  return script;
}

Script mixture(Random& random) {
  Script script{"mixture", {}};
  const std::vector<double> rates{-1.6, -0.8, 0, 0, 0, 0.8, 1.6};
  for (int i = 0; i < 8; ++i)
    script.segments.push_back({random.uniform(0.7, 1.4), random.uniform(3, 14), random.pick(rates)});
  return script;
}

// Time to cover a change of rate adds to the way; the scripts stay away from the end of the rig's travel.
void limit_depth(Script& script) {
  const double deepest = script.largest_depth_mm();
  if (deepest <= kDeepest_mm) return;
  for (Segment& segment : script.segments) segment.insertion_rate_mm_s *= kDeepest_mm / deepest;
}

}  // namespace

double Script::largest_depth_mm() const {
  double depth = 0;
  double largest = 0;
  for (const Segment& segment : segments) {
    depth += segment.duration_s * segment.insertion_rate_mm_s;
    largest = std::max(largest, depth);
  }
  return largest;
}

double Script::duration_s() const {
  double sum = 0;
  for (const Segment& segment : segments) sum += segment.duration_s;
  return sum;
}

std::vector<Script> draw_scripts(Random& random, bool rich) {
  std::vector<Script> scripts;
  if (rich) {
    scripts = {plain(random, 4, 6.5), plain(random, 14, 20), stop_and_hold(random), ladder_at_rest(random),
               ladder_moving(random), spin(random),          retraction(random),    mixture(random)};
    // Labs do not all make the same set.
    if (random.chance(0.5)) scripts[6] = flips(random);
    if (random.chance(0.3)) scripts[2] = flips(random);
    if (random.chance(0.2)) scripts[5] = mixture(random);
    if (random.chance(0.2)) scripts[1] = plain(random, 9, 12);
  } else {
    const double speed = random.uniform(7, 11);
    for (int i = 0; i < kRecordings; ++i) scripts.push_back(plain(random, speed, speed + 0.5));
    scripts[3] = stop_and_hold(random);
    if (random.chance(0.5)) scripts[5] = plain(random, 14, 18);
  }
  for (Script& script : scripts) {
    limit_depth(script);
    script.segments.push_back({kRest_s, 0, 0});
  }
  return scripts;
}

AxisMotion follow(const Script& script) {
  AxisMotion motion;
  const auto steps = static_cast<std::size_t>(std::lround(script.duration_s() / kStep_s));
  double position_mm = 0;
  double rate_mm_s = 0;
  double angle_rad = 0;
  double rate_rad_s = 0;
  std::size_t segment = 0;
  double segment_end_s = script.segments.front().duration_s;
  for (std::size_t i = 0; i <= steps; ++i) {
    motion.insertion_mm.push_back(position_mm);
    motion.insertion_rate_mm_s.push_back(rate_mm_s);
    motion.rotation_rad.push_back(angle_rad);
    motion.rotation_rate_rad_s.push_back(rate_rad_s);
    while (segment + 1 < script.segments.size() && static_cast<double>(i) * kStep_s >= segment_end_s)
      segment_end_s += script.segments[++segment].duration_s;
    const Segment& wanted = script.segments[segment];
    const double most_mm_s = kAcceleration_mm_s2 * kStep_s;
    const double most_rad_s = kAcceleration_rad_s2 * kStep_s;
    const double next_mm_s = rate_mm_s + std::clamp(wanted.insertion_rate_mm_s - rate_mm_s, -most_mm_s, most_mm_s);
    const double next_rad_s = rate_rad_s + std::clamp(wanted.rotation_rate_rad_s - rate_rad_s, -most_rad_s, most_rad_s);
    position_mm += 0.5 * (rate_mm_s + next_mm_s) * kStep_s;
    angle_rad += 0.5 * (rate_rad_s + next_rad_s) * kStep_s;
    rate_mm_s = next_mm_s;
    rate_rad_s = next_rad_s;
  }
  return motion;
}

}  // namespace bevel::proof
