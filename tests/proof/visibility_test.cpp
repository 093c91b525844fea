// SPDX-License-Identifier: MIT
// Visible size, where it is known in closed form.
#include "proof/visibility.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <map>

#include "proof/beam_path.hpp"
#include "proof/bounded_fit.hpp"

namespace bevel::proof {
namespace {

Setting straight_setting(const CameraNoise& noise) {
  Random random(21);
  Setting setting;
  for (int i = 0; i < 3; ++i) {
    setting.motions.push_back(follow({"plain", {{4.0 + i, 10, 0}, {0.5, 0, 0}}}));
    setting.frames.push_back(draw_frames(noise, setting.motions.back().duration_s(), random));
    setting.whiteners.emplace_back(noise, setting.frames.back());
  }
  return setting;
}

Views shifted(Views views, const Eigen::Vector3d& by_mm) {
  for (auto& v : views) v.colwise() += by_mm;
  return views;
}

TEST(Visibility, OfTwoGroupsOnlyOneIsChanged) {
  Setting setting = straight_setting({});
  const BaseNeedle needle;
  const Views bare = views_of(setting, needle, {});
  setting.changed = {true, false, true};
  HiddenPhysics stiffer;
  stiffer.curvature_change = 0.2;
  const Views seen = views_of(setting, needle, stiffer);
  BaseNeedle bent = needle;
  bent.curvature_per_mm *= 1.2;
  const Views all = views_of(setting, bent, {});
  EXPECT_EQ(seen[0], all[0]);
  EXPECT_EQ(seen[1], bare[1]);
  EXPECT_EQ(seen[2], all[2]);
  // One needle for both groups cannot be it; one for each could.
  EXPECT_GT(refit_base(setting, seen, needle, {}).sigmas, 10);
  setting.changed = {true, true, true};
  EXPECT_LT(refit_base(setting, views_of(setting, needle, stiffer), needle, {}).sigmas, 1e-2);
}

TEST(Visibility, AConstantShiftInWhiteAndInColouredNoise) {
  for (const double rho : {0.0, 0.6, 0.9}) {
    CameraNoise noise;
    noise.sigma_mm = 0.2;
    noise.ar1 = rho;
    const Setting setting = straight_setting(noise);
    const Views bare = views_of(setting, {}, {});
    // A shift d in AR(1) noise: (d / sigma)^2 (1 + (n - 1) (1 - rho)^2 / (1 - rho^2)) of each recording.
    double squares = 0;
    for (const Frames& frames : setting.frames)
      squares += std::pow(0.1 / 0.2, 2) *
                 (1 + (static_cast<double>(frames.size()) - 1) * (1 - rho) * (1 - rho) / (1 - rho * rho));
    const Eigen::VectorXd difference = whitened_difference(setting, shifted(bare, {0.1, 0, 0}), bare);
    EXPECT_NEAR(difference.norm(), std::sqrt(squares), 1e-6 * std::sqrt(squares)) << rho;
    // The needle moves in the y-z plane here: nothing of a shift along x is absorbed.
    EXPECT_NEAR(BaseTangent(setting, {}, {}).norm_beyond(difference), difference.norm(), 1e-6 * difference.norm());
    EXPECT_NEAR(refit_base(setting, shifted(bare, {0.1, 0, 0}), {}, {}).sigmas, difference.norm(), 1e-3);
  }
}

TEST(Visibility, TheBaseParametersAbsorbThemselves) {
  CameraNoise noise;
  noise.ar1 = 0.6;
  const Setting setting = straight_setting(noise);
  const BaseNeedle start{0.0047, 22, 0.3, 0.1};
  const BaseNeedle other{0.0056, 22, 0.42, 0.05};
  const Views seen = views_of(setting, other, {});
  EXPECT_GT(whitened_difference(setting, seen, views_of(setting, start, {})).norm(), 10);
  const Refit refit = refit_base(setting, seen, start, {});
  EXPECT_TRUE(refit.converged);
  EXPECT_LT(refit.sigmas, 0.2);
  EXPECT_NEAR(refit.needle.curvature_per_mm, other.curvature_per_mm, 3e-4);
  EXPECT_EQ(refit.needle.wheelbase_mm, start.wheelbase_mm);
}

// Without rotation, a rotation backlash cannot show, and a change of curvature with depth is largely absorbed.
TEST(Visibility, DependsOnWhatTheRecordingsExcite) {
  const Setting setting = straight_setting({});
  const BaseNeedle needle;
  HiddenPhysics backlash;
  backlash.rotation_backlash_rad = 0.5;
  EXPECT_LT(refit_base(setting, views_of(setting, needle, backlash), needle, {}).sigmas, 1e-6);
  HiddenPhysics depth;
  depth.curvature_per_100mm = 0.4;
  const Views seen = views_of(setting, needle, depth);
  const double all = whitened_difference(setting, seen, views_of(setting, needle, {})).norm();
  EXPECT_LT(refit_base(setting, seen, needle, {}).sigmas, 0.1 * all);
}

// The linear figure, by which sizes are chosen, and the nonlinear one, which the truth states, agree for small effects.
TEST(Visibility, LinearAndNonlinearAgreeForSmallEffects) {
  const Setting setting = straight_setting({});
  const BaseNeedle needle;
  HiddenPhysics entry;
  entry.entry_about_x_rad = 0.0005;
  const Views seen = views_of(setting, needle, entry);
  const double linear =
      BaseTangent(setting, needle, {}).norm_beyond(whitened_difference(setting, seen, views_of(setting, needle, {})));
  const double nonlinear = refit_base(setting, seen, needle, {}).sigmas;
  EXPECT_GT(nonlinear, 0.1);
  EXPECT_NEAR(nonlinear, linear, 0.15 * linear);
}

// At the edge of the model's domain (lambda1 above lambda2^2 / (2 pi)) the refit moves along it rather than stopping.
TEST(Visibility, TheRefitFollowsTheEdgeOfTheDomain) {
  const Setting setting = straight_setting({});
  const BaseNeedle needle;
  HiddenPhysics entry;
  entry.entry_about_x_rad = 0.004;
  const Views seen = views_of(setting, needle, entry);
  const Refit refit = refit_base(setting, seen, needle, {});
  EXPECT_TRUE(refit.converged);
  EXPECT_LT(refit.needle.lambda1_per_rad, 0.02);  // it is at the edge here
  for (const double change : {-0.02, 0.02}) {
    BaseNeedle near = refit.needle;
    near.lambda2 += change;
    near.lambda1_per_rad = near.lambda2 * near.lambda2 / 6.28318 + 1e-3;
    double best = 1e300;
    for (int i = -20; i <= 20; ++i) {
      near.curvature_per_mm = (1 + 0.004 * i) * refit.needle.curvature_per_mm;
      best = std::min(best, whitened_difference(setting, seen, views_of(setting, near, {})).norm());
    }
    EXPECT_GT(best, refit.sigmas - 0.01) << change;
  }
}

// min (x - 3)^2 + (x + y)^2 with x <= 2: x at its bound, y = -2.
TEST(BoundedFit, MovesAlongABound) {
  BoundedProblem problem{
      [](const Eigen::VectorXd& x) -> std::optional<Eigen::VectorXd> { return Eigen::Vector2d(x(0) - 3, x(0) + x(1)); },
      Eigen::Vector2d(-5, -5), Eigen::Vector2d(2, 5), Eigen::Vector2d(1e-4, 1e-4)};
  const BoundedFit fit = fit_in_box(problem, Eigen::Vector2d(0, 4), 30, 1e9);
  EXPECT_TRUE(fit.converged);
  EXPECT_NEAR(fit.point(0), 2, 1e-6);
  EXPECT_NEAR(fit.point(1), -2, 1e-4);
  EXPECT_NEAR(fit.norm, 1, 1e-6);
}

// What is a listed effect imitates itself, to nothing left; what does not turn cannot be backlash.
TEST(Rivals, AListedEffectIsItsOwnRival) {
  Setting setting = straight_setting({});
  setting.motions.pop_back();
  setting.frames.pop_back();
  setting.whiteners.pop_back();
  HiddenPhysics slip;
  slip.departure = 0;
  slip.insertion_ratio = 0.96;
  const auto rivals = find_rivals(setting, views_of(setting, {}, slip), {}, 5.0);
  std::map<std::string, double> by_name;
  for (const Rival& rival : rivals) by_name[rival.name] = rival.sigmas;
  ASSERT_TRUE(by_name.contains("insertion_scale"));
  EXPECT_LT(by_name["insertion_scale"], 0.5);
  EXPECT_FALSE(by_name.contains("rotation_backlash"));
  EXPECT_FALSE(by_name.contains("camera_latency"));
}

// A beam that inserts, stands turned half over, and goes on.
Setting flipped_setting() {
  Random random(22);
  const CameraNoise noise;
  Setting setting;
  setting.motions.push_back(follow({"flip", {{4, 10, 0}, {1, 0, 3.1}, {3, 10, 0}}}));
  setting.frames.push_back(draw_frames(noise, setting.motions.back().duration_s(), random));
  setting.whiteners.emplace_back(noise, setting.frames.back());
  return setting;
}

TEST(Visibility, TheClosestElasticBeamIsTheBeamItselfWhereNothingRelaxes) {
  const Setting setting = flipped_setting();
  model::BeamPlantConfig beam;
  beam.foundation_modulus_kPa = 8;
  beam.bevel_force_N = 0.9;
  beam.guide_gap_mm = 4;
  model::BeamPlantConfig start = beam;
  start.foundation_modulus_kPa = 11;
  start.bevel_force_N = 0.7;
  const ElasticFit fit = nearest_elastic(setting, views_of(setting, beam), start);
  EXPECT_LT(fit.sigmas, 0.2);
  EXPECT_NEAR(fit.beam.foundation_modulus_kPa, 8, 0.2);
  EXPECT_NEAR(fit.beam.bevel_force_N, 0.9, 0.02);
  // Hetenyi's lambda, by hand: (4 * 1.6e4 / 0.008)^(1/4) mm.
  EXPECT_NEAR(swing_of(beam).at("bending_mm"), 53.18, 0.01);
}

TEST(Visibility, TissueThatRelaxesIsNoElasticTissue) {
  const Setting setting = flipped_setting();
  model::BeamPlantConfig beam;
  beam.foundation_modulus_kPa = 5;
  beam.bevel_force_N = 1.2;
  beam.relaxing_fraction = 0.4;
  beam.relaxation_time_s = 1.5;
  const ElasticFit fit = nearest_elastic(setting, views_of(setting, beam), beam);
  EXPECT_EQ(fit.beam.relaxing_fraction, 0);
  EXPECT_GT(fit.sigmas, 1);
}

}  // namespace
}  // namespace bevel::proof
