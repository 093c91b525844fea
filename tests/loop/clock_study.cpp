// SPDX-License-Identifier: MIT
// The wall clock of real processes is set while they steer a needle, by libfaketime; the steady clock goes on. Usage:
// clock_study BIN_DIR CONFIG OUT_DIR LIBFAKETIME WHOSE JUMP_S..., inside a network namespace of its own
// (processes_test.sh). WHOSE: `all`, one machine with all processes; or `camera`, `estimator`, `controller`, `stepper`,
// of which each then runs on a machine whose clock alone is set. Exit status 0 when each jump was a stop within 200 ms,
// declared and latched, nothing fell silent, and the needle was steered on once the operator had armed anew.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/loop/live_rig.hpp"

namespace {

using namespace bevel;
using test::LiveRig;

constexpr double kSteered_s = 1, kWatched_s = 1;
constexpr double kArmed_s = 8;           // drives are reset and configured anew
constexpr double kRefused_s = 1.5;       // how long the operator tries in vain
constexpr double kTruthError_mm = 2;     // of the demo's needle, whose parameters are not what the software believes
constexpr double kClocksAgree_s = 0.15;  // of stamps, on a machine that may be busy
constexpr const char* kSetMachine = "set";
constexpr const char* kOtherMachine = "other";
constexpr const char* kClockWasSet = "the wall clock was set";

// The clocks of machines, each a file that libfaketime reads whenever a process of that machine looks at the clock.
class Clocks {
 public:
  Clocks(std::string folder, std::string library) : folder_(std::move(folder)), library_(std::move(library)) {}
  std::vector<std::string> words(const std::string& machine) const {
    set(machine, 0);
    return {"LD_PRELOAD=" + library_, "FAKETIME_TIMESTAMP_FILE=" + file(machine), "FAKETIME_NO_CACHE=1",
            // One name up to 0.9.6, the other since.
            "DONT_FAKE_MONOTONIC=1", "FAKETIME_DONT_FAKE_MONOTONIC=1"};
  }
  void set(const std::string& machine, double ahead_s) const {
    char text[32];
    std::snprintf(text, sizeof text, "%+.6f\n", ahead_s);
    std::ofstream(file(machine) + ".new") << text;
    std::filesystem::rename(file(machine) + ".new", file(machine));  // never half a number
  }

 private:
  std::string file(const std::string& machine) const { return folder_ + "/" + machine + ".clock"; }
  std::string folder_, library_;
};

// Which processes run on the machine whose clock is set. The rig takes the pictures, so its clock stamps them.
std::vector<std::string> set_with(const std::string& whose) {
  if (whose == "all") return {test::kProcesses.begin(), test::kProcesses.end()};
  if (whose == "camera") return {"bevel-rig", "bevel-camera"};
  return {"bevel-" + whose};
}

class Study {
 public:
  Study(LiveRig& rig, const Clocks& clocks, const std::string& whose)
      : rig_(rig), clocks_(clocks), whose_(whose), programs_(set_with(whose)) {}

  // True if everything was as it has to be.
  bool jump(double jump_s) {
    problems_ = 0;
    if (!rig_.steer(kArmed_s, kSteered_s)) return problem("does not get to steering"), false;
    const std::int32_t resets = rig_.estimate ? rig_.estimate->reset_count : 0;
    rig_.begin_watch();
    set(clock_s_ + jump_s);
    const std::int64_t set_ns = nodes::now().ns;
    rig_.run(kWatched_s);
    judge_stop(set_ns, jump_s, resets);
    rig_.run(kWatched_s);  // the watch goes on: nothing moves by itself
    if (whose_ != "all") {
      rig_.arm(kRefused_s);
      rig_.say(nodes::Word::start);
      rig_.run(kWatched_s);
      const std::string refusal = rig_.states();
      if (!rig_.at_rest()) problem("steered on while the clocks disagree");
      set(0);
      rig_.run(kWatched_s);
      std::printf("    clocks apart: %s\n", refusal.c_str());
    }
    if (rig_.watch().moved_again) problem("moves again by itself");
    if (!rig_.steer(kArmed_s, kSteered_s)) problem("does not steer on");
    judge_estimate();
    if (const std::string broken = rig_.broken(); !broken.empty()) problem(broken);
    rig_.say(nodes::Word::stop);
    rig_.run(0.5);
    return problems_ == 0;
  }

