// SPDX-License-Identifier: MIT
#include "tests/faults/fault_matrix.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <thread>

namespace bevel::test {
namespace {

constexpr int kAllowed_ms = 200;
constexpr double kObserved_s = 0.8;                    // from the fault
constexpr double kAfter_s = 0.5;                       // from when it has passed
constexpr double kMoved_mm = 0.06, kMoved_rad = 0.06;  // a motor that comes free relaxes by so much

double uniform(std::mt19937_64& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

// Within half of what the needle's curvature reaches at that depth.
Eigen::Vector3d draw_target(std::mt19937_64& rng, double curvature_per_mm) {
  const double depth_mm = uniform(rng, 80, 115);
  const double side_mm = uniform(rng, 0, 0.25 * curvature_per_mm * depth_mm * depth_mm);
  const double direction_rad = uniform(rng, 0, 2 * std::numbers::pi);
  return {side_mm * std::cos(direction_rad), side_mm * std::sin(direction_rad), depth_mm};
}

// Most early, where all of the machinery is the same, some deep.
double draw_instant_s(std::mt19937_64& rng) { return rng() % 20 == 0 ? uniform(rng, 3, 15) : uniform(rng, 0.2, 2); }

std::string all_reasons(const SimulatedLoop& loop) {
  std::string text;
  for (const auto& [process, status] : loop.statuses)
    if (process != "bevel-rig") text += process + " " + status.state + " (" + status.reason + "); ";
  return text;
}

bool latched(SimulatedLoop& loop) {
  using stepper::DriverState;
  // A driver that is gone has left it to the drives, and starts without being enabled.
  if (loop.stepper) {
    const DriverState state = loop.stepper->report().state;
    if (state != DriverState::stopped && state != DriverState::fault) return false;
  }
  return !loop.controller || !loop.controller->supervisor().moves();
}

bool declares_no_stop(SimulatedLoop& loop) {
  return loop.stepper && std::ranges::count(loop.stepper->report().rest, stepper::AxisRest::does_not_stop) > 0;
}

bool moves(SimulatedLoop& loop) {
  return loop.controller && loop.controller->supervisor().moves() && loop.stepper &&
         loop.stepper->report().state == stepper::DriverState::enabled;
}

}  // namespace

Verdict run_injection(const std::vector<FaultClass>& classes, std::size_t fault_class, std::uint64_t seed,
                      During during) {
  const FaultClass& fault = classes.at(fault_class);
  Verdict verdict;
  verdict.fault_class = fault_class;
  verdict.seed = seed;
  std::mt19937_64 rng(seed);
  SimulatedLoop loop(rng());
  const auto violates = [&verdict](const std::string& what) {
    verdict.violation = what;
    return verdict;
  };
  const std::string started = loop.steer_to(draw_target(rng, loop.config.needle.curvature_per_mm));
  if (!started.empty()) return violates("did not start: " + started);
  auto wanted = controller::State::steering;
  if (during == During::retracting) {
    wanted = controller::State::retracting;
    loop.run(uniform(rng, 6, 12));
    loop.say(nodes::Word::retract);  // to the entry, five seconds and more away
    loop.run(uniform(rng, 0.5, 3));
  } else {
    loop.run(draw_instant_s(rng));
  }
  if (loop.state() != wanted) return violates("stopped without a fault: " + all_reasons(loop));

  // Reasons are collected as they are said: a process that is started again says others.
  std::string said;
  const auto listen = [&] {
    const std::string reasons = all_reasons(loop);
    if (said.size() < 4000 && said.find(reasons) == std::string::npos) said += reasons;
  };
  bool showing = !fault.shows;
  std::int64_t shown_ms = loop.ms, rest_ms = -1, stopped_ms = -1, declared_ms = -1;
  fault.inject(loop, rng);
  double longest_s = kObserved_s;
  for (const std::int64_t from = loop.ms; loop.ms < from + std::llround(1000 * longest_s);) {
    loop.step_one_ms();
    listen();
    if (fault.shows && moves(loop)) {
      const bool shows = fault.shows(loop);
      if (shows && !showing) {
        shown_ms = loop.ms;
        longest_s = kObserved_s + 1e-3 * static_cast<double>(loop.ms - from);
      }
      showing = shows;
    }
    if (stopped_ms < 0 && !moves(loop)) stopped_ms = loop.ms;
    if (declared_ms < 0 && declares_no_stop(loop)) declared_ms = loop.ms;
    if (!loop.at_rest()) rest_ms = -1;
    if (loop.at_rest() && rest_ms < 0) rest_ms = loop.ms;
  }
  if (!showing && rest_ms < 0) {
    verdict.showed = false;
    return verdict;
  }
  if (!showing) shown_ms = stopped_ms;  // found before it had an effect
  if (fault.defies_stops && rest_ms < 0) rest_ms = declared_ms;
  if (rest_ms < 0) return violates("law 1: never at rest; " + all_reasons(loop));
  verdict.ms_to_rest = static_cast<int>(std::max<std::int64_t>(rest_ms - shown_ms, 0));
  if (verdict.ms_to_rest > kAllowed_ms)
    return violates("law 1: at rest after " + std::to_string(verdict.ms_to_rest) + " ms; " + all_reasons(loop));
  if (!latched(loop)) return violates("law 2: not latched; " + all_reasons(loop));
  const bool named = std::ranges::any_of(
      fault.causes, [&said](const std::string& cause) { return said.find(cause) != std::string::npos; });
  if (!named) return violates("law 3: no cause of \"" + fault.causes.front() + "\", ... in: " + said);
  const double at_mm = loop.rig->drive(0).position_unit(), at_rad = loop.rig->drive(1).position_unit();
  fault.mend(loop);
  loop.run(kAfter_s);
  if (std::abs(loop.rig->drive(0).position_unit() - at_mm) > kMoved_mm ||
      std::abs(loop.rig->drive(1).position_unit() - at_rad) > kMoved_rad)
    return violates("law 4: moved again without a word; " + all_reasons(loop));
  if (fault.judge)
    if (const std::string wrong = fault.judge(loop); !wrong.empty()) return violates(wrong + "; " + all_reasons(loop));
  return verdict;
}

std::vector<Verdict> run_matrix(const std::vector<FaultClass>& classes, int injections, std::uint64_t first_seed,
                                During during) {
  std::vector<Verdict> verdicts(static_cast<std::size_t>(injections));
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < verdicts.size(); i = next++)
      verdicts[i] = run_injection(classes, (first_seed + i) % classes.size(), first_seed + i, during);
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 0; i < std::max(1U, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
  threads.clear();
  return verdicts;
}

std::string table(const std::vector<FaultClass>& classes, const std::vector<Verdict>& verdicts) {
  std::string text = "fault                          injected  no effect  p50 ms  worst ms  (seed)        violations\n";
  for (std::size_t c = 0; c < classes.size(); ++c) {
    std::vector<std::pair<int, std::uint64_t>> rest;
    int injected = 0, silent = 0, violations = 0;
    for (const Verdict& v : verdicts) {
      if (v.fault_class != c) continue;
      ++injected;
      silent += v.showed ? 0 : 1;
      violations += v.violation.empty() ? 0 : 1;
      if (v.ms_to_rest >= 0) rest.emplace_back(v.ms_to_rest, v.seed);
    }
    if (injected == 0) continue;
    std::ranges::sort(rest);
    char line[160];
    if (rest.empty()) {
      std::snprintf(line, sizeof line, "%-30s %8d %10d %7s %9s  %-12s %11d\n", classes[c].name.c_str(), injected,
                    silent, "-", "-", "", violations);
    } else {
      std::snprintf(line, sizeof line, "%-30s %8d %10d %7d %9d  (%-10llu) %11d\n", classes[c].name.c_str(), injected,
                    silent, rest[rest.size() / 2].first, rest.back().first,
                    static_cast<unsigned long long>(rest.back().second), violations);
    }
    text += line;
  }
  return text;
}

}  // namespace bevel::test
