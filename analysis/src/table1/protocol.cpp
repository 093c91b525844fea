// SPDX-License-Identifier: MIT
#include <bevel/analysis/table1/protocol.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include <bevel/diagnosis/identification/candidates.hpp>
#include <bevel/error.hpp>
#include <bevel/rig/plant/plant.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)

const std::vector<PaperRow>& paper_rows() {
  static const std::vector<PaperRow> rows = {{"agar", 20, 0.49, 0.22, 0.66, 3.79},
                                             {"agar", 60, 0.49, 0.22, 0.33, 3.49},
                                             {"plastisol", 20, 0.144, 0.032, 0.43, 1.46},
                                             {"plastisol", 40, 0.144, 0.032, 0.63, 0.76}};
  return rows;
}

TissuePath kinematic_path(const std::string& tissue, const model::NeedleParameters& needle) {
  TissuePath path{tissue, {Eigen::Vector3d::Zero()}, {}};
  rig::KinematicPlant plant(needle);
  while (path.tip_mm.back().z() < kDepth_mm && path.tip_mm.size() < 4000) {
    plant.advance(kPathSpacing_mm, 0, 0);
    path.tip_mm.push_back(plant.tip().p_mm);
  }
  char text[120];
  std::snprintf(text, sizeof text, "kinematic plant, lambda1 %.3f, lambda2 %.3f, k %.4f /mm, ell %.0f mm",
                needle.lambda1_per_rad, needle.lambda2, needle.curvature_per_mm, needle.wheelbase_mm);
  path.description = text;
  return path;
}

TissuePath beam_path(const std::string& tissue, double modulus_kPa, double force_N) {
  TissuePath path{tissue, {Eigen::Vector3d::Zero()}, {}};
  model::BeamPlantConfig config;
  config.foundation_modulus_kPa = modulus_kPa;
  config.bevel_force_N = force_N;
  model::BeamPlant plant(config);
  while (path.tip_mm.back().z() < kDepth_mm && path.tip_mm.size() < 780) {
    plant.advance(kPathSpacing_mm, 0, 0);
    path.tip_mm.push_back(plant.tip_position_mm());
  }
  char text[120];
  std::snprintf(text, sizeof text, "beam plant, %.0f kPa, bevel force %.2f N, deflection %.1f mm", modulus_kPa, force_N,
                -path.tip_mm.back().y());
  path.description = text;
  return path;
}

Insertion record(const TissuePath& path, double speed_mm_s, std::uint64_t seed, double sigma_mm) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss(0, sigma_mm);
  std::vector<model::ActuatorState> actuators(2);
  const double length_mm = kPathSpacing_mm * static_cast<double>(path.tip_mm.size() - 1);
  const auto utime = [](double t_s) { return 1'000'000 + std::llround(1e6 * t_s); };
  actuators[0].utime = utime(0);
  actuators[1].utime = utime(length_mm / speed_mm_s);
  actuators[1].insertion_mm = length_mm;
  std::vector<model::TipMeasurement> tips;
  for (int i = 1; i / kFrameRate_Hz * speed_mm_s < length_mm; ++i) {
    const double place = i / kFrameRate_Hz * speed_mm_s / kPathSpacing_mm;
    const auto k = static_cast<std::size_t>(place);
    const double t = place - static_cast<double>(k);
    model::TipMeasurement m;
    m.utime = utime(i / kFrameRate_Hz);
    m.position_mm = (1 - t) * path.tip_mm[k] + t * path.tip_mm[k + 1];
    m.position_mm.y() += gauss(random);
    m.position_mm.z() += gauss(random);
    m.information_per_mm2 = Eigen::Vector3d(0, 1, 1).asDiagonal().toDenseMatrix() / (kCameraSigma_mm * kCameraSigma_mm);
    tips.push_back(m);
  }
  return make_insertion(path.tissue, actuators, tips);
}

model::NeedleParameters best_circle(const Insertion& insertion) {
  model::NeedleParameters circle;
  const auto squares = [&](double k) {
    circle.curvature_per_mm = k;
    double sum = 0;
    for (const double e : path_errors_mm(insertion, circle, Compare::same_depth)) sum += std::isnan(e) ? 1e6 : e * e;
    return sum;
  };
  double low = 0;
  double high = 0.007;  // the circle has to reach 130 mm of depth
  while (high - low > 1e-8) {
    const double third = (high - low) / 3;
    (squares(low + third) < squares(high - third) ? high : low) =
        squares(low + third) < squares(high - third) ? high - third : low + third;
  }
  circle.curvature_per_mm = low;
  return circle;
}

double largest_circle_error_mm(const TissuePath& path) {
  const Insertion clean = record(path, 20, 1, 0);
  return error_figures({clean}, best_circle(clean), Compare::same_depth).largest_mm;
}

double force_for_error_N(double modulus_kPa, double wanted_mm, double limit_N) {
  // The error grows with the force: bisection.
  double low = 0.05;
  double high = limit_N;
  for (int i = 0; i < 14; ++i) {
    const double middle = 0.5 * (low + high);
    (largest_circle_error_mm(beam_path("", modulus_kPa, middle)) < wanted_mm ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Tissue identify_tissue(const TissuePath& path, std::uint64_t seed) {
  Tissue tissue;
  tissue.path = path;
  std::vector<Insertion> all;
  std::vector<std::vector<Insertion>> by_speed;
  for (const auto& row : paper_rows()) {
    if (row.tissue != path.tissue) continue;
    by_speed.emplace_back();
    for (int trial = 0; trial < 3; ++trial) by_speed.back().push_back(record(path, row.speed_mm_s, seed++));
    all.insert(all.end(), by_speed.back().begin(), by_speed.back().end());
    tissue.rows.push_back({row.speed_mm_s, mean_of_trials(by_speed.back()), {}, {}, 0, 0, 0, 0});
  }
  FitOptions options;
  options.start.lambda1_per_rad = 0.3;
  options.start.lambda2 = 0.1;
  tissue.fit = fit_from_many_starts(all, options);
  tissue.angle_rate = fit_angle_rate(all, options.start);
  tissue.angle_rate_k = fit_angle_rate(all, options.start, true);
  FitOptions tilted = options;
  tilted.entry_sigma(kEntryTiltX) = 0.3;
  tissue.tilted_bicycle = fit_trajectory(all, bicycle_options(tilted));
  tissue.tilted_error =
      error_figures(all, tissue.tilted_bicycle.needle, Compare::same_depth, tissue.tilted_bicycle.entries);
  for (TissueRow& row : tissue.rows) {
    row.extended = tissue.fit.needle;
    row.circle = best_circle(row.mean);
    row.largest_extended_mm = error_figures({row.mean}, row.extended, Compare::same_depth).largest_mm;
    row.largest_bicycle_mm = error_figures({row.mean}, row.circle, Compare::same_depth).largest_mm;
    const auto largest_mm = [&](const AngleRateResult& rate) {
      try {
        return error_figures({row.mean}, rate.needle, Compare::same_depth).largest_mm;
      } catch (const DomainError&) {
        return std::nan("");
      }
    };
    row.largest_angle_rate_mm = largest_mm(tissue.angle_rate);
    row.largest_angle_rate_k_mm = largest_mm(tissue.angle_rate_k);
  }
  return tissue;
}

}  // namespace bevel::analysis
