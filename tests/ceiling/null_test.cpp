// SPDX-License-Identifier: MIT
// Where nothing is concealed, the generator and the library are one model in two forms: the same evidence.
#include <gmock/gmock.h>

#include <bevel/diagnosis/inference/calibrate.hpp>
#include <bevel/diagnosis/inference/evidence.hpp>
#include "tests/ceiling/generator_system.hpp"
#include "tests/ceiling/trial_case.hpp"

namespace bevel::ceiling {
namespace {

double log_evidence(const inference::System& system, const inference::Calibration& calibration,
                    const inference::Fit& begin) {
  const inference::Likelihood likelihood(system, calibration.outliers, calibration.noise);
  const auto at = inference::evaluate(likelihood, inference::Layout(system, {}), begin.shared, begin.local,
                                      inference::middle_nuisance_sd(system));
  EXPECT_TRUE(at.valid);
  return at.log_evidence;
}

TEST(Ceiling, ByTheNullTheTwoFormsAreAlike) {
  // What the drives' periodic errors and the integrators leave: far below the odds of one effect, exp(5).
  constexpr double kAlike = 0.5;
  for (const std::uint64_t seed : {31U, 32U}) {
    testing::NoiseFree made(seed, seed == 32);
    auto views = proof::views_of(made.setting, made.trial.truth.needle, {});
    for (std::size_t r = 0; r < views.size(); ++r) views[r] += made.setting.frames[r].noise_mm;
    const auto needle = made.seen(views);
    const GeneratorSystem generator(needle, made.trial);
    const auto calibration = inference::calibrate(needle);
    const auto begin = inference::tempered_base(needle, calibration.outliers, calibration.noise);
    const double library = log_evidence(needle, calibration, begin);
    EXPECT_NEAR(log_evidence(generator, calibration, begin), library, kAlike) << "seed " << seed;
    // A needle of another wheelbase is another model; the comparison would show it.
    made.trial.truth.needle.wheelbase_mm = 60;
    const GeneratorSystem wrong(needle, made.trial);
    EXPECT_LT(log_evidence(wrong, calibration, begin), library - kAlike) << "seed " << seed;
  }
}

}  // namespace
}  // namespace bevel::ceiling
