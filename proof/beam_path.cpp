// SPDX-License-Identifier: MIT
#include "proof/beam_path.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <optional>

#include "proof/bounded_fit.hpp"

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

Views views_of(const Setting& setting, const model::BeamPlantConfig& config) {
  Views views;
  for (std::size_t i = 0; i < setting.motions.size(); ++i) {
    const InsertionVariation own = setting.variation.empty() ? InsertionVariation{} : setting.variation[i];
    model::BeamPlantConfig here = config;
    here.bevel_force_N *= 1.0 + own.curvature_share;
    const Eigen::Matrix3d turned = (Eigen::AngleAxisd(own.about_y_rad, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(own.about_x_rad, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(own.roll_rad, Eigen::Vector3d::UnitZ()))
                                       .toRotationMatrix();
    Eigen::Matrix3Xd path = view(travel_beam(here, setting.motions[i]), setting.frames[i].times_s, {});
    path = turned * path;
    path.colwise() += Eigen::Vector3d(own.entry_x_mm, own.entry_y_mm, 0);
    views.push_back(std::move(path));
  }
  return views;
}

std::map<std::string, double> swing_of(const model::BeamPlantConfig& config) {
  const double modulus_N_per_mm2 = 1e-3 * config.foundation_modulus_kPa;
  return {{"bending_mm", std::pow(4 * config.bending_stiffness_N_mm2 / modulus_N_per_mm2, 0.25)},
          {"guide_mm", config.guide_gap_mm}};
}

ElasticFit nearest_elastic(const Setting& setting, const Views& seen, const model::BeamPlantConfig& start) {
  const auto beam_at = [&](const Eigen::VectorXd& x) {
    model::BeamPlantConfig beam = start;
    beam.relaxing_fraction = 0;
    beam.foundation_modulus_kPa = std::exp(x(0));
    beam.bevel_force_N = x(1);
    beam.guide_gap_mm = x(2);
    return beam;
  };
  BoundedProblem problem{[&](const Eigen::VectorXd& x) -> std::optional<Eigen::VectorXd> {
                           return whitened_difference(setting, seen, views_of(setting, beam_at(x)));
                         },
                         Eigen::Vector3d(std::log(0.5), 0.1, 0), Eigen::Vector3d(std::log(50), 3, 40),
                         Eigen::Vector3d(1e-3, 1e-3, 1e-2)};
  const Eigen::Vector3d from(std::log(start.foundation_modulus_kPa * (1 - 0.5 * start.relaxing_fraction)),
                             start.bevel_force_N, start.guide_gap_mm);
  const BoundedFit fit = fit_in_box(problem, from, 15, std::numeric_limits<double>::infinity());
  return {beam_at(fit.point), fit.norm};
}

}  // namespace bevel::proof
