// SPDX-License-Identifier: MIT
// A loop for tests, and how long until both axes rest.
#pragma once

#include <gtest/gtest.h>

#include <iostream>

#include "tests/loop/simulated_loop.hpp"

namespace bevel {

inline constexpr unsigned kSeed = 9;

class Loop : public ::testing::Test, public test::SimulatedLoop {
 protected:
  Loop() : SimulatedLoop(kSeed) {}
  void steer(const Eigen::Vector3d& target) { ASSERT_EQ(steer_to(target), ""); }
  // Runs on until both axes rest; how long that takes from now.
  std::int64_t ms_to_rest() {
    const std::int64_t from = ms;
    EXPECT_TRUE(run(2, [this] { return at_rest(); }));
    std::cout << "both axes at rest after " << ms - from << " ms\n";
    return ms - from;
  }
};

}  // namespace bevel
