// SPDX-License-Identifier: MIT
// Real processes, killed or stopped in flight, and how long until both axes rest, read from the drives' own frames on
// the bus. Usage: kill_study BIN_DIR CONFIG OUT_DIR BUS TRIALS SEED [PROGRAM SIGNAL], inside a network namespace of its
// own (tests/loop/processes_test.sh): PROGRAM (such as bevel-demo) and SIGNAL (KILL or STOP) of every trial, drawn
// where they are not given. Exit status 0 when every trial came to rest within 200 ms and stayed there. A stopped
// operator program (bevel-demo) is noticed after controller.operator_timeout_s; the 200 ms count from there, the
// printed times from the signal.
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <bevel/nodes/runtime.hpp>
#include <bevel/nodes/system_config.hpp>
#include "tests/loop/bus_listener.hpp"

extern char** environ;

namespace {

using namespace bevel;
using test::kMoving_unit_s, test::kMs;

pid_t spawn(std::vector<std::string> words, const std::string& log) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 1, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  pid_t pid = 0;
  if (posix_spawn(&pid, argv[0], &files, nullptr, argv.data(), environ) != 0) std::exit(2);
  posix_spawn_file_actions_destroy(&files);
  return pid;
}

// Children of `parent`, by the name of their program.
std::map<std::string, pid_t> children_of(pid_t parent) {
  std::map<std::string, pid_t> found;
  std::ifstream list("/proc/" + std::to_string(parent) + "/task/" + std::to_string(parent) + "/children");
  for (pid_t pid = 0; list >> pid;) {
    std::string name;
    std::getline(std::ifstream("/proc/" + std::to_string(pid) + "/comm"), name);
    found[name] = pid;
  }
  return found;
}

struct Trial {
  std::string what;
  double ms_to_rest = -1;
  std::string problem;
};

constexpr std::int64_t kHeartbeat_ns = 60 * kMs;  // the newest heartbeat may be a period of 50 ms and a bit old

struct Wanted {
  std::string program;  // empty: drawn
  int signal = 0;
};

