// SPDX-License-Identifier: MIT
// Logs as a rig writes them, with or without a concealed effect.
#pragma once

#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>
#include "tests/effects/script.hpp"

namespace bevel::diagnosis::testing {

inline model::testing::Script script_of(int recording) {
  const double turn = 2.0 + 0.4 * recording;
  return {{1.0, 10, 0.4}, {0.4, 10, turn}, {1.6, 8, 0},  {0.6, 0, -turn},     {2.0, 12, 0}, {0.3, 6, turn},
          {0.9, 6, 0},    {1.5, 0, 0},     {1.2, 10, 0}, {0.5, 9, -2 * turn}, {1.6, 10, 0}, {0.5, -10, 0}};
}

struct LogContents {
  int script = 0;
  std::vector<model::ActiveEffect> effects{};
  double sigma_mm = 0.15;
  bool tips = true, states = true;
  double camera_ahead_s = 0;           // its clock against that of the axes
  double states_missing_from_s = 1e9;  // for two seconds
  double state_period_s = 0;           // shortest interval between axis samples that are written
  Eigen::Vector3d information_per_mm2 = Eigen::Vector3d::Constant(1 / (0.15 * 0.15));
};

inline void write_log(const std::filesystem::path& path, const LogContents& contents) {
  io::LogWriter log(path.string());
  const auto script = script_of(contents.script);
  std::mt19937_64 random(static_cast<std::uint64_t>(contents.script) + 11);
  std::normal_distribution<double> normal(0, contents.sigma_mm);
  double next_state_s = 0;
  for (const auto& a : script.actuators(0.02)) {
    const double time_s = static_cast<double>(a.seq) * 0.02;
    const bool missing = (time_s > contents.states_missing_from_s && time_s < contents.states_missing_from_s + 2) ||
                         time_s < next_state_s;
    if (!missing) next_state_s = time_s + contents.state_period_s - 1e-6;
    if (contents.states && !missing) log.write_message(a.utime, io::channel::kActuatorState, io::to_message(a));
  }
  const model::Motion motion = script.recorded();
  const auto path_mm = model::testing::path_of(model::testing::agar(), contents.effects, motion);
  for (std::size_t i = 0; contents.tips && i < path_mm.size(); ++i) {
    model::TipMeasurement tip;
    tip.seq = static_cast<std::int64_t>(i);
    tip.utime =
        1'700'000'000'000'000 + std::llround((motion.nodes[motion.at[i]].time_s + contents.camera_ahead_s) * 1e6);
    tip.position_mm = path_mm[i] + Eigen::Vector3d(normal(random), normal(random), normal(random));
    tip.information_per_mm2 = contents.information_per_mm2.asDiagonal();
    log.write_message(tip.utime, io::channel::kTipMeasurement, io::to_message(tip));
  }
  log.close();
}

}  // namespace bevel::diagnosis::testing