 private:
  void set(double clock_s) {
    clock_s_ = clock_s;
    clocks_.set(kSetMachine, clock_s);
    if (whose_ == "all") rig_.clock_us = std::llround(1e6 * clock_s);  // the operator sits there too
  }
  void problem(const std::string& what) {
    ++problems_;
    std::printf("    PROBLEM: %s [%s]\n", what.c_str(), rig_.states().c_str());
  }
  bool says(const std::string& process, const char* what) const {
    return rig_.said(process).reason.find(what) != std::string::npos;
  }

  void judge_stop(std::int64_t set_ns, double jump_s, std::int32_t resets) {
    const LiveRig::Watch& watch = rig_.watch();
    const double ms = rig_.ms_to_rest(set_ns);
    std::printf("%-10s %+8.1f s  at rest after %6.1f ms, declared after %6.1f ms (looked every %.0f ms)\n",
                whose_.c_str(), jump_s, ms,
                watch.declared_ns ? 1e-6 * static_cast<double>(watch.declared_ns - set_ns) : -1,
                1e-6 * static_cast<double>(watch.observer_late_ns));
    std::printf("    %s\n", rig_.states().c_str());
    if (ms < 0) problem("does not rest");
    if (ms > 1e-6 * static_cast<double>(test::kToRest_ns)) problem("rests too late");
    if (rig_.state_of("bevel-controller") != io::ProcessState::stopped)
      problem("the controller has not latched a stop");
    for (const char* process : test::kProcesses)
      if (!watch.heard.contains(process)) problem(std::string("not a word from ") + process);
    // Who has a clock that was set and inputs that stop has to say so, and the others that they are not believed.
    for (const std::string& program : programs_)
      if (program != "bevel-rig" && program != "bevel-camera" && !says(program, kClockWasSet))
        problem(program + " does not say that its clock was set");
    if (whose_ != "all") return;
    for (const char* channel : {io::channel::kActuatorState, io::channel::kTipMeasurement, io::channel::kNeedleState})
      if (!watch.heard.contains(channel) || watch.heard.at(channel) < 20)
        problem(std::string("nearly silent: ") + channel);
    if (!rig_.estimate || rig_.estimate->reset_count <= resets) problem("the estimator has declared no reset");
    const double apart_s = 1e-6 * static_cast<double>(nodes::now().utime + rig_.clock_us - rig_.estimate->utime);
    if (!(std::abs(apart_s) < kClocksAgree_s)) problem("estimates are stamped " + std::to_string(apart_s) + " s away");
  }

  void judge_estimate() {
    if (!rig_.estimate || !rig_.truth) return problem("no estimate, or no truth");
    double error2 = 0;
    for (int i = 0; i < 3; ++i) error2 += std::pow(rig_.estimate->position_mm[i] - rig_.truth->position_mm[i], 2);
    std::printf("    steered on, estimate %.2f mm from the true tip at %.0f mm\n", std::sqrt(error2),
                rig_.truth->position_mm[2]);
    if (!(std::sqrt(error2) < kTruthError_mm)) problem("the estimate is off");
  }

  LiveRig& rig_;
  const Clocks& clocks_;
  std::string whose_;
  std::vector<std::string> programs_;
  double clock_s_ = 0;
  int problems_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 7) {
    std::fprintf(stderr, "usage: clock_study BIN_DIR CONFIG OUT_DIR LIBFAKETIME WHOSE JUMP_S...\n");
    return 2;
  }
  const std::string out = argv[3], whose = argv[5];
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  std::filesystem::create_directories(out);
  const Clocks clocks(out, argv[4]);
  std::map<std::string, std::vector<std::string>> prefix;
  for (const char* program : test::kProcesses) prefix[program] = clocks.words(kOtherMachine);
  for (const std::string& program : set_with(whose)) prefix.at(program) = clocks.words(kSetMachine);
  LiveRig rig(argv[1], argv[2], out, prefix);
  Study study(rig, clocks, whose);
  int failed = 0;
  for (int i = 6; i < argc; ++i) failed += study.jump(std::atof(argv[i])) ? 0 : 1;
  std::printf("%d of %d jumps: a declared, latched stop within 200 ms, and steered on when armed anew\n",
              argc - 6 - failed, argc - 6);
  return failed == 0 ? 0 : 1;
}
