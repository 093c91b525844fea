#include "proof/beam_path.hpp"

namespace bevel::proof {

model::BeamPlantConfig draw_beam(Random& random) {
  model::BeamPlantConfig config;
  config.foundation_modulus_kPa = random.log_uniform(3, 20);
  config.bevel_force_N = random.uniform(0.7, 1.2);
  config.relaxing_fraction = random.chance(0.5) ? random.uniform(0.1, 0.4) : 0.0;
  config.relaxation_time_s = random.uniform(1, 6);
  config.guide_gap_mm = random.uniform(0.5, 10);
  config.max_depth_mm = 120;
  return config;
}

TipPath travel_beam(const model::BeamPlantConfig& config, const AxisMotion& motion) {
  constexpr std::size_t kStride = 5;  // the beam is solved every 5 ms, the tip is straight in between
  model::BeamPlant plant(config);
  TipPath path{plant.tip_position_mm()};
  path.reserve(motion.size());
  for (std::size_t from = 0; from + 1 < motion.size(); from += kStride) {
    const std::size_t to = std::min(from + kStride, motion.size() - 1);
    const Eigen::Vector3d before = plant.tip_position_mm();
    plant.advance(motion.insertion_mm[to] - motion.insertion_mm[from],
                  motion.rotation_rad[to] - motion.rotation_rad[from], kStep_s * static_cast<double>(to - from));
    const Eigen::Vector3d after = plant.tip_position_mm();
    for (std::size_t i = from + 1; i <= to; ++i)
      path.emplace_back(before + (after - before) * static_cast<double>(i - from) / static_cast<double>(to - from));
  }
  return path;
}

}  // namespace bevel::proof