Trial run_trial(const std::string& bin, const std::string& config_path, const std::string& out, const std::string& bus,
                const nodes::SystemConfig& system, const Wanted& wanted, std::mt19937_64& rng) {
  const stepper::StepperConfig& config = system.stepper;
  // The kernel keeps 15 characters of a name.
  static const std::array<const char*, 5> kTargets{"bevel-camera", "bevel-estimator", "bevel-controlle",
                                                   "bevel-stepper", "bevel-demo"};
  std::string target = kTargets.at(rng() % kTargets.size());
  int signal = rng() % 2 == 0 ? SIGKILL : SIGSTOP;
  if (!wanted.program.empty()) target = wanted.program.substr(0, 15), signal = wanted.signal;
  const double wait_s = std::uniform_real_distribution<double>(0.2, 4)(rng);
  Trial trial{target + (signal == SIGKILL ? " killed" : " stalled"), -1, ""};

  const pid_t demo =
      spawn({bin + "/bevel-demo", "--config", config_path, "--out", out, "--target", "4,-6,110"}, out + "-demo.txt");
  const auto sleep_ms = [](int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); };
  std::unique_ptr<test::BusListener> listener;
  for (int i = 0; i < 1500 && (!listener || listener->rate(0) < kMoving_unit_s); ++i) {
    sleep_ms(10);
    try {
      if (!listener && i > 100) listener = std::make_unique<test::BusListener>(bus, config);
    } catch (const std::exception&) {  // the rig is not there yet
    }
    if (listener) listener->listen();
  }
  const bool moving = listener && listener->rate(0) >= kMoving_unit_s;
  const auto children = children_of(demo);
  const std::int64_t until_ns = nodes::now().ns + static_cast<std::int64_t>(wait_s * 1e9);
  while (moving && nodes::now().ns < until_ns) sleep_ms(2), listener->listen();

  const pid_t victim = target == "bevel-demo" ? demo : (children.contains(target) ? children.at(target) : 0);
  if (!moving || victim == 0) {
    trial.problem = "did not get to steering";
  } else if (listener->at_rest()) {
    trial.problem = "at rest before";
  } else {
    const bool hung_operator = target == "bevel-demo" && signal == SIGSTOP;
    const std::int64_t noticed_ns = hung_operator ? std::llround(1e9 * system.controller.operator_timeout_s) : 0;
    kill(victim, signal);
    const std::int64_t hit_ns = nodes::now().ns;
    std::int64_t rest_ns = -1;
    while (nodes::now().ns < hit_ns + noticed_ns + 1'000 * kMs) {
      // Before the time-out of a hung operator the driver is alive, and would take the question for another master's.
      if (nodes::now().ns > hit_ns + noticed_ns) listener->ask_if_silent();
      sleep_ms(2);
      listener->listen();
      if (!listener->at_rest()) rest_ns = -1;
      if (listener->at_rest() && rest_ns < 0) rest_ns = nodes::now().ns;
    }
    trial.ms_to_rest = rest_ns < 0 ? -1 : static_cast<double>(rest_ns - hit_ns) * 1e-6;
    if (rest_ns < 0) {
      trial.problem = "does not rest";
    } else if (rest_ns - hit_ns - noticed_ns > test::kToRest_ns) {
      trial.problem = "rests too late";
    } else if (rest_ns - hit_ns < noticed_ns - kHeartbeat_ns) {
      trial.problem = "rests before the operator's time-out: for another reason";
    }
    if (signal == SIGSTOP) {  // it comes back, and nothing moves again
      kill(victim, SIGCONT);
      for (int i = 0; i < 250; ++i) {
        sleep_ms(2);
        listener->listen();
        if (!listener->at_rest()) trial.problem = "moves again";
      }
    }
  }
  if (!trial.problem.empty()) {
    sleep_ms(1500);  // for the demo to say what it thinks of it
    for (std::ifstream text(out + "-demo.txt"); !text.eof();) {
      std::string line;
      std::getline(text, line);
      std::printf("    | %s\n", line.c_str());
    }
  }
  kill(demo, SIGINT);
  int waited_ms = 0;
  while (waitpid(demo, nullptr, WNOHANG) == 0) {
    if (waited_ms == 8000) kill(demo, SIGKILL);
    sleep_ms(20);
    waited_ms += 20;
  }
  for (int i = 0; i < 150; ++i) {  // whoever is left ends with its parent
    const bool any = std::ranges::any_of(children, [](const auto& c) { return kill(c.second, 0) == 0; });
    if (!any) return trial;
    sleep_ms(20);
  }
  for (const auto& [name, pid] : children)
    if (kill(pid, SIGKILL) == 0) trial.problem += " still running: " + name;
  return trial;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string signal = argc == 9 ? argv[8] : "KILL";
  if ((argc != 7 && argc != 9) || (signal != "KILL" && signal != "STOP")) {
    std::fprintf(stderr, "usage: kill_study BIN_DIR CONFIG OUT_DIR BUS TRIALS SEED [PROGRAM KILL|STOP]\n");
    return 2;
  }
  const Wanted wanted{argc == 9 ? argv[7] : "", signal == "STOP" ? SIGSTOP : SIGKILL};
  const std::string bin = argv[1], config_path = argv[2], out = argv[3], bus = argv[4];
  const int trials = std::atoi(argv[5]);
  const auto seed = std::strtoull(argv[6], nullptr, 10);
  const nodes::SystemConfig config = nodes::load_system_config(config_path);
  std::printf("%d trials, seed %llu\n", trials, seed);
  std::mt19937_64 rng(seed);
  std::map<std::string, std::vector<double>> times;
  int failed = 0;
  for (int i = 0; i < trials; ++i) {
    const Trial trial = run_trial(bin, config_path, out, bus, config, wanted, rng);
    std::printf("%3d %-26s at rest after %6.1f ms %s\n", i, trial.what.c_str(), trial.ms_to_rest,
                trial.problem.c_str());
    std::fflush(stdout);
    failed += trial.problem.empty() ? 0 : 1;
    if (trial.ms_to_rest >= 0) times[trial.what].push_back(trial.ms_to_rest);
  }
  for (auto& [what, ms] : times) {
    std::ranges::sort(ms);
    std::printf("%-26s n %3zu  p50 %6.1f  worst %6.1f ms\n", what.c_str(), ms.size(), ms[ms.size() / 2], ms.back());
  }
  std::printf("%d of %d within 200 ms, stationary for good, everything ended\n", trials - failed, trials);
  return failed == 0 ? 0 : 1;
}
