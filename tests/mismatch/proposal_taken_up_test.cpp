// SPDX-License-Identifier: MIT
// A library with one effect more, out of a proposal: what was unknown without it has its name.
#include <gtest/gtest.h>

#include <cmath>

#include <bevel/diagnosis/mismatch/diagnose.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

TEST(ProposalTakenUp, IsFoundAsAllOthersAre) {
  constexpr double kAmplitude = 0.12, kShape_mm = 14, kLow_mm = 0.25;  // the last of the compiled source
  SimulatedRig rig;
  rig.true_motion = [](std::vector<model::ActuatorState>& states) {
    for (auto& s : states)
      if (const double x = s.insertion_mm - kLow_mm; x > 0)
        s.insertion_mm += kAmplitude * (x - kShape_mm * (1 - std::exp(-x / kShape_mm)));
  };
  DiagnosisOptions options;
  options.threads = 2;
  const Findings found = diagnose(record_case(rig, 4), rig.needle, options);
  EXPECT_EQ(found.verdict, Verdict::effects_found) << found.sentence;
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].name, "advance_saturation_by_depth");
  ASSERT_EQ(found.effects[0].parameters.size(), 2U);
  const FoundParameter &amplitude = found.effects[0].parameters[0], &shape = found.effects[0].parameters[1];
  EXPECT_NEAR(amplitude.value, kAmplitude, 4 * amplitude.std_error);
  EXPECT_LT(amplitude.std_error, 0.1 * kAmplitude);
  EXPECT_NEAR(shape.value, kShape_mm, 4 * shape.std_error);
  EXPECT_LT(shape.std_error, 0.3 * kShape_mm);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
