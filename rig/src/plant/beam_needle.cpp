// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <bevel/rig/plant/plant.hpp>

namespace bevel::rig {
namespace {

constexpr double kStep_mm = 0.5, kStep_rad = 0.02, kStep_s = 0.005;
constexpr double kShaftSpacing_mm = 1.0;

model::BeamPlantConfig of_insertion(model::BeamPlantConfig config, const model::OwnValues& own) {
  config.bevel_force_N *= 1 + own.curvature_relative;
  return config;
}

}  // namespace

model::NeedleParameters bicycle_of(const model::BeamPlantConfig& config) {
  const double modulus_N_mm2 = 1e-3 * config.foundation_modulus_kPa;
  const double lambda_per_mm = std::pow(modulus_N_mm2 / (4 * config.bending_stiffness_N_mm2), 0.25);
  model::NeedleParameters needle;
  needle.curvature_per_mm = config.bevel_force_N / (config.bending_stiffness_N_mm2 * lambda_per_mm);
  needle.lambda1_per_rad = needle.lambda2 = 0;
  return needle;
}

BeamNeedle::BeamNeedle(const model::BeamPlantConfig& config, std::vector<model::ActiveEffect> effects, double roll_rad,
                       const model::OwnValues& own)
    : beam_(of_insertion(config, own)),
      room_mm_(config.max_depth_mm),
      needle_(bicycle_of(of_insertion(config, own)), std::move(effects)),
      entry_(model::of_insertion(model::Pose{}, own)) {
  entry_.R = entry_.R * model::exp_so3({0, 0, roll_rad});
  solve();
}

void BeamNeedle::advance(double insertion_mm, double rotation_rad, double dt_s) {
  due_insertion_mm_ += insertion_mm, due_rotation_rad_ += rotation_rad, due_s_ += dt_s;
  if (std::abs(due_insertion_mm_) >= kStep_mm || std::abs(due_rotation_rad_) >= kStep_rad || due_s_ >= kStep_s) solve();
}

void BeamNeedle::solve() {
  const double room_mm = room_mm_ - beam_.fed_mm();
  beam_.advance(std::min(due_insertion_mm_, room_mm), due_rotation_rad_, due_s_);
  due_insertion_mm_ = due_rotation_rad_ = due_s_ = 0;
  tip_ = {entry_.R * beam_.tip_rotation(), entry_.p_mm + entry_.R * beam_.tip_position_mm()};
}

std::vector<Eigen::Vector3d> BeamNeedle::shaft_mm() const {
  const double length_mm = std::max(beam_.tip_position_mm().z(), 0.0);
  auto drawn_mm = beam_.shaft_polyline_mm(2 + static_cast<std::size_t>(length_mm / kShaftSpacing_mm));
  for (Eigen::Vector3d& p : drawn_mm) p = entry_.p_mm + entry_.R * p;
  return drawn_mm;
}

}  // namespace bevel::rig
