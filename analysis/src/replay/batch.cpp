// SPDX-License-Identifier: MIT
#include <bevel/analysis/replay/batch.hpp>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <ostream>
#include <thread>

#include <bevel/analysis/replay/held_out.hpp>
#include <bevel/analysis/replay/report.hpp>
#include <bevel/cli/exit_status.hpp>
#include <bevel/error.hpp>
#include <bevel/io/estimator_config.hpp>
#include <bevel/io/file_bytes.hpp>
#include <bevel/io/find_logs.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/nodes/system_config.hpp>

namespace bevel::analysis {

ReplaySetup load_setup(const BatchOptions& options) {
  ReplaySetup setup;
  if (!options.system_path.empty()) {
    const nodes::SystemConfig system = nodes::load_system_config(options.system_path);
    setup = {system.estimator, system.effects, system.discrepancies};
    // As live: what differs from recording to recording was not known then.
    std::erase_if(setup.effects, [](const io::EffectEntry& effect) { return !io::unknown_beforehand(effect).empty(); });
  } else {
    if (!options.config_path.empty()) {
      io::ConfigFile file = io::ConfigFile::load(options.config_path);
      io::read_estimator_config(file.root(), setup.config);
      file.finish();
    }
    const io::ModelFile model = io::load_model_file(options.model_path);
    setup.config.prior.needle = model.needle;
    setup.config.prior.variation = model.variation.value_or(model::Variation{});
    setup.effects = model.effects;
    setup.discrepancies = model.discrepancies;
  }
  if (options.bicycle) {
    estimator::Prior& prior = setup.config.prior;
    prior.needle.lambda1_per_rad = prior.needle.lambda2 = 0;
    prior.lambda1_sd_per_rad = prior.lambda2_sd = 0;
  }
  return setup;
}

std::vector<Replay> replay_logs(const std::vector<std::string>& logs,
                                const std::vector<estimator::EstimatorConfig>& configs, const ReplayOptions& options) {
  std::vector<Replay> replays(logs.size());
  const auto names = io::result_names(logs);
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    for (std::size_t i = next++; i < logs.size(); i = next++) {
      try {
        const io::FileBytes file(logs[i]);
        estimator::EstimatorConfig own = configs.at(i);
        own.effects = io::active_effects(options.effects, options.discrepancies, logs[i]);
        replays[i] = replay_log(file.bytes(), names[i], own, options);
        if (!file.change().empty()) replays[i].remarks += replays[i].name + ": damaged: " + file.change() + "\n";
        if (!(options.ahead_mm > 0)) continue;
        replays[i].next = predict(replays[i], 1e-6);
        replays[i].ahead = predict(replays[i], options.ahead_mm);
      } catch (...) {
        const std::lock_guard lock(failure_mutex);
        failure = std::current_exception();
      }
    }
  };
  const std::size_t count = std::min<std::size_t>(logs.size(), std::max(1U, std::thread::hardware_concurrency()));
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < count; ++i) threads.emplace_back(work);
  threads.clear();
  if (failure) std::rethrow_exception(failure);
  return replays;
}

std::vector<Replay> replay_logs(const std::vector<std::string>& logs, const estimator::EstimatorConfig& config,
                                const ReplayOptions& options) {
  return replay_logs(logs, std::vector(logs.size(), config), options);
}

int tell_damage(const std::vector<Replay>& replays, std::ostream& err) {
  int status = cli::kOk;
  for (const Replay& replay : replays) {
    err << replay.order_note << replay.remarks;
    if (!replay.remarks.empty()) status = cli::kDamagedInput;
  }
  return status;
}

int run(const BatchOptions& options, std::ostream& out, std::ostream& err) {
  const ReplaySetup setup = load_setup(options);
  const auto logs = io::find_logs(options.paths);
  if (options.held_out && logs.size() < 2)
    throw ConfigurationError("there is one log; to learn on the others takes at least two");
  ReplayOptions replay_options;
  replay_options.effects = setup.effects;
  replay_options.discrepancies = setup.discrepancies;
  replay_options.use_headings = !options.without_headings;
  replay_options.rates_of_log = options.system_path.empty();  // a model file does not give the rig's
  std::vector<estimator::EstimatorConfig> configs(logs.size(), setup.config);
  if (options.held_out) configs = held_out_configs(replay_logs(logs, configs, replay_options), options.width);
  replay_options.ahead_mm = options.ahead_mm;
  const auto replays = replay_logs(logs, configs, replay_options);
  const int status = tell_damage(replays, err);
  for (const Replay& replay : replays) {
    print(out, replay, options.ahead_mm);
    if (!options.out_folder.empty()) write_files(replay, options.out_folder, options.ahead_mm);
  }
  if (replays.size() > 1) print_together(out, replays, options.ahead_mm);
  print_speed(err, replays);
  return status;
}

}  // namespace bevel::analysis
