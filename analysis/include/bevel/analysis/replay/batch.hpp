// SPDX-License-Identifier: MIT
#pragma once
// Many logs in parallel, and the table over folders of recordings that share a rig.
#include <iosfwd>
#include <string>
#include <vector>

#include <bevel/analysis/replay/replay.hpp>

namespace bevel::analysis {

struct BatchOptions {
  std::string model_path;   // TOML model file
  std::string config_path;  // TOML of the estimator; empty: defaults
  std::string system_path;  // instead of both: the file of the rig, as the live estimator reads it
  std::string out_folder;   // empty: no files
  double ahead_mm = 20;
  bool bicycle = false;           // lambda = 0, held there: the plain bicycle
  bool held_out = false;          // k and lambda of each log's prior learned on the other logs
  double width = 0.3;             // of that prior, as a share of the prior's own standard deviations
  bool cases = false;             // each path is a folder of case folders with model.toml and logs
  bool without_headings = false;  // as if the logs had none
  std::vector<std::string> paths;
};

struct ReplaySetup {
  estimator::EstimatorConfig config;  // its effects are left to replay_logs
  // Of the model file.
  std::vector<io::EffectEntry> effects{};
  std::vector<model::DiscrepancyCurve> discrepancies{};
};
// From the options' model_path and config_path, or system_path. Throws io::ConfigError.
ReplaySetup load_setup(const BatchOptions& options);

// The replays in the order of `logs`, on as many threads as the machine has; one configuration for each log, or for
// all.
std::vector<Replay> replay_logs(const std::vector<std::string>& logs,
                                const std::vector<estimator::EstimatorConfig>& configs,
                                const ReplayOptions& options = {});
std::vector<Replay> replay_logs(const std::vector<std::string>& logs, const estimator::EstimatorConfig& config,
                                const ReplayOptions& options = {});

// Says on `err` what is damaged. Returns the exit status so far: 3 if anything is, else 0.
int tell_damage(const std::vector<Replay>& replays, std::ostream& err);

// Prints, writes, and returns the exit status. Damage and speed go to `err`, so that the output of the same logs is the
// same bytes.
int run(const BatchOptions& options, std::ostream& out, std::ostream& err);

// For each case: the camera's noise measured without the model, innovations under that noise, and whether they are
// what a complete model would leave.
int run_cases(const BatchOptions& options, std::ostream& out, std::ostream& err);

}  // namespace bevel::analysis
