// SPDX-License-Identifier: MIT
// Which scenarios another loop can take over: by name, so that one that has something new to it is looked at.
#include <bevel/rig/steering/scenarios.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bevel::rig {
namespace {

TEST(Scenarios, ThoseOfANeedleAloneHaveNoOtherCamerasTargetsOrEffects) {
  std::vector<std::string> alone;
  for (const Scenario& scenario : scenarios())
    if (is_of_needle_alone(scenario)) alone.push_back(scenario.name);
  // Wind-up is the beam's own; the bicycle's is an effect.
  EXPECT_THAT(alone, ::testing::UnorderedElementsAre("kinematic", "kinematic-30", "roll", "beam-100-0.3", "beam-100-1",
                                                     "beam-50-1", "beam-20-0.5", "beam-any", "beam-relaxing",
                                                     "beam-windup", "beam-windup-state", "beam-any-windup-in-vain",
                                                     "windup-in-vain", "late-in-vain", "good-guide", "default",
                                                     "default-50-1", "default-20-0.5", "beam-layered"));
}

}  // namespace
}  // namespace bevel::rig
