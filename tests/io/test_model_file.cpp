// SPDX-License-Identifier: MIT
// The model file: round trips and the mistakes that can be made in one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bevel/error.hpp>
#include <bevel/io/model_file.hpp>
#include "tests/support/temporary_folder.hpp"

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
  const test::TemporaryFolder folder;
  const std::string path = (folder / "model.toml").string();
  save_model_file(model, path);
  EXPECT_EQ(load_model_file(path), model);
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

std::string effect_fault(const std::string& effect) { return fault_of(needle_with("", "") + "[[effect]]\n" + effect); }

TEST(ModelFile, mistakes_in_effects_are_named) {
  EXPECT_THAT(effect_fault("name = \"torsional_windup\"\nlag_at_10mm_rad = 0.6\n"),
              HasSubstr("unknown key effect[0].lag_at_10mm_rad; the nearest known key is effect[0].lag_at_100mm_rad"));
  EXPECT_THAT(effect_fault("name = \"torsional_windup\"\nlag_at_100mm_rad = -0.6\n"),
              HasSubstr("effect[0].lag_at_100mm_rad = -0.6 is not allowed; allowed: from 0 to 4"));
  EXPECT_THAT(effect_fault("name = \"torsional_windup\"\nlag_at_100mm_rad = \"big\"\n"),
              HasSubstr("a number is wanted"));
  EXPECT_THAT(effect_fault("name = \"torsional_windup\"\n"), HasSubstr("lag_at_100mm_rad is required"));
  EXPECT_THAT(effect_fault("name = \"layer\"\ncurvature_ratio = 0.8\n"), HasSubstr("effect[0].depth_mm is missing"));
  EXPECT_THAT(effect_fault("name = \"lost_steps\"\nat_s = 2.0\n"),
              HasSubstr("rotation_rad or insertion_mm is required"));
  EXPECT_THAT(effect_fault("name = \"layer\"\ndepth_mm = 9.0\ncurvature_ratio = 0.8\n[effect.recordings.a]\n"),
              HasSubstr("unknown key effect[0].recordings"));
  EXPECT_THAT(effect_fault("name = \"lost_steps\"\nrotation_rad = 0.8\n[effect.recordings.\"a.lcm\"]\nat = 3.0\n"),
              HasSubstr("unknown key effect[0].recordings.a.lcm.at; the nearest known key is"));
  EXPECT_THAT(effect_fault("name = \"lost_steps\"\nrotation_rad = 0.8\n[effect.recordings.\"a.lcm\"]\nat_s = -3.0\n"),
              HasSubstr("effect[0].recordings.a.lcm.at_s = -3 is not allowed"));
  std::string many = needle_with("", "");
  for (int i = 0; i <= model::kMaxEffects; ++i) many += "[[effect]]\nname = \"slip_direction\"\n";
  EXPECT_THAT(fault_of(many), HasSubstr("at most 8 are allowed"));
}

constexpr const char* kPerRecording = R"(
[[effect]]
name = "tissue_motion"
amplitude_mm = 0.5
frequency_hz = 0.25
direction_rad = 1.0
phase_rad = 2.0
[effect.recordings."rec03.lcm"]
phase_rad = 1.5
[[effect]]
name = "lost_steps"
rotation_rad = 0.8
[effect.recordings."odd \"name\".lcm"]
at_s = 3.31
)";

TEST(ModelFile, unknowns_of_one_recording_stand_apart) {
  const ModelFile model = parse_model_file(needle_with("", "") + kPerRecording, "m.toml");
  EXPECT_EQ(parse_model_file(to_toml(model), "again.toml"), model) << to_toml(model);
  const auto value = [&](std::string_view recording, std::size_t effect, std::size_t parameter) {
    return active_effects(model, recording).at(effect).parameters.at(parameter).value;
  };
  EXPECT_EQ(value("/some/where/rec03.lcm", 0, 3), 1.5);
  EXPECT_EQ(value("rec04.lcm", 0, 3), 2.0);
  EXPECT_EQ(value("rec04.lcm", 1, 2), 0.0);
  EXPECT_EQ(value("odd \"name\".lcm", 1, 2), 3.31);
  EXPECT_EQ(value("", 1, 0), 0.8);
  EXPECT_EQ(value("", 1, 1), 0.0);  // left out: none
  EXPECT_EQ(active_effects(model, "").at(0).effect, model::find_effect("tissue_motion"));
}

// Several logs of one name are told apart by their folders (tools/diagnose/read_case.hpp).
TEST(ModelFile, a_recording_is_meant_by_as_much_of_its_path_as_the_file_names) {
  const char* text = R"(
[[effect]]
name = "lost_steps"
rotation_rad = 0.8
[effect.recordings."insertion.lcm"]
at_s = 1.0
[effect.recordings."b/insertion.lcm"]
at_s = 2.0
)";
  const ModelFile model = parse_model_file(needle_with("", "") + text, "m.toml");
  EXPECT_EQ(parse_model_file(to_toml(model), "again.toml"), model) << to_toml(model);
  const auto at_s = [&](std::string_view recording) {
    return active_effects(model, recording).at(0).parameters.at(2).value;
  };
  EXPECT_EQ(at_s("/a/insertion.lcm"), 1);
  EXPECT_EQ(at_s("/x/b/insertion.lcm"), 2);
  EXPECT_EQ(at_s("b/insertion.lcm"), 2);
  EXPECT_EQ(at_s("/xb/insertion.lcm"), 1) << "another folder's name only ends like it";
  EXPECT_EQ(at_s("/b/my_insertion.lcm"), 0) << "another log's name only ends like it";
}

TEST(ModelFile, every_effect_of_the_registry_is_read_back_as_written) {
  for (const model::Effect* effect : model::all_effects()) {
    ModelFile model;
    auto& entry = model.effects.emplace_back(EffectEntry{.name = std::string(effect->name())});
    for (const auto& p : effect->parameters()) entry.parameters.emplace(p.name, p.lower + (p.upper - p.lower) / 3.0);
    EXPECT_EQ(parse_model_file(to_toml(model), entry.name), model);
    const auto active = active_effects(model, "");
    ASSERT_EQ(active.size(), 1U);
    for (std::size_t i = 0; const auto& p : effect->parameters())
      EXPECT_EQ(active[0].parameters.at(i++).value, entry.parameters.at(std::string(p.name)));
  }
}

TEST(ModelFile, effects_made_in_code_are_checked_too) {
  EXPECT_THROW(active_effects({EffectEntry{.name = "gravity"}}, ""), bevel::ArgumentError);
  EXPECT_THROW(active_effects({EffectEntry{.name = "layer"}}, ""), bevel::ArgumentError);
  EXPECT_THROW(active_effects({EffectEntry{.name = "drilling", .parameters = {{"size", 1.0}}}}, ""),
               bevel::ArgumentError);
}

TEST(ModelFile, parameters_outside_the_models_domain_are_refused) {
  EXPECT_EQ(fault_of(needle_with("lambda2", "0.22")), "");
  EXPECT_THAT(fault_of(needle_with("lambda1_per_rad", "0.001")), HasSubstr("needle: "));  // (26)
  EXPECT_THAT(fault_of(needle_with("lambda1_per_rad", "30.0")), HasSubstr("needle: "));   // (24)
}

}  // namespace
}  // namespace bevel::io
