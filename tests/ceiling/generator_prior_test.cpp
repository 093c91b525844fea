// SPDX-License-Identifier: MIT
// The generator's density of sizes against draws: its own catalogue's, scaled as docs/proof/distribution.md says.
#include "tests/ceiling/generator_prior.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/ceiling/trial_case.hpp"

namespace bevel::ceiling {
namespace {

using Eigen::VectorXd;

const proof::EffectKind& kind_named(const std::string& name) {
  return *std::ranges::find_if(proof::catalogue(), [&](const proof::EffectKind& kind) { return kind.name == name; });
}

// One draw of a size's distance from neutral, where `sigmas_per_unit` of it can be seen.
double draw(const proof::EffectKind& kind, std::size_t size, bool listed, double sigmas_per_unit,
            proof::Random& random) {
  const proof::ParameterRange& range = kind.parameters[size];
  double value = random.uniform(range.low, range.high);
  if (range.either_sign) value *= random.sign();
  value -= range.neutral;
  if (random.chance(0.5)) return value;
  const double target = listed ? random.log_uniform(1.5, 25) : random.log_uniform(4, 60);
  return value * std::clamp(target / (std::abs(value) * sigmas_per_unit), kind.least_factor, 1.5);
}

struct Case {
  const char* kind;
  std::size_t size;
  double sigmas_per_unit;
};

TEST(GeneratorPrior, SharesOfDrawsAreIntegralsOfTheDensity) {
  // Scaled ones small, in the range's middle, and mostly at the largest factor.
  for (const Case& one : {Case{"insertion_backlash", 0, 60}, Case{"insertion_backlash", 0, 6},
                          Case{"insertion_scale", 0, 900}, Case{"depth_dependence", 0, 20}, Case{"fibres", 0, 40},
                          Case{"stick_slip", 0, 5}, Case{"camera_drift", 0, 1500}}) {
    SCOPED_TRACE(one.kind);
    const proof::EffectKind& kind = kind_named(one.kind);
    const proof::ParameterRange& range = kind.parameters[one.size];
    const SizePrior prior({range}, kind.listed, kind.least_factor);
    const double reach = 1.6 * std::max(std::abs(range.low - range.neutral), std::abs(range.high - range.neutral));
    constexpr int kDraws = 40000, kBins = 12, kInside = 4000;
    proof::Random random(5);
    std::vector<int> counts(kBins, 0);
    for (int i = 0; i < kDraws; ++i) {
      const double s = draw(kind, one.size, kind.listed, one.sigmas_per_unit, random);
      ++counts[static_cast<std::size_t>(std::clamp<double>(std::floor((s / reach + 1) / 2 * kBins), 0, kBins - 1))];
    }
    double all = 0;
    for (int bin = 0; bin < kBins; ++bin) {
      double share = 0;
      const double width = 2 * reach / kBins / kInside;
      for (int i = 0; i < kInside; ++i) {
        const double s = -reach + 2 * reach * bin / kBins + (i + 0.5) * width;
        share += width * prior.density(VectorXd::Constant(1, s), std::abs(s) * one.sigmas_per_unit);
      }
      all += share;
      // Five standard deviations of a count, and what the grid cannot resolve.
      const double expected = kDraws * share;
      EXPECT_NEAR(counts[static_cast<std::size_t>(bin)], expected, 5 * std::sqrt(expected + 1) + 0.002 * kDraws)
          << "bin " << bin;
    }
    EXPECT_NEAR(all, 1, 0.005);
  }
}

TEST(GeneratorPrior, TwoSizesHaveMassOneAltogether) {
  const proof::EffectKind& kind = kind_named("entry_angle");
  const SizePrior prior({kind.parameters[0], kind.parameters[1]}, true, kind.least_factor);
  // Of four alike quarters one; polar, since the density of scaled ones rises toward the origin.
  double mass = 0;
  constexpr int kAngles = 400, kRadii = 4000;
  const double largest = 1.5 * std::hypot(0.06, 0.06), sigmas_per_unit = 300;
  for (int i = 0; i < kAngles; ++i)
    for (int j = 0; j < kRadii; ++j) {
      const double angle = (i + 0.5) / kAngles * M_PI / 2, radius = (j + 0.5) / kRadii * largest;
      mass +=
          prior.density(Eigen::Vector2d(radius * std::cos(angle), radius * std::sin(angle)), radius * sigmas_per_unit) *
          radius * (largest / kRadii) * (M_PI / 2 / kAngles);
    }
  EXPECT_NEAR(4 * mass, 1, 0.01);
}

TEST(GeneratorPrior, AnEffectOnNoListHasTheOddsOfOneEffect) {
  testing::NoiseFree made(31, false);
  const auto needle = made.seen(proof::views_of(made.setting, made.trial.truth.needle, {}));
  const GeneratorSystem system(needle, made.trial);
  // More than the library has, whose own effects tell nothing of these.
  ASSERT_GT(system.effects().size(), needle.effects().size());
  for (std::size_t e = 0; e < system.effects().size(); ++e) {
    const double kinds = system.effects()[e].name == "lost_steps" ? 2 : 1;
    EXPECT_NEAR(log_prior_of(system, {e}, -5), -5 - std::log(kinds), 1e-12) << system.effects()[e].label;
  }
  EXPECT_NEAR(log_prior_of(system, {0, system.effects().size() - 1}, -5), -10, 1e-12);
}

}  // namespace
}  // namespace bevel::ceiling
