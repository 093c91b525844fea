// SPDX-License-Identifier: MIT
// A case as a lab would hand it over, made with the simulated rig: a folder of a model file without the effect, and
// recordings of motions that excite it.
#pragma once

#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/rig/plant/plant.hpp>
#include "tests/effects/script.hpp"

namespace bevel::analysis::testing {

constexpr double kSigma_mm = 0.1;
constexpr std::uint64_t kSeed = 17;

// 100 mm deep, with turns both ways at several depths.
inline model::testing::Script script_of(int recording) {
  const double turn = 1.6 + 0.5 * recording;
  return {{1.5, 10, 0.3},       {0.5, 0, turn}, {1.5, 10, 0},  {0.5, 8, -turn}, {1.0, 10, 0},
          {0.6, 0, 1.3 * turn}, {1.2, 10, 0},   {0.8, 0, 0},   {1.3, 12, 0},    {0.6, 5, -turn},
          {1.4, 10, 0},         {0.5, 0, turn}, {1.5, 9, -0.5}};
}

// Motion at 100 Hz through the plant, a picture every 33 ms.
inline void record(const std::filesystem::path& log_path, int recording, const io::ModelFile& truth) {
  io::LogWriter log(log_path.string());
  rig::KinematicPlant plant(truth.needle, io::active_effects(truth, log_path.string()));
  std::mt19937_64 random(kSeed + static_cast<std::uint64_t>(recording));
  std::normal_distribution<double> noise(0, kSigma_mm);
  model::ActuatorState before;
  std::int64_t frame = 0;
  for (const model::ActuatorState& axes : script_of(recording).actuators(0.01)) {
    if (axes.seq > 0)
      plant.advance(axes.insertion_mm - before.insertion_mm, axes.rotation_rad - before.rotation_rad, 0.01);
    before = axes;
    log.write_message(axes.utime, io::channel::kActuatorState, io::to_message(axes));
    if (axes.seq % 3 != 0) continue;
    model::TipReading reading{plant.tip().p_mm, model::PointColumns(3, 0)};
    plant.model().through_cameras(reading);
    model::TipMeasurement tip;
    tip.utime = axes.utime;
    tip.seq = frame++;
    tip.position_mm = reading.position_mm + Eigen::Vector3d(noise(random), noise(random), noise(random));
    tip.information_per_mm2.diagonal().setConstant(1 / (kSigma_mm * kSigma_mm));
    log.write_message(tip.utime, io::channel::kTipMeasurement, io::to_message(tip));
  }
  log.close();
}

inline void make_case(const std::filesystem::path& folder, const io::ModelFile& truth) {
  std::filesystem::create_directories(folder);
  io::ModelFile believed{truth.needle, {}};
  believed.needle.curvature_per_mm *= 1.06;
  io::save_model_file(believed, (folder / "model.toml").string());
  for (int r = 0; r < 4; ++r) record(folder / ("rec0" + std::to_string(r + 1) + ".lcm"), r, truth);
}

}  // namespace bevel::analysis::testing
