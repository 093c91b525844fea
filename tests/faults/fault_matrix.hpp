// SPDX-License-Identifier: MIT
// Every fault of every component at any instant of an insertion, in simulated time, judged by the same four laws:
//   1. both axes rest within 200 ms of the fault, by the true motion of the drives' shafts; where nothing can stop an
//      axis, the driver declares within 200 ms that it does not stop;
//   2. the stop is latched;
//   3. it is declared, with the right cause, on PROCESS_STATUS;
//   4. nothing moves again without a fresh word of the operator, also when the fault has passed.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/loop/simulated_loop.hpp"

namespace bevel::test {

// A class of faults. `inject` breaks something now; `mend` takes the fault back.
struct FaultClass {
  std::string name;  // component:kind
  std::function<void(SimulatedLoop&, std::mt19937_64& rng)> inject;
  std::function<void(SimulatedLoop&)> mend;
  // One of these is in what a process says of its reason.
  std::vector<std::string> causes;
  // When the fault begins to show: some do nothing until they contradict what is commanded. Empty: at once.
  std::function<bool(const SimulatedLoop&)> shows{};
  // Nothing stops the axis, so that "does not stop" has to be declared instead of rest.
  bool defies_stops = false;
  // Once it is taken back: what else must hold, "" or what does not. Empty: nothing.
  std::function<std::string(const SimulatedLoop&)> judge = nullptr;
};
std::vector<FaultClass> fault_classes();
// Those of drives that do not carry out what they acknowledge.
std::vector<FaultClass> drive_fault_classes();

struct Verdict {
  std::size_t fault_class = 0;
  std::uint64_t seed = 0;
  int ms_to_rest = -1;    // from when it shows to rest, or to the declaration that an axis does not stop; -1: never
  bool showed = true;     // false: it did nothing within the time of observation, and the needle went on as it should
  std::string violation;  // "" or which law, and how
};

// What the needle is doing when it is hit.
enum class During { steering, retracting };

// One insertion, steered to a random target, or drawn back on the way there, hit at a random instant; all drawn from
// the seed.
Verdict run_injection(const std::vector<FaultClass>& classes, std::size_t fault_class, std::uint64_t seed,
                      During during = During::steering);

// Classes in turn, seeds counted up from first_seed, on all processors; the order of the result is that of the seeds.
std::vector<Verdict> run_matrix(const std::vector<FaultClass>& classes, int injections, std::uint64_t first_seed,
                                During during = During::steering);

// By class: injections, p50 and worst time to rest with its seed, violations.
std::string table(const std::vector<FaultClass>& classes, const std::vector<Verdict>& verdicts);

}  // namespace bevel::test
