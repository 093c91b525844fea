// SPDX-License-Identifier: MIT
// The length of a tip's jumps, from half of it and from twice: every second place is right there, and no small step
// leads away.
#include <gtest/gtest.h>

#include <bevel/diagnosis/inference/local_minima.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

TEST(JumpLength, IsFoundFromHalfAndFromTwiceOfIt) {
  constexpr double kJump_mm = 1.7;
  SimulatedRig rig;
  rig.effects = {active("stick_slip", {kJump_mm})};
  const NeedleSystem system(record_case(rig, 5), rig.needle);
  std::size_t effect = 0;
  while (system.effects()[effect].label != "stick_slip") ++effect;
  const inference::Layout layout(system, {effect});
  inference::Noise noise;
  noise.sigma = {rig.sigma_mm[0], rig.sigma_mm[1], rig.sigma_mm[2]};
  noise.ar1 = rig.ar1;
  noise.frame_s = rig.frame_s;
  const inference::Likelihood likelihood(system, inference::Readings(system.data().recordings.size()), noise);
  const std::vector<VectorXd> local(system.data().recordings.size(), layout.local_start());
  const inference::Scales scales{.nuisance_sd = VectorXd::Zero(static_cast<Index>(system.nuisance_groups().size())),
                                 .curves = {}};
  for (const double factor : {0.5, 2.0}) {
    VectorXd shared = layout.shared_start();
    const Index jump = layout.find_shared(0, 0);
    shared[jump] = factor * kJump_mm;
    inference::Fit found = fit(likelihood, layout, shared, local, scales);
    ASSERT_TRUE(found.valid);
    EXPECT_NEAR(found.shared[jump], factor * kJump_mm, 0.1 * kJump_mm);  // a fit alone stays there
    scan_shapes(likelihood, {}, found);
    EXPECT_NEAR(found.shared[jump], kJump_mm, 0.01) << "from " << factor << " of it";
  }
}

}  // namespace
}  // namespace bevel::diagnosis::testing
