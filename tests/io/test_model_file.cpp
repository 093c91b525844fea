// The model file: round trips and the mistakes that can be made in one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "io/model_file.hpp"

namespace bevel::io {
namespace {

using ::testing::HasSubstr;

constexpr const char* kAgar = R"([needle]
curvature_per_mm = 0.0047
wheelbase_mm = 20.0
lambda1_per_rad = 0.49
lambda2 = 0.22
slip = "bevel-plane"
front_wheel = "nonslip"

[[effect]]
name = "torsional_windup"
lag_at_100mm_rad = 0.6
[[effect]]
name = "slip_direction"
)";

std::string fault_of(const std::string& text) {
  try {
    parse_model_file(text, "m.toml");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string needle_with(const std::string& key, const std::string& value) {
  std::string text = "[needle]\n";
  const std::pair<const char*, const char*> defaults[] = {
      {"curvature_per_mm", "0.0047"}, {"wheelbase_mm", "20.0"}, {"lambda1_per_rad", "0.49"}, {"lambda2", "0.22"}};
  for (const auto& [name, given] : defaults) text += std::string(name) + " = " + (key == name ? value : given) + "\n";
  return text;
}

TEST(ModelFile, reads_needle_and_effects) {
  const ModelFile model = parse_model_file(kAgar, "agar.toml");
  EXPECT_DOUBLE_EQ(model.needle.lambda1_per_rad, 0.49);
  EXPECT_EQ(model.needle.slip, model::SlipDirection::bevel_plane);
  EXPECT_EQ(model.needle.front_wheel, model::FrontWheel::nonslip);
  ASSERT_EQ(model.effects.size(), 2U);
  EXPECT_DOUBLE_EQ(model.effects[0].parameters.at("lag_at_100mm_rad"), 0.6);
  EXPECT_TRUE(model.effects[1].parameters.empty());
}

TEST(ModelFile, saves_what_it_loads_to_the_last_bit) {
  ModelFile model = parse_model_file(kAgar, "agar.toml");
  model.needle.curvature_per_mm = 0.1 / 21.0;
  model.needle.lambda1_per_rad = 1.0 / 3.0;
  model.effects[0].parameters["lag_at_100mm_rad"] = 1e-7;
  const std::string path = (std::filesystem::temp_directory_path() / "bevel-test-model.toml").string();
  save_model_file(model, path);
  EXPECT_EQ(load_model_file(path), model);
  std::filesystem::remove(path);
  EXPECT_THAT(to_toml(model), HasSubstr("wheelbase_mm = 20.0"));  // a float to other readers too
  EXPECT_THROW(save_model_file(model, "/nonexistent/m.toml"), std::runtime_error);
}

TEST(ModelFile, mistakes_are_named) {
  EXPECT_THAT(fault_of(std::string(kAgar) + "[[effect]]\nname = \"torsional_windupp\"\n"),
              HasSubstr("nearest known is \"torsional_windup\""));
  EXPECT_THAT(fault_of(std::string(kAgar) + "[[effect]]\nlag = 1\n"), HasSubstr("effect[2].name is missing"));
  EXPECT_THAT(fault_of(std::string(kAgar) + "[efect]\n"),
              HasSubstr("unknown key efect; the nearest known key is effect"));
  EXPECT_THAT(fault_of(needle_with("curvature_per_mm", "0.06")), HasSubstr("from -0.05 to 0.05"));
  EXPECT_THAT(fault_of(needle_with("wheelbase_mm", "0.5")), HasSubstr("needle.wheelbase_mm = 0.5"));
  EXPECT_THAT(fault_of(needle_with("lambda2", "nan")), HasSubstr("needle.lambda2 = nan"));
}

TEST(ModelFile, parameters_outside_the_models_domain_are_refused) {
  EXPECT_EQ(fault_of(needle_with("lambda2", "0.22")), "");
  EXPECT_THAT(fault_of(needle_with("lambda1_per_rad", "0.001")), HasSubstr("needle: "));  // (26)
  EXPECT_THAT(fault_of(needle_with("lambda1_per_rad", "30.0")), HasSubstr("needle: "));   // (24)
}

}  // namespace
}  // namespace bevel::io
