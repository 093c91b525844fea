// SPDX-License-Identifier: MIT
#pragma once
// A simulated insertion that stops and goes, seen by a camera whose stamps are late.
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <bevel/model/samples.hpp>
#include <bevel/rig/plant/plant.hpp>

namespace bevel::test {

inline constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;

inline model::NeedleParameters believed_needle() {
  model::NeedleParameters needle;
  needle.curvature_per_mm = 0.0047;
  needle.wheelbase_mm = 20;
  needle.lambda1_per_rad = 0.49;
  needle.lambda2 = 0.22;
  return needle;
}

struct StopAndGo {
  double latency_s = 0;
  double rate_mm_s = 8;
  int stops = 8;
  double half_period_s = 1;    // of motion before each stop, and of the stop
  double turn_rate_rad_s = 1;  // while it moves
  double reading_sd_mm = 0.2;
  double correlation = 0;      // of errors of frames that follow each other
  double depth_error_mm = 0;   // by which the camera is registered wrong
  double curvature_ratio = 1;  // of the needle's true curvature to what is believed
  double slip = 1;             // mm of tip per mm of base
  bool blind_along_x = false;  // one camera that looks along x, as a planar view reports it
  double withdrawn_mm = 0;     // at the end, with play of this size
  // Of an error along the needle that keeps its value while the needle moves, and goes to another one in each stop, as
  // that of a tracker does whose bevel is turned there.
  double turned_at_rest_sd_mm = 0;
  std::uint64_t seed = 1;
};

struct Seen {
  std::vector<model::ActuatorState> axes;
  std::vector<model::TipMeasurement> tips;
};

// Rates change by 50 mm/s^2 as those of a drive do; axes logged at 100 Hz, frames at 30 Hz, both on clocks of their
// own.
inline Seen simulate(const StopAndGo& s) {
  constexpr double kStep_s = 1e-3, kAcceleration_mm_s2 = 50;
  model::NeedleParameters needle = believed_needle();
  needle.curvature_per_mm *= s.curvature_ratio;
  rig::KinematicPlant plant(needle, {}, 0.1);
  std::mt19937_64 random(s.seed);
  std::normal_distribution<double> noise;
  Eigen::Vector3d error = Eigen::Vector3d::NullaryExpr([&] { return noise(random); });
  std::mt19937_64 random_levels(s.seed + 1'000'000);
  std::vector<double> levels_mm(static_cast<std::size_t>(s.stops) + 2);
  for (double& level_mm : levels_mm) level_mm = s.turned_at_rest_sd_mm * noise(random_levels);
  const auto level_mm = [&](double phase_s) {  // over the whole of a stop from one to the next
    const double cycle = std::clamp(phase_s / (2 * s.half_period_s), 0.0, static_cast<double>(s.stops));
    const auto k = static_cast<std::size_t>(cycle);
    const double turned = std::clamp(2 * (cycle - static_cast<double>(k)) - 1, 0.0, 1.0);
    return levels_mm[k] + turned * (levels_mm[k + 1] - levels_mm[k]);
  };
  double rate_mm_s = 0, rotation_rad = 0, insertion_mm = 0, next_frame_s = 0.0117;
  Seen seen;
  const double going_s = 2 * s.half_period_s * s.stops,
               withdrawing_s = s.withdrawn_mm > 0 ? 2 * s.withdrawn_mm / s.rate_mm_s : 0;
  const auto steps = std::llround((0.5 + going_s + withdrawing_s) / kStep_s);
  for (std::int64_t i = 0; i <= steps; ++i) {
    const double t_s = static_cast<double>(i) * kStep_s, phase_s = t_s - 0.5;
    double wanted_mm_s = 0;
    if (phase_s >= 0 && phase_s < going_s && std::fmod(phase_s, 2 * s.half_period_s) < s.half_period_s)
      wanted_mm_s = s.rate_mm_s;
    if (phase_s >= going_s && s.withdrawn_mm > 0) wanted_mm_s = -s.rate_mm_s / 2;
    const double most = kAcceleration_mm_s2 * kStep_s;
    rate_mm_s += std::clamp(wanted_mm_s - rate_mm_s, -most, most);
    const double advance_mm = rate_mm_s * kStep_s;
    const double turn_rad = rate_mm_s > 0 ? s.turn_rate_rad_s * kStep_s : 0;
    insertion_mm += advance_mm;
    rotation_rad += turn_rad;
    if (advance_mm > 0) plant.advance(s.slip * advance_mm, turn_rad, kStep_s);
    const auto utime = kStart_utime + i * 1000;
    if (i % 10 == 0) {
      model::ActuatorState a;
      a.utime = utime, a.seq = i / 10;
      a.insertion_mm = insertion_mm, a.insertion_rate_mm_s = rate_mm_s, a.rotation_rad = rotation_rad;
      seen.axes.push_back(a);
    }
    if (t_s < next_frame_s) continue;
    next_frame_s += 1.0 / 30;
    for (double& e : error) e = s.correlation * e + std::sqrt(1 - s.correlation * s.correlation) * noise(random);
    model::TipMeasurement m;
    m.utime = utime + std::llround(1e6 * s.latency_s);
    m.seq = static_cast<std::int64_t>(seen.tips.size());
    m.position_mm = plant.tip().p_mm + Eigen::Vector3d(0, 0, s.depth_error_mm) + s.reading_sd_mm * error;
    m.position_mm += level_mm(phase_s) * plant.tip().R.col(2);
    m.information_per_mm2 = Eigen::Matrix3d::Identity() / (s.reading_sd_mm * s.reading_sd_mm);
    if (s.blind_along_x) m.position_mm.x() = 0, m.information_per_mm2(0, 0) = 0;
    seen.tips.push_back(m);
  }
  return seen;
}

}  // namespace bevel::test
