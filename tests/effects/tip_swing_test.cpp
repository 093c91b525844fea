// SPDX-License-Identifier: MIT
// The stiff shaft: against closed forms, brute force, and the beam of the simulated plant, which knows no effects.
#include <gtest/gtest.h>

#include <memory>
#include <numbers>

#include <bevel/model/beam/beam_plant.hpp>
#include "tests/effects/brute_force.hpp"

namespace bevel::model::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

OpenLoop with(const NeedleParameters& needle, const std::vector<ActiveEffect>& effects, const Motion& motion) {
  return run(AugmentedNeedle(needle, effects), motion, true);
}

// Half a turn at rest moves the tip by the circle's diameter; cutting on brings it back, e-fold over relax_mm.
TEST(TipSwing, OfATurnIsGoneWhenItHasCutOn) {
  constexpr double kRadius_mm = 0.8, kRelax_mm = 6, kDeep_mm = 20;
  const Script script{{2, 10, 0}, {1, 0, pi}, {3, 10, 0}};
  const Motion motion = script.recorded();
  const OpenLoop nominal = with(bicycle(), {}, motion);
  const OpenLoop path = with(bicycle(), {active("tip_swing", {kRadius_mm, kRelax_mm, 0, 0})}, motion);
  const double tilt_rad = bicycle().curvature_per_mm * kDeep_mm;
  for (std::size_t i = 0; i < path.position_mm.size(); ++i) {
    const BaseMotion& base = motion.nodes[motion.at[i]];
    const Vector3d offset = path.position_mm[i] - nominal.position_mm[i];
    const double phi = base.rotation_rad;
    // From -y over +x to +y, across a needle that is tilted about x.
    const Vector3d turned(std::sin(phi), (1 - std::cos(phi)) * std::cos(tilt_rad),
                          (1 - std::cos(phi)) * std::sin(tilt_rad));
    const double left = std::exp(-std::max(0.0, base.insertion_mm - kDeep_mm) / kRelax_mm);
    EXPECT_LT((offset - kRadius_mm * left * turned).norm(), 1e-9) << i;
    EXPECT_EQ(path.heading[i], nominal.heading[i]);
  }
}

TEST(TipSwing, FollowsABaseThatTurnsAndCuts) {
  static constexpr double kRadius_mm = 0.8, kRelax_mm = 6;
  const Script script = rich_script();
  const auto seen = std::make_shared<std::vector<Vector3d>>();
  BruteForce brute{.needle = agar()};
  brute.after = [seen, offset = Vector3d(0, 0, 0)](const Instant& now) mutable {
    // Of the bevel's direction only what the roll makes of it: not that the needle bends.
    const Vector3d turn = now.dr_rad * (now.R * Vector3d(1, 0, 0));
    offset += kRadius_mm * turn - offset * std::max(now.ds_mm, 0.0) / kRelax_mm;
    seen->push_back(offset);
  };
  const Motion motion = script.fine();
  const auto nominal = brute.path(script, motion);
  const OpenLoop path = with(agar(), {active("tip_swing", {kRadius_mm, kRelax_mm, 0, 0})}, motion);
  const std::size_t steps = seen->size() / (motion.nodes.size() - 1);
  for (std::size_t i = 1; i < path.position_mm.size(); ++i)
    EXPECT_LT((path.position_mm[i] - nominal[i] - seen->at(motion.at[i] * steps - 1)).norm(), 5e-3) << i;
}

// A beam on an elastic foundation, flipped, turned and spun: its curvature F / (EI lambda) and bending length 1 /
// lambda are those of its mechanics, and nothing is fitted. What the plant has and the effect has not: a mesh, and
// depths that are those of an arc.
struct Beam {
  double modulus_kPa, force_N, guide_mm;
};
class TipSwingOfABeam : public ::testing::TestWithParam<Beam> {};

TEST_P(TipSwingOfABeam, IsThatOfItsMechanics) {
  BeamPlantConfig config;
  config.foundation_modulus_kPa = GetParam().modulus_kPa;
  config.bevel_force_N = GetParam().force_N;
  config.guide_gap_mm = GetParam().guide_mm;
  const double k = 1e-3 * config.foundation_modulus_kPa, EI = config.bending_stiffness_N_mm2;
  const double lambda_per_mm = std::pow(k / (4 * EI), 0.25);
  NeedleParameters needle = bicycle();
  needle.curvature_per_mm = config.bevel_force_N / (EI * lambda_per_mm);

  // The last but one: drawn back, turned in the channel, and on through it.
  const Script script{{4, 10, 0},   {1, 0, pi},    {2, 10, 0},   {1, 0, -pi / 2}, {2, 10, 0},
                      {1.5, -8, 0}, {0.8, 0, 2.5}, {2.5, 10, 0}, {1, 10, 2},      {1, 10, 0}};
  const Motion motion = script.fine(0.01);
  BeamPlant plant(config);
  std::vector<Vector3d> measured{plant.tip_position_mm()}, headings{plant.tip_heading()};
  for (std::size_t i = 1; i < motion.nodes.size(); ++i) {
    const BaseMotion &from = motion.nodes[i - 1], &to = motion.nodes[i];
    plant.advance(to.insertion_mm - from.insertion_mm, to.rotation_rad - from.rotation_rad, to.time_s - from.time_s);
    if (i % 50 == 0) measured.push_back(plant.tip_position_mm()), headings.push_back(plant.tip_heading());
  }
  const auto left_mm = [&](const OpenLoop& path) {
    double squares = 0;
    for (std::size_t i = 0; i < measured.size(); ++i)
      squares += (measured[i] - path.position_mm[i]).head<2>().squaredNorm();
    return std::sqrt(squares / static_cast<double>(measured.size()));
  };
  const auto left_rad = [&](const OpenLoop& path) {
    double largest = 0;
    for (std::size_t i = 0; i < headings.size(); ++i)
      largest = std::max(largest, (headings[i] - path.heading[i]).head<2>().norm());
    return largest;
  };
  const OpenLoop stiff = with(needle, {active("tip_swing", {0, 5, 1 / lambda_per_mm, config.guide_gap_mm})}, motion);
  const OpenLoop slack = with(needle, {}, motion);
  EXPECT_LT(left_mm(stiff), 0.02 * left_mm(slack)) << left_mm(stiff) << " of " << left_mm(slack) << " mm";
  double deeper_mm = 0;
  for (std::size_t i = 0; i < measured.size(); ++i)
    deeper_mm = std::max(deeper_mm, std::abs(measured[i].z() - stiff.position_mm[i].z()));
  EXPECT_LT(deeper_mm, 0.02 * left_mm(slack));
  EXPECT_LT(left_rad(stiff), 0.03 * left_rad(slack)) << left_rad(stiff) << " of " << left_rad(slack) << " rad";
}
INSTANTIATE_TEST_SUITE_P(Beams, TipSwingOfABeam,
                         ::testing::Values(Beam{100, 0.3, 0}, Beam{100, 1, 0}, Beam{20, 0.5, 0}, Beam{5, 0.3, 0},
                                           Beam{100, 1, 15}, Beam{50, 1, 15}, Beam{10, 1, 10}));

}  // namespace
}  // namespace bevel::model::testing
