// SPDX-License-Identifier: MIT
#pragma once
// Short recordings of a rig of which everything is known: the needle, what the model of it leaves out, and the noise.
// The tip's path is that of model::predict, which the diagnosis uses too: what is tested here is what is concluded from
// the recordings, not the integrator (tests/effects does that against brute force), and not that real effects have
// these forms (the blind trial does that, on recordings of a simulator that shares no code).
#include <functional>
#include <random>

#include <bevel/diagnosis/needle/recorded_case.hpp>
#include "tests/effects/script.hpp"

namespace bevel::diagnosis::testing {

using model::testing::active;

// 7 to 9 s, 60 to 75 mm: turns both ways at several depths, two speeds, a rest, steady turning, retraction.
model::testing::Script script_of(int recording);

struct SimulatedRig {
  model::NeedleParameters needle = model::testing::agar();
  std::vector<model::ActiveEffect> effects{};
  // Effects whose values differ between recordings, after the others.
  std::function<std::vector<model::ActiveEffect>(int recording)> effects_in{};
  // Makes what the base truly did of what was logged: physics that is no Effect.
  std::function<void(std::vector<model::ActuatorState>&)> true_motion{};
  int recordings = 4;
  double frame_s = 1.0 / 15;
  Eigen::Vector3d sigma_mm{0.15, 0.15, 0.2};
  double ar1 = 0;
  double outlier_share = 0;  // thrown off by 20 sigma along a random direction
  double dropped_share = 0;
  double heading_sd_rad = 0;  // of the heading's two components across the needle; 0: none is measured
  int changed_from = -1;      // the first recording of the second group; -1: there is one group
  std::function<model::testing::Script(int recording)> script = script_of;
};

std::vector<RawRecording> record(const SimulatedRig& rig, std::uint64_t seed);
RecordedCase record_case(const SimulatedRig& rig, std::uint64_t seed);

// A stationary first-order process, sampled at these times: covariance sigma^2 ar1^(|dt|/frame_s).
Eigen::VectorXd coloured_noise(const std::vector<double>& time_s, double sigma, double ar1, double frame_s,
                               std::mt19937_64& random);

}  // namespace bevel::diagnosis::testing
