// SPDX-License-Identifier: MIT
// Insertions that differ: what each has of its own, and each predicted as a new one and continued from its first third.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <bevel/diagnosis/mismatch/diagnose.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

constexpr int kRecordings = 8;
constexpr double kTilt_rad = 0.01, kEntry_mm = 0.3;

struct Own {
  double tilt_x_rad, tilt_y_rad, entry_x_mm, entry_y_mm;
};

std::vector<Own> draw(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Own> out(kRecordings);
  for (Own& one : out)
    for (double* value : {&one.tilt_x_rad, &one.tilt_y_rad, &one.entry_x_mm, &one.entry_y_mm})
      *value = (value == &one.tilt_x_rad || value == &one.tilt_y_rad ? kTilt_rad : kEntry_mm) * normal(random);
  return out;
}

Findings findings_of(const std::vector<Own>& own, std::uint64_t seed) {
  const SimulatedRig rig{.effects_in =
                             [&](int r) {
                               const Own& one = own[static_cast<std::size_t>(r)];
                               return std::vector{active("entry_angle", {one.tilt_x_rad, one.tilt_y_rad}),
                                                  active("entry_point", {one.entry_x_mm, one.entry_y_mm})};
                             },
                         .recordings = kRecordings,
                         .sigma_mm = {0.1, 0.1, 0.13},
                         .ar1 = 0.6};
  return diagnose(record_case(rig, seed), rig.needle, {});
}

// Strongly bent needles whose shafts never turn, rolled by up to 40 degrees, with headings.
TEST(Insertions, RolledByManyDegreesGiveTheCurvature) {
  model::NeedleParameters needle = model::testing::bicycle();
  needle.curvature_per_mm = 0.010;
  const SimulatedRig rig{.needle = needle,
                         .effects_in =
                             [](int r) {
                               constexpr std::array kRoll_rad{0.7, -0.7, 0.55, -0.6};
                               return std::vector{active("bevel_offset", {kRoll_rad.at(static_cast<std::size_t>(r))})};
                             },
                         .recordings = 4,
                         .frame_s = 0.1,
                         .sigma_mm = {0.1, 0.1, 0.1},
                         .heading_sd_rad = 0.003,
                         .script =
                             [](int) {
                               return model::testing::Script{{14, 5, 0}};
                             }};
  model::NeedleParameters in_use = needle;
  in_use.curvature_per_mm = 0.012;
  const Findings found = diagnose(record_case(rig, 1), in_use, {});
  EXPECT_EQ(found.verdict, Verdict::nothing_missing) << found.sentence;
  EXPECT_NEAR(found.needle.value.curvature_per_mm, 0.010, 4 * found.needle.curvature_sd_per_mm);
  EXPECT_FALSE(found.needle.slip_determined);
  EXPECT_NEAR(found.needle.value.lambda2, in_use.lambda2, 1e-3);
  for (const auto& v : found.variation) EXPECT_EQ(v.at_end, v.name == "roll") << v.name << ' ' << v.sd;
}

// Two rigs, so that a share has readings enough: 16 insertions.
TEST(Insertions, TheirOwnValuesAreFoundAndTheirIntervalsHold) {
  double squares = 0, inside = 0, count = 0, readings = 0, new_in_95 = 0, continued_in_95 = 0;
  for (const std::uint64_t seed : {3, 4}) {
    const auto own = draw(seed);
    const Findings found = findings_of(own, seed);
    ASSERT_EQ(found.verdict, Verdict::nothing_missing) << found.sentence;
    ASSERT_EQ(found.insertions.size(), static_cast<std::size_t>(kRecordings));
    for (std::size_t r = 0; r < own.size(); ++r) {
      const InsertionValues& one = found.insertions[r];
      EXPECT_EQ(one.log, found.traces[r].log);
      const auto look = [&](const char* name, double truth, double size) {
        const auto v =
            std::find_if(one.values.begin(), one.values.end(), [&](const auto& i) { return i.name == name; });
        ASSERT_NE(v, one.values.end()) << name;
        squares += std::pow((v->value - truth) / v->std_error, 2);
        inside += v->ci95[0] < truth && truth < v->ci95[1] ? 1 : 0;
        ++count;
        EXPECT_LT(v->std_error, size) << name;  // the recording itself says more than that insertions differ
      };
      look("tilt_x_rad", own[r].tilt_x_rad, 0.7 * kTilt_rad);
      look("tilt_y_rad", own[r].tilt_y_rad, 0.7 * kTilt_rad);
      look("entry_x_mm", own[r].entry_x_mm, 0.7 * kEntry_mm);
      look("entry_y_mm", own[r].entry_y_mm, 0.7 * kEntry_mm);
    }
    const InsertionPredicted& predicted = found.held_out.predicted_after;
    EXPECT_EQ(predicted.beyond.readings, predicted.continued.readings);
    EXPECT_NEAR(static_cast<double>(predicted.beyond.readings) / static_cast<double>(predicted.whole.readings), 2.0 / 3,
                0.02);
    // Its first third tells where it goes: near to the noise, which a new insertion is far from.
    EXPECT_LT(predicted.continued.rmse_mm, 2 * found.held_out.noise_floor.rmse_mm);
    EXPECT_GT(predicted.beyond.rmse_mm, 2.5 * predicted.continued.rmse_mm);
    EXPECT_GT(predicted.continued.log_density, predicted.beyond.log_density + 0.01);
    for (const ChannelFigures& channel : predicted.continued.channels) EXPECT_GT(channel.share_in_95, 0.85);
    // As the older figures have it, of the same errors, but for what these few insertions happen to have in common.
    EXPECT_NEAR(predicted.whole.rmse_mm / found.held_out.after.rmse_mm, 1, 0.15);
    const auto n = static_cast<double>(predicted.beyond.readings);
    readings += n;
    new_in_95 += n * predicted.beyond.share_in_95;
    continued_in_95 += n * predicted.continued.share_in_95;
  }
  // 64 values, of which tilts of one recording hang together a little: chi2 of one within four standard deviations.
  EXPECT_NEAR(squares / count, 1, 4 * std::sqrt(2 / count));
  EXPECT_GT(inside / count, 0.86);
  EXPECT_NEAR(new_in_95 / readings, 0.95, 0.05);  // 16 insertions, each off as a whole
  EXPECT_NEAR(continued_in_95 / readings, 0.95, 0.02);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
