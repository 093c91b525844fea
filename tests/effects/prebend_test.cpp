// SPDX-License-Identifier: MIT
// The example of docs/adding-an-effect.md, compiled out of that page: what it says works, and works everywhere.
#include <gtest/gtest.h>

#include <cmath>

#include <bevel/io/model_file.hpp>
#include "tests/effects/script.hpp"

namespace bevel::model::testing {
namespace {

using Eigen::Vector3d;

TEST(Prebend, IsInTheRegistryWhereThePageSays) {
  const auto all = all_effects();
  const auto at = std::find(all.begin(), all.end(), find_effect("prebend"));
  ASSERT_NE(at, all.end());
  EXPECT_EQ((*(at - 1))->name(), "flip_transient");
  EXPECT_EQ((*(at + 1))->name(), "lateral_bias");
}

TEST(Prebend, IsACircleInATurnedPlane) {
  constexpr double kPrebend = 0.0021;
  const double k = bicycle().curvature_per_mm;
  const double K = std::hypot(k, kPrebend);
  const Motion motion = Script{{6, 20, 0}}.recorded();
  const auto path = path_of(bicycle(), {active("prebend", {kPrebend})}, motion);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double s = motion.nodes[motion.at[i]].insertion_mm;
    const double aside = (1 - std::cos(K * s)) / K;
    // Turned from -y, where k alone bends it, toward +x.
    EXPECT_LT((path[i] - Vector3d(aside * kPrebend / K, -aside * k / K, std::sin(K * s) / K)).norm(), 1e-9);
  }
}

TEST(Prebend, IsATurnedBevelsTwin) {
  NeedleParameters turned = agar();
  turned.curvature_per_mm = std::hypot(0.0047, 0.0021);
  const Motion motion = rich_script().recorded();
  EXPECT_LT(largest_distance_mm(path_of(agar(), {active("prebend", {0.0021})}, motion),
                                path_of(turned, {active("bevel_offset", {std::atan2(0.0021, 0.0047)})}, motion)),
            1e-9);
}

TEST(Prebend, VanishesAtItsNoneAndHasItsSensitivity) {
  const Motion motion = rich_script().recorded();
  EXPECT_EQ(path_of(agar(), {active("prebend", {0})}, motion), path_of(agar(), {}, motion));
  ActiveEffect one = active("prebend", {0.0008});
  one.parameters[0] = Dual::unknown(0.0008, 0);
  const OpenLoop path = run(AugmentedNeedle(agar(), {one}, 1), motion);
  constexpr double kStep = 1e-7;
  const auto up = path_of(agar(), {active("prebend", {0.0008 + kStep})}, motion);
  const auto down = path_of(agar(), {active("prebend", {0.0008 - kStep})}, motion);
  for (std::size_t i = 0; i < up.size(); ++i)
    EXPECT_LT(
        (path.jacobian.col(0).segment<3>(static_cast<Eigen::Index>(3 * i)) - (up[i] - down[i]) / (2 * kStep)).norm(),
        1e-3);  // of some 1000 mm per 1/mm
}

TEST(Prebend, IsAcceptedByModelFiles) {
  const io::ModelFile model = io::parse_model_file(
      "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n"
      "[[effect]]\nname = \"prebend\"\nprebend_per_mm = 0.0008\n",
      "m.toml");
  const auto effects = io::active_effects(model, "");
  ASSERT_EQ(effects.size(), 1U);
  EXPECT_EQ(effects[0].effect, find_effect("prebend"));
  EXPECT_EQ(effects[0].parameters[0].value, 0.0008);
}

}  // namespace
}  // namespace bevel::model::testing
