// SPDX-License-Identifier: MIT
// What a model file says beside the needle and its effects: discrepancies and variation. Round trips, and the mistakes
// that can be made in them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include <bevel/error.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::io {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kNeedle = R"([needle]
curvature_per_mm = 0.0047
wheelbase_mm = 20.0
lambda1_per_rad = 0.49
lambda2 = 0.22
)";

constexpr const char* kUncertain = R"(
[[effect]]
name = "torsional_windup"
lag_at_100mm_rad = 0.6
[[discrepancy]]
component = "curvature_bevel"
covariate = "depth_mm"
knots = [0, 40.0, 80.0]
values = [0.0, 4e-4, -5e-4]
std_errors = [1e-5, 2e-5, 0]
[[discrepancy]]
component = "z"
covariate = "time_s"
knots = [1.0]
values = [-0.3]
std_errors = [0.1]
[variation]
curvature_relative = 0.05
roll_rad = 0.04
)";

std::string fault_of(const std::string& text) {
  try {
    parse_model_file(std::string(kNeedle) + text, "m.toml");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(ModelUncertainty, is_read) {
  const ModelFile model = parse_model_file(std::string(kNeedle) + kUncertain, "m.toml");
  ASSERT_EQ(model.discrepancies.size(), 2U);
  EXPECT_EQ(model.discrepancies[0].component, model::DiscrepancyComponent::curvature_bevel);
  EXPECT_EQ(model.discrepancies[0].covariate, model::Covariate::depth_mm);
  EXPECT_THAT(model.discrepancies[0].at, ElementsAre(0, 40, 80));
  EXPECT_THAT(model.discrepancies[0].values, ElementsAre(0, 4e-4, -5e-4));
  EXPECT_THAT(model.discrepancies[0].std_errors, ElementsAre(1e-5, 2e-5, 0));
  EXPECT_FALSE(model.discrepancies[0].periodic);
  EXPECT_EQ(model.discrepancies[1].component, model::DiscrepancyComponent::z);
  EXPECT_EQ(model.variation, (model::Variation{.curvature_relative = 0.05, .roll_rad = 0.04}));
  // Whoever takes the effects has the discrepancies with them.
  const auto active = active_effects(model, "");
  ASSERT_EQ(active.size(), 3U);
  EXPECT_EQ(active[0].effect, model::find_effect("torsional_windup"));
  EXPECT_EQ(active[2].effect->covariate(), model::Covariate::time_s);

  const ModelFile plain = parse_model_file(kNeedle, "m.toml");
  EXPECT_TRUE(plain.discrepancies.empty());
  EXPECT_FALSE(plain.variation.has_value());
}

TEST(ModelUncertainty, reads_back_as_written_to_the_last_bit) {
  ModelFile model;
  for (const auto& info : model::discrepancy_components()) {
    if (model.discrepancies.size() == model::kMaxEffects) model.discrepancies.clear();
    for (const model::Covariate covariate : model::all_covariates()) {
      if (!model::goes_over(info.component, covariate)) continue;
      model::DiscrepancyCurve curve;
      curve.component = info.component;
      curve.covariate = covariate;
      curve.periodic = covariate == model::Covariate::roll_rad;
      for (int i = 0; i < 8; ++i) {
        curve.at.push_back(curve.periodic ? std::numbers::pi * i / 4 : i / 3.0 - 1);
        curve.values.push_back(info.largest * (i - 4) / 7);
        curve.std_errors.push_back(info.largest * i / 21);
      }
      model.discrepancies = {curve};
      model.variation = model::Variation{1.0 / 3, 0.1 / 7, 1.0 / 9, 0.2 / 3};
      EXPECT_EQ(parse_model_file(to_toml(model), "written"), model) << to_toml(model);
    }
  }
  // An angle that is followed through its turns.
  model.discrepancies[0] = {.component = model::DiscrepancyComponent::x,
                            .covariate = model::Covariate::roll_rad,
                            .at = {-7, 20},
                            .values = {0, 1e-300},
                            .std_errors = {0, 1.0 / 3}};
  model.variation.reset();
  EXPECT_EQ(parse_model_file(to_toml(model), "written"), model) << to_toml(model);
  // Nothing there, nothing written.
  EXPECT_EQ(to_toml(ModelFile{}).find("discrepancy"), std::string::npos);
  EXPECT_EQ(to_toml(ModelFile{}).find("variation"), std::string::npos);
  model.variation = model::Variation{};
  EXPECT_EQ(parse_model_file(to_toml(model), "written"), model);  // known not to differ
}

// A discrepancy with one of its lines replaced, or left out.
std::string discrepancy_fault(const std::string& key, const std::string& line) {
  std::string text = "[[discrepancy]]\n";
  const std::pair<const char*, const char*> lines[] = {{"component", "component = \"drift_bevel\""},
                                                       {"covariate", "covariate = \"depth_mm\""},
                                                       {"knots", "knots = [0.0, 10.0]"},
                                                       {"values", "values = [0.01, 0.02]"},
                                                       {"std_errors", "std_errors = [0.001, 0.002]"}};
  for (const auto& [name, given] : lines) text += (name == key ? line : given) + std::string("\n");
  return fault_of(text);
}

TEST(ModelUncertainty, mistakes_in_a_discrepancy_are_named) {
  ASSERT_EQ(discrepancy_fault("", ""), "");
  for (const char* key : {"component", "covariate", "knots", "values", "std_errors"})
    EXPECT_THAT(discrepancy_fault(key, ""), HasSubstr("discrepancy[0]." + std::string(key) + " is missing")) << key;
  EXPECT_THAT(discrepancy_fault("component", "component = \"drift_bevl\""),
              AllOf(HasSubstr("unknown component \"drift_bevl\"; the nearest known is \"drift_bevel\""),
                    HasSubstr("turning_turning"), HasSubstr("curvature_across")));
  EXPECT_THAT(discrepancy_fault("component", "component = \"\""),
              HasSubstr("discrepancy[0].component: is empty; a component is wanted"));
  EXPECT_THAT(discrepancy_fault("component", "component = 3"), HasSubstr("discrepancy[0].component = 3 is"));
  EXPECT_THAT(discrepancy_fault("covariate", "covariate = \"depth\""),
              AllOf(HasSubstr("unknown covariate \"depth\""), HasSubstr("since_reversal_mm")));
  EXPECT_THAT(discrepancy_fault("knots", "knots = [10.0, 10.0]"),
              HasSubstr("knots: element 1 = 10 does not lie above the one before, 10; they have to ascend"));
  EXPECT_THAT(discrepancy_fault("knots", "knots = [0.0, nan]"), HasSubstr("discrepancy[0].knots: element 1 = nan"));
  EXPECT_THAT(discrepancy_fault("knots", "knots = []"), HasSubstr("has 0 elements; allowed: from 1 to 64"));
  EXPECT_THAT(discrepancy_fault("knots", "knots = [0.0, 10.0, 20.0]"),
              HasSubstr("values has 2 elements; allowed: 3, one a knot"));
  EXPECT_THAT(discrepancy_fault("values", "values = [0.01, 9.0]"),
              HasSubstr("discrepancy[0].values: element 1 = 9 is not allowed; allowed: from -5 to 5"));
  EXPECT_THAT(discrepancy_fault("values", "values = [0.01]"), HasSubstr("values has 1 elements"));
  EXPECT_THAT(discrepancy_fault("values", "values = \"none\""), HasSubstr("an array of numbers is wanted"));
  EXPECT_THAT(discrepancy_fault("std_errors", "std_errors = [0.001, -0.001]"),
              HasSubstr("discrepancy[0].std_errors: element 1 = -0.001 is not allowed; allowed: from 0 to 5"));
  EXPECT_THAT(discrepancy_fault("std_errors", "std_errors = [0.001]"), HasSubstr("std_errors has 1 elements"));
  EXPECT_THAT(discrepancy_fault("values", "values = [0.01, 0.02]\nvalue = 1.0"),
              HasSubstr("unknown key discrepancy[0].value; the nearest known key is discrepancy[0].values"));
  EXPECT_THAT(discrepancy_fault("values", "values = [0.01, 0.02]\nperiodic = true"),
              HasSubstr("periodic is true, but depth_mm is no angle"));
  EXPECT_THAT(
      discrepancy_fault("covariate", "covariate = \"roll_rad\""),
      HasSubstr("knots: element 1 = 10 is not allowed; those of a periodic curve divide the circle: 3.14159265"));
}

TEST(ModelUncertainty, effects_and_discrepancies_share_their_number) {
  std::string text;
  for (int i = 0; i < 7; ++i) text += "[[effect]]\nname = \"slip_direction\"\n";
  const std::string one =
      "[[discrepancy]]\ncomponent = \"x\"\ncovariate = \"time_s\"\nknots = [0.0]\nvalues = [0.0]\n"
      "std_errors = [0.1]\n";
  EXPECT_EQ(fault_of(text + one), "");
  EXPECT_THAT(fault_of(text + one + one),
              HasSubstr("discrepancy: there are 2 beside 7 effects; at most 8 are allowed together"));
}

TEST(ModelUncertainty, mistakes_in_the_variation_are_named) {
  EXPECT_EQ(fault_of("[variation]\nroll_rad = 0.0\n"), "");
  EXPECT_THAT(fault_of("[variation]\nroll_rad = -0.1\n"),
              HasSubstr("variation.roll_rad = -0.1 is not allowed; allowed: from 0 to 3.2"));
  EXPECT_THAT(fault_of("[variation]\ncurvature_relative = 1.5\n"), HasSubstr("allowed: from 0 to 1"));
  EXPECT_THAT(fault_of("[variation]\nentry_angle_rad = 0.7\n"), HasSubstr("allowed: from 0 to 0.5"));
  EXPECT_THAT(fault_of("[variation]\nentry_point_mm = inf\n"), HasSubstr("variation.entry_point_mm = inf"));
  EXPECT_THAT(fault_of("[variation]\nentry_angle_deg = 0.4\n"),
              HasSubstr("unknown key variation.entry_angle_deg; the nearest known key is variation.entry_angle_rad"));
  EXPECT_THAT(fault_of("[[variation]]\nroll_rad = 0.1\n"), HasSubstr("variation"));
}

}  // namespace
}  // namespace bevel::io
