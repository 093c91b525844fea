// SPDX-License-Identifier: MIT
#pragma once
// One log through the estimator: the same NeedleEstimator that runs live, fed in the log's order of arrival.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <bevel/analysis/replay/kept_state.hpp>
#include <bevel/analysis/replay/statistics.hpp>
#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/io/log_reader.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::analysis {

// The estimate at one actuator state.
struct StateRow {
  std::int64_t utime = 0;
  double insertion_mm = 0;
  double rotation_rad = 0;
  KeptState state;
  double test_ratio = 0;
  std::int32_t health = 0;
};

// One reading when it was first applied.
struct AppliedRow {
  std::int64_t utime = 0;
  std::int64_t seq = 0;
  std::int32_t camera = 0;
  bool accepted = false;
  int rank = 0;
  double mahalanobis2 = 0;
};

// A position. Axes are those of {A}.
struct InnovationRow : AppliedRow {
  Eigen::Vector3d position_mm;         // as measured
  std::array<bool, 3> sees{};          // the camera has information along this axis
  Eigen::Vector3d innovation_mm;       // measured - predicted
  Eigen::Vector3d state_variance_mm2;  // of the predicted position
  Eigen::Vector3d noise_variance_mm2;  // of the measurement, by its information matrix
};

struct HeadingRow : AppliedRow {
  Eigen::Vector2d innovation_rad;  // along the axes seen, the best seen last
};

struct TruthFigures {
  std::int64_t count = 0;
  double position_rmse_mm = 0;
  double lateral_rmse_mm = 0;
  double tilt_rmse_rad = 0;
  double roll_rmse_rad = 0;
  double last_position_error_mm = 0;
  ChiSquareMean pose_nees;                 // 6 degrees each
  std::array<ChiSquareMean, 6> axis_nees;  // of each error of the pose on its own: x, y, along the needle, tilts, roll
};

// How well the filter predicts measurements that it has not seen yet: lateral (x, y) error in mm, each axis over the
// measurements that see it.
struct Predicted {
  std::array<std::int64_t, 2> count{};
  std::array<double, 2> squares_mm2{};

  void add(const Predicted& other);
  double lateral_rmse_mm() const;  // of both axes together; 0 if neither was seen
};

struct Replay {
  std::string name;
  std::vector<StateRow> states;
  std::vector<estimator::EffectState> effects;  // one for each of `states` where the model has effects, else empty
  std::vector<InnovationRow> innovations;
  std::vector<HeadingRow> headings;
  // The same log without its headings, at its newest actuator state; empty where there are none.
  std::optional<StateRow> without_headings;
  TruthFigures truth_without_headings;
  estimator::Counters counters;
  std::int64_t refused_messages = 0;  // by the checked decode
  io::LogDamage damage;
  std::string remarks;     // on damage of any kind, lines for stderr; "" if the log is intact
  std::string order_note;  // a line for stderr on events that were sorted by time; "" if there are none
  TruthFigures truth;      // count 0: the log has no NEEDLE_TRUTH
  double log_s = 0;        // newest minus oldest actuator state
  double run_s = 0;        // wall time of decoding and estimating
  double processor_s = 0;
  estimator::EstimatorConfig config;
  Predicted next;   // one measurement ahead; both by replay_logs, if asked
  Predicted ahead;  // ReplayOptions::ahead_mm ahead
};

// The whole state of a row, as the filter can go on from it.
estimator::FilterState filter_state(const Replay& replay, std::size_t row);

struct ReplayOptions {
  std::size_t history = 64;
  bool use_headings = true;  // false: as if the log had none
  double ahead_mm = 0;       // for replay_logs: 0, nothing is predicted
  // The rates that no axis exceeds in a gap: false, of the configuration; true, the fastest that the log has.
  bool rates_of_log = false;
  // Replaces each measurement's information by that of this noise, per axis; empty: as the camera says.
  std::vector<NoiseColour> noise_by_axis{};
  // Of the model file, for replay_logs: some effects are a recording's own.
  std::vector<io::EffectEntry> effects{};
  std::vector<model::DiscrepancyCurve> discrepancies{};
};

// Throws IoError, with the name, for a log that cannot be used: io::Recording::refusal(), or no
// ACTUATOR_STATE.
Replay replay_log(std::span<const std::uint8_t> log, const std::string& name, const estimator::EstimatorConfig& config,
                  const ReplayOptions& options = {});

// Of measurements at least `ahead_mm` further in, from the filter's state just after a measurement, by the model alone.
Predicted predict(const Replay& replay, double ahead_mm);

// Figures over the innovations of one or more replays.
struct InnovationFigures {
  ChiSquareMean nis;                  // d^2 per axis seen, accepted measurements
  std::array<ChiSquareMean, 3> axis;  // x, y, z on their own, standardised
  std::array<LjungBox, 3> whiteness;  // of one replay (the first)
  std::int64_t measurements = 0, rejected = 0, resets = 0;
  ChiSquareMean heading_nis;  // d^2 per axis seen, accepted headings
  std::int64_t headings = 0, headings_rejected = 0;
};
InnovationFigures innovation_figures(const Replay& replay);

// The innovations of accepted measurements along one axis, in order, and each axis's raw readings.
std::vector<Innovation> axis_innovations(const Replay& replay, int axis);
std::vector<AxisSample> axis_samples(const Replay& replay, int axis);

}  // namespace bevel::analysis
