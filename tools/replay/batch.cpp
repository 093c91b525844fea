#include "tools/replay/batch.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <filesystem>
#include <mutex>
#include <ostream>
#include <stdexcept>
#include <thread>

#include "io/estimator_config.hpp"
#include "io/model_file.hpp"
#include "tools/replay/report.hpp"

namespace bevel::replay {

namespace fs = std::filesystem;

std::vector<std::string> find_logs(const std::vector<std::string>& paths) {
  std::vector<std::string> logs;
  for (const std::string& path : paths) {
    if (!fs::is_directory(path)) {
      if (!fs::exists(path)) throw std::runtime_error(path + ": no such log");
      logs.push_back(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path))
      if (entry.path().extension() == ".lcm") inside.push_back(entry.path().string());
    if (inside.empty()) throw std::runtime_error(path + ": holds no file that ends in .lcm");
    std::sort(inside.begin(), inside.end());
    logs.insert(logs.end(), inside.begin(), inside.end());
  }
  return logs;
}

estimator::EstimatorConfig load_config(const std::string& model_path, const std::string& config_path, bool bicycle) {
  estimator::EstimatorConfig config;
  if (!config_path.empty()) {
    io::ConfigFile file = io::ConfigFile::load(config_path);
    io::read_estimator_config(file.root(), config);
    file.finish();
  }
  const io::ModelFile model = io::load_model_file(model_path);
  config.prior.needle = model.needle;
  if (bicycle) {
    config.prior.needle.lambda1_per_rad = config.prior.needle.lambda2 = 0;
    config.prior.lambda1_sd_per_rad = config.prior.lambda2_sd = 0;
  }
  return config;
}

std::vector<Replay> replay_logs(const std::vector<std::string>& logs, const estimator::EstimatorConfig& config,
                                const ReplayOptions& options) {
  std::vector<Replay> replays(logs.size());
  // Logs of one name in several folders are told apart by the folder.
  const auto name_of = [&logs](const fs::path& log) {
    const auto same = std::count_if(logs.begin(), logs.end(),
                                    [&log](const std::string& other) { return fs::path(other).stem() == log.stem(); });
    const std::string stem = log.stem().string();
    return same == 1 ? stem : log.parent_path().filename().string() + "_" + stem;
  };
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    for (std::size_t i = next++; i < logs.size(); i = next++) {
      try {
        const io::MappedFile file(logs[i]);
        estimator::EstimatorConfig own = config;
        own.effects = io::active_effects(options.effects, logs[i]);
        replays[i] = replay_log(file.bytes(), name_of(logs[i]), own, options);
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

int run(const BatchOptions& options, std::ostream& out, std::ostream& speed) {
  ReplayOptions with_effects;
  with_effects.effects = io::load_model_file(options.model_path).effects;
  const auto replays = replay_logs(find_logs(options.paths),
                                   load_config(options.model_path, options.config_path, options.bicycle), with_effects);
  bool intact = true;
  for (const Replay& replay : replays) {
    print(out, replay, options.ahead_mm);
    if (!options.out_folder.empty()) write_files(replay, options.out_folder);
    intact = intact && replay.damage.intact() && replay.refused_messages == 0;
  }
  print_speed(speed, replays);
  return intact ? 0 : 1;
}

}  // namespace bevel::replay
