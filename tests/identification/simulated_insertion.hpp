// SPDX-License-Identifier: MIT
#pragma once
// Recordings of a simulated needle, made with the model's own fine steps: 100 Hz of actuator states, a camera at 30 Hz
// that sees y and z (or all three axes), white Gaussian noise of the size that its information states.
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include <bevel/diagnosis/identification/insertion.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::diagnosis {

struct SimulatedInsertion {
  double length_mm = 130;
  double speed_mm_s = 20;
  int measurements = 195;
  double sigma_mm = 0.2;
  double outlier_share = 0;     // of the measurements, thrown off by up to 10 mm
  bool spatial = false;         // the camera sees x, too
  double rotation_rad = 0;      // turned steadily from a third of the insertion to two thirds
  double initial_roll_rad = 0;  // of the needle against what the actuators say: an entry parameter
};

struct SimulatedRecording {
  std::vector<model::ActuatorState> actuators;
  std::vector<model::TipMeasurement> tips;
};

inline SimulatedRecording simulate(const model::NeedleParameters& needle, const SimulatedInsertion& plan,
                                   std::mt19937_64& random) {
  SimulatedRecording out;
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double duration_s = plan.length_mm / plan.speed_mm_s;
  const auto insertion_mm = [&](double t) { return std::min(plan.speed_mm_s * t, plan.length_mm); };
  const auto rotation_rad = [&](double t) { return plan.rotation_rad * std::clamp(3 * t / duration_s - 1, 0.0, 1.0); };
  const int ticks = static_cast<int>(std::ceil(duration_s * 100)) + 1;
  for (int i = 0; i <= ticks; ++i) {
    const double t = 0.01 * i;
    model::ActuatorState a;
    a.utime = 1'000'000 + std::llround(t * 1e6);
    a.insertion_mm = insertion_mm(t);
    a.rotation_rad = rotation_rad(t);
    out.actuators.push_back(a);
  }
  model::Pose pose;
  pose.R = model::exp_so3({0, 0, plan.initial_roll_rad});
  double before_s = 0;
  for (int i = 1; i <= plan.measurements; ++i) {
    const double t = duration_s * i / plan.measurements;
    constexpr int kParts = 10;
    for (int k = 1; k <= kParts; ++k) {
      const double a = before_s + (t - before_s) * (k - 1) / kParts;
      const double b = before_s + (t - before_s) * k / kParts;
      if (!model::advance(
              pose,
              {insertion_mm(b) - insertion_mm(a), rotation_rad(b) - rotation_rad(a), {needle.curvature_per_mm, 0}},
              model::slip_parameters(needle)))
        throw std::domain_error("the simulated needle leaves the domain of (25)");
    }
    before_s = t;
    model::TipMeasurement m;
    m.utime = 1'000'000 + std::llround(t * 1e6);
    m.seq = i;
    m.position_mm = pose.p_mm;
    const double information = 1 / (plan.sigma_mm * plan.sigma_mm);
    m.information_per_mm2 = Eigen::Vector3d(plan.spatial ? information : 0, information, information).asDiagonal();
    for (int axis = plan.spatial ? 0 : 1; axis < 3; ++axis) m.position_mm(axis) += plan.sigma_mm * gauss(random);
    if (0.5 * (uniform(random) + 1) < plan.outlier_share) m.position_mm.y() += 10 * uniform(random);
    out.tips.push_back(m);
  }
  return out;
}

inline Insertion simulate_insertion(const model::NeedleParameters& needle, const SimulatedInsertion& plan,
                                    std::mt19937_64& random) {
  const SimulatedRecording r = simulate(needle, plan, random);
  return make_insertion("simulated", r.actuators, r.tips);
}

}  // namespace bevel::diagnosis
