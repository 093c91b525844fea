// SPDX-License-Identifier: MIT
// Real processes steer a needle while stress-ng overloads the machine that they run on. Usage: load_study BIN_DIR
// CONFIG OUT_DIR SEED LOAD..., inside a network namespace of its own (processes_test.sh). A LOAD is KIND:WORKERS:NICE:
// what stress-ng does (matrix, switch, vm, or mixed: all three), how many workers of each per processor, and its
// niceness. At 19 it is the equal of the four processes of the loop, below it leaves them less than their share.
//
// The rig and who measures keep niceness 0: drives are machines of their own. Where either was late all the same, times
// are not measured, and the trial says so and does not count.
//
// The laws, whatever the load: while an axis moves, everybody in the loop was heard within the last 200 ms; what does
// not go on is a stop that is declared, latched and at rest; nothing moves after it without the operator's start; the
// controller is not armed for longer than drives may take while the axes are in fault; and when the load has gone, the
// operator arms anew and the needle is steered on. Exit status 0 when they held, 77 when no trial could be measured.
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <sstream>
#include <thread>

#include "tests/loop/live_rig.hpp"

extern char** environ;

namespace {

using namespace bevel;
using test::kMs, test::kSources, test::LiveRig;

constexpr double kLoaded_s = 3, kAfterStop_s = 1, kArmedInLoad_s = 2.5, kArmed_s = 10, kSteered_s = 1;
constexpr const char* kLoopNice = "19";
constexpr std::int64_t kTooLate_ns = 40 * kMs;  // of rig or observer: beyond this a time is not measured
// Switching on is given up after controller.safety.enabling_s; then its word has to come through the load.
constexpr double kWord_s = 1;
constexpr double kStatus_s = 0.6, kToRest_s = 0.5;

struct Load {
  std::string name, kind;
  int workers = 0, nice = 0;
};

Load parse(const std::string& text) {
  Load load{text, "", 0, 0};
  std::istringstream in(text);
  char colon = 0;
  if (!std::getline(in, load.kind, ':') || !(in >> load.workers >> colon >> load.nice)) std::exit(2);
  return load;
}

// stress-ng in a process group of its own; it also ends by itself.
class Stress {
 public:
  explicit Stress(const Load& load) {
    const std::string workers =
        std::to_string(load.workers * std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
    std::vector<std::string> words{"nice",        "-n",         std::to_string(load.nice),
                                   "stress-ng",   "--quiet",    "--timeout",
                                   "20s",         "--vm-bytes", "64m",
                                   "--temp-path", "/tmp"};
    for (const std::string kind : {"matrix", "switch", "vm"}) {
      if (load.kind != kind && load.kind != "mixed") continue;
      words.insert(words.end(), {"--" + kind, kind == "vm" ? "2" : workers});
    }
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    if (posix_spawnp(&pid_, argv[0], nullptr, &attributes, argv.data(), environ) != 0) std::exit(2);
    posix_spawnattr_destroy(&attributes);
  }
  Stress(const Stress&) = delete;
  Stress& operator=(const Stress&) = delete;
  ~Stress() {
    kill(-pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  bool runs() const { return waitpid(pid_, nullptr, WNOHANG) == 0; }

 private:
  pid_t pid_ = 0;
};

struct Trial {
  std::vector<std::string> problems;
  bool stopped = false, measured = true;
  double age_moving_ms = 0;  // the oldest last word of anybody in the loop while an axis moved
};

class Study {
 public:
  Study(LiveRig& rig, const nodes::SystemConfig& config) : rig_(rig), config_(config) {}

  Trial run(const Load& load, double wait_s) {
    trial_ = {};
    if (!rig_.steer(kArmed_s, wait_s)) return problem("does not get to steering"), trial_;
    rig_.begin_watch();
    {
      Stress stress(load);
      rig_.run(kLoaded_s, [this] { return rig_.stop_declared() && rig_.at_rest(); });
      rig_.run(kStatus_s);  // for the rig to say how late it was
      if (rig_.stop_declared()) rig_.run(kToRest_s, [this] { return rig_.at_rest(); });
      judge_motion(load);
      if (trial_.stopped) {
        rig_.run(kAfterStop_s);
        judge_rest();
        rig_.arm(kArmedInLoad_s);  // whether it succeeds is left open
        rig_.run(kAfterStop_s);
        judge_rest();
      }
      if (!stress.runs()) problem("stress-ng ended by itself");
    }
    const double allowed_s = config_.controller.safety.enabling_s + kWord_s;
    const double contradiction_s = 1e-9 * static_cast<double>(rig_.watch().armed_with_fault_ns);
    if (contradiction_s > allowed_s) problem("armed with axes in fault for " + std::to_string(contradiction_s) + " s");
    if (const std::string broken = rig_.broken(); !broken.empty()) problem(broken);
    if (trial_.stopped && !rig_.steer(kArmed_s, kSteered_s)) problem("does not steer on when the load has gone");
    return trial_;
  }

 private:
  void problem(const std::string& what) { trial_.problems.push_back(what + " [" + rig_.states() + "]"); }

  void judge_motion(const Load& load) {
    const LiveRig::Watch& watch = rig_.watch();
    trial_.stopped = rig_.stop_declared() || watch.rest_ns != 0;
    const auto oldest = std::ranges::max_element(watch.age_while_moving_ns);
    trial_.age_moving_ms = 1e-6 * static_cast<double>(*oldest);
    trial_.measured = watch.observer_late_ns <= kTooLate_ns && watch.bench_late_ns <= kTooLate_ns;
    std::printf("%-14s %-11s last word while moving %6.1f ms old (%s)", load.name.c_str(),
                trial_.stopped ? "stopped" : "steered on", trial_.age_moving_ms,
                kSources.at(static_cast<std::size_t>(oldest - watch.age_while_moving_ns.begin())));
    if (trial_.stopped) std::printf(", at rest %5.1f ms after the word of it", rig_.ms_to_rest(watch.declared_ns));
    std::printf("; rig late %.0f ms, observer %.0f ms%s\n", 1e-6 * static_cast<double>(watch.bench_late_ns),
                1e-6 * static_cast<double>(watch.observer_late_ns), trial_.measured ? "" : ": NOT MEASURED");
    if (trial_.stopped) std::printf("    %s\n", rig_.states().c_str());
    if (trial_.measured && *oldest > test::kToRest_ns) problem("moves on without a word");
    if (trial_.measured && rig_.ms_to_rest(watch.declared_ns) > 1e-6 * test::kToRest_ns) problem("rests too late");
    if (rig_.moving() && rig_.stop_declared()) problem("moves though stopped");
  }
  void judge_rest() {
    if (!rig_.stop_declared() && rig_.state_of("bevel-controller") != io::ProcessState::armed)
      problem("at rest, and nobody says why");
    if (!rig_.at_rest()) problem("does not rest");
    if (rig_.watch().moved_again) problem("moves again by itself");
  }

  LiveRig& rig_;
  const nodes::SystemConfig& config_;
  Trial trial_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6) {
    std::fprintf(stderr, "usage: load_study BIN_DIR CONFIG OUT_DIR SEED KIND:WORKERS:NICE...\n");
    return 2;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const nodes::SystemConfig config = nodes::load_system_config(argv[2]);
  std::mt19937_64 rng(std::strtoull(argv[4], nullptr, 10));
  int failed = 0, unmeasured = 0, stopped = 0;
  double worst_ms = 0;
  for (int i = 5; i < argc; ++i) {
    const Load load = parse(argv[i]);
    std::map<std::string, std::vector<std::string>> prefix;
    for (const char* program : test::kProcesses) prefix[program] = {"nice", "-n", kLoopNice};
    prefix.erase("bevel-rig");
    LiveRig rig(argv[1], argv[2], argv[3], prefix);
    const Trial trial = Study(rig, config).run(load, std::uniform_real_distribution<double>(0.3, 1.5)(rng));
    for (const std::string& what : trial.problems) std::printf("    PROBLEM: %s\n", what.c_str());
    failed += trial.problems.empty() ? 0 : 1;
    unmeasured += trial.measured ? 0 : 1;
    stopped += trial.stopped ? 1 : 0;
    if (trial.measured) worst_ms = std::max(worst_ms, trial.age_moving_ms);
  }
  const int trials = argc - 5;
  std::printf(
      "%d of %d trials within the laws; %d stopped, %d steered on; %d not measured; an axis moved at most %.1f ms "
      "after the last word of anybody in the loop\n",
      trials - failed, trials, stopped, trials - stopped, unmeasured, worst_ms);
  if (failed > 0) return 1;
  if (unmeasured == trials) std::printf("SKIPPED: this machine is too busy for its rig to keep time\n");
  return unmeasured == trials ? 77 : 0;
}
