// SPDX-License-Identifier: MIT
#pragma once
// What a recorded run of the loop shows: errors, parameters, rates, latencies. From the log alone.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include <bevel/io/recording.hpp>

namespace bevel::tools {

struct Percentiles {
  double p50 = 0;
  double p99 = 0;
  std::size_t count = 0;
};
Percentiles percentiles(std::vector<double> values);

struct LoopFigures {
  Eigen::Vector3d target_mm = Eigen::Vector3d::Zero();
  double targeting_error_mm = 0;      // true tip to target at the end
  std::string outcome;                // that the controller reported at depth; empty if none
  double estimator_error_end_mm = 0;  // estimate to true tip at the end
  double estimator_error_rms_mm = 0;  // over the run, at the estimates' own times
  double estimator_error_max_mm = 0;
  double curvature_per_mm = 0, curvature_sd_per_mm = 0;
  double lambda1_per_rad = 0, lambda1_sd_per_rad = 0;
  double lambda2 = 0, lambda2_sd = 0;
  std::optional<needle_state_t> truth;  // the newest: the parameters of the simulated needle
  double inserted_mm = 0, turned_rev = 0;
  double command_rate_hz = 0, estimate_rate_hz = 0, measurement_rate_hz = 0;
  Percentiles command_period_ms;
  Percentiles camera_to_measurement_ms;  // capture to arrival of TIP_MEASUREMENT
  // In motion: capture to arrival of the first command made after an estimate that used it, and of that what is not the
  // camera's, from the newest measurement it used on.
  Percentiles camera_to_command_ms, measurement_to_command_ms;
  std::int64_t measurements = 0, measurements_unusable = 0, rejected_messages = 0;
};

// Throws IoError naming what the log lacks.
LoopFigures loop_figures(const std::string& log_path);
std::string to_text(const LoopFigures& figures);
// A self-contained page: paths with target and uncertainty, errors over time, commands.
void write_loop_report(const std::string& log_path, const LoopFigures& figures, double tolerance_mm,
                       const std::string& html_path);

}  // namespace bevel::tools
