// SPDX-License-Identifier: MIT
#include <bevel/io/estimator_config.hpp>

#include <cmath>
#include <string>
#include <vector>

namespace bevel::io {

void read_estimator_config(Section section, estimator::EstimatorConfig& config) {
  Section prior = section.section("prior", optional);
  prior.read("curvature_sd_per_mm", config.prior.curvature_sd_per_mm, optional, in_range(0, 0.05));
  prior.read("lambda1_sd_per_rad", config.prior.lambda1_sd_per_rad, optional, in_range(0, 5));
  prior.read("lambda2_sd", config.prior.lambda2_sd, optional, in_range(0, 1));
  prior.read("wheelbase_sd_mm", config.prior.wheelbase_sd_mm, optional, in_range(0, 200));
  prior.read("bending_mm", config.prior.bending_mm, optional, in_range(0, 200));
  prior.read("bending_sd_mm", config.prior.bending_sd_mm, optional, in_range(0, 100));
  prior.read("guide_mm", config.prior.guide_mm, optional, in_range(0, 500));
  prior.read("bevel_mm", config.prior.bevel_mm, optional, in_range(0.1, 20));
  if (config.prior.bending_mm > 0 && config.prior.bending_mm < 5)
    prior.fail("bending_mm", "is " + std::to_string(config.prior.bending_mm) + "; allowed: 0, or 5 to 200");
  if (config.prior.bending_mm > 0 && config.prior.wheelbase_sd_mm > 0)
    prior.fail("bending_mm", "is estimated as the tenth state, and so is ell by wheelbase_sd_mm; one or the other");
  prior.read("position_sd_mm", config.prior.position_sd_mm, optional, in_range(1e-4, 100));
  prior.read("tilt_sd_rad", config.prior.tilt_sd_rad, optional, in_range(1e-5, 1));
  prior.read("roll_sd_rad", config.prior.roll_sd_rad, optional, in_range(1e-5, 3.2));

  Section process = section.section("process_noise", optional);
  process.read("position_mm", config.process.position_mm, optional, in_range(0, 10));
  process.read("tilt_rad", config.process.tilt_rad, optional, in_range(0, 1));
  process.read("roll_rad", config.process.roll_rad, optional, in_range(0, 1));
  process.read("roll_per_sqrt_rad", config.process.roll_per_sqrt_rad, optional, in_range(0, 1));
  process.read("curvature_per_mm", config.process.curvature_per_mm, optional, in_range(0, 0.01));
  process.read("lambda1_per_rad", config.process.lambda1_per_rad, optional, in_range(0, 1));
  process.read("lambda2", config.process.lambda2, optional, in_range(0, 1));

  Section reading = section.section("reading_noise", optional);
  estimator::ReadingNoise& noise = config.reading;
  reading.read("correlated_share", noise.correlated_share, optional,
               in_range(0, 0.99).because("the covariance stays regular by what is white"));
  reading.read("correlation_s", noise.correlation_s, optional, in_range(0, 1000));
  reading.read("correlation_mm", noise.correlation_mm, optional, in_range(0, 1000));
  reading.read("correlation_rad", noise.correlation_rad, optional, in_range(0, 1000));
  if (noise.correlated_share > 0 && noise.correlation_s + noise.correlation_mm + noise.correlation_rad == 0)
    reading.fail("correlated_share",
                 "is above 0, and nothing says how it is forgotten; allowed: with correlation_s, "
                 "correlation_mm or correlation_rad above 0");

  Section nuisance = section.section("nuisance", optional);
  nuisance.read("windup_sd_rad", config.nuisance.windup_sd_rad, optional, in_range(0, 2));
  nuisance.read("latency_sd_s", config.nuisance.latency_sd_s, optional, in_range(0, 0.1));

  Section gate = section.section("gate", optional);
  gate.read("probability", config.gate.probability, optional, in_range(0.5, 0.9999999));
  gate.read("rejects_before_unsure", config.gate.rejects_before_unsure, optional, in_range(1, 20));
  gate.read("rejects_before_unhealthy", config.gate.rejects_before_unhealthy, optional, in_range(1, 20));
  gate.read("rejects_before_reset", config.gate.rejects_before_reset, optional, in_range(1, 10000));
  gate.read("reset_position_sd_mm", config.gate.reset_position_sd_mm, optional, in_range(0.01, 1000));
  gate.read("reset_tilt_sd_rad", config.gate.reset_tilt_sd_rad, optional, in_range(1e-4, 3));

  std::vector<double> shaft_cameras(config.shaft_cameras.begin(), config.shaft_cameras.end());
  section.read("shaft_cameras", shaft_cameras, optional, in_range(0, 15));
  config.shaft_cameras.clear();
  for (const double camera : shaft_cameras) {
    if (camera != std::floor(camera))
      section.fail("shaft_cameras", "has " + std::to_string(camera) + "; allowed: whole numbers, as in TIP_HEADING");
    config.shaft_cameras.push_back(static_cast<int>(camera));
  }

  section.read("entry_slope_sd_rad", config.entry_slope_sd_rad, optional, in_range(1e-4, 1));
  section.read("through_channel", config.through_channel, optional);
  section.read("relinearised_steps", config.relinearised_steps, optional, in_range(0, 100000));

  Section limits = section.section("limits", optional);
  constexpr const char* kStop = "the needle must rest within 200 ms of a fault";
  limits.read("measurement_age_s", config.limits.measurement_age_s, optional, in_range(0.02, 0.15).because(kStop));
  limits.read("measurement_silence_s", config.limits.measurement_silence_s, optional,
              in_range(0.02, 0.12).because(kStop));
  limits.read("actuator_age_s", config.limits.actuator_age_s, optional, in_range(0.01, 0.12).because(kStop));
  limits.read("position_sd_mm", config.limits.position_sd_mm, optional, in_range(0.05, 10));
  limits.read("heading_sd_rad", config.limits.heading_sd_rad, optional,
              in_range(0.02, 0.5).because("three standard deviations stay below pi/2, the slip law's limit"));
}

}  // namespace bevel::io
