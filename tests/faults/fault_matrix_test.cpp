// SPDX-License-Identifier: MIT
// Ten thousand faults. BEVEL_FAULTS=N for another number, BEVEL_FAULT_SEED=S for other first seeds; with
// BEVEL_FAULTS=1 a single one can be looked at (the class is seed modulo the number of classes).
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/faults/fault_matrix.hpp"

namespace bevel::test {
namespace {

std::uint64_t setting(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

void expect_no_violation(int injections, During during) {
  const auto classes = fault_classes();
  const std::uint64_t first_seed = setting("BEVEL_FAULT_SEED", 1);
  const auto verdicts = run_matrix(classes, injections, first_seed, during);
  std::cout << injections << " injections, seeds from " << first_seed << "\n" << table(classes, verdicts);
  int shown = 0, violations = 0;
  const Verdict* worst = nullptr;
  for (const Verdict& v : verdicts) {
    if (v.ms_to_rest >= 0 && (!worst || v.ms_to_rest > worst->ms_to_rest)) worst = &v;
    if (v.violation.empty()) continue;
    ++violations;
    if (++shown <= 25) std::cout << classes[v.fault_class].name << " seed " << v.seed << ": " << v.violation << "\n";
  }
  if (worst)
    std::cout << "worst: " << worst->ms_to_rest << " ms, " << classes[worst->fault_class].name << ", seed "
              << worst->seed << "\n";
  EXPECT_EQ(violations, 0) << "of " << injections;
}

TEST(FaultMatrix, EveryFaultEndsInALatchedDeclaredStopWithin200ms) {
  expect_no_violation(static_cast<int>(setting("BEVEL_FAULTS", 10000)), During::steering);
}

// Drawn back it turns nothing, and takes longer to bring there.
TEST(FaultMatrix, AndSoItDoesWhileTheNeedleIsDrawnBack) {
  expect_no_violation(static_cast<int>(setting("BEVEL_FAULTS", 10000)) / 10, During::retracting);
}

}  // namespace
}  // namespace bevel::test
