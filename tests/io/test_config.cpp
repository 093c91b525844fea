// SPDX-License-Identifier: MIT
// The typed configuration: what is read, and what each kind of mistake is answered with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bevel/error.hpp>
#include <bevel/io/config.hpp>

namespace bevel::io {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

enum class Slip { isotropic, bevel_plane };

struct Camera {
  int id = 0;
  double rate_hz = 30.0;
};

struct Settings {
  double curvature_per_mm = 0.0;
  double wheelbase_mm = 20.0;
  int count = 3;
  bool enabled = true;
  std::string title = "none";
  Slip slip = Slip::isotropic;
  std::array<double, 3> origin_mm{1.0, 2.0, 3.0};
  std::vector<double> lags{};
  std::vector<Camera> cameras{};
};

Settings read_settings(const std::string& text) {
  ConfigFile file = ConfigFile::parse(text, "test.toml");
  Settings settings;
  Section needle = file.section("needle", required);
  needle.read("curvature_per_mm", settings.curvature_per_mm, required, in_range(-0.05, 0.05));
  needle.read("wheelbase_mm", settings.wheelbase_mm, optional, above(0.0));
  needle.read("count", settings.count, optional, in_range(1, 10));
  needle.read("enabled", settings.enabled, optional);
  needle.read("title", settings.title, optional);
  needle.read("slip", settings.slip, optional,
              Choices<Slip>{{"isotropic", Slip::isotropic}, {"bevel-plane", Slip::bevel_plane}});
  needle.read("origin_mm", settings.origin_mm, optional, in_range(-100, 100));
  needle.read("lags", settings.lags, optional, any_finite(), in_range(0, 2));
  for (Section& section : file.sections("camera", optional)) {
    Camera camera;
    section.read("id", camera.id, required, at_least(0));
    section.read("rate_hz", camera.rate_hz, optional, above(0.0));
    settings.cameras.push_back(camera);
  }
  file.finish();
  return settings;
}

std::vector<std::string> faults_of(const std::string& text) {
  try {
    read_settings(text);
  } catch (const ConfigError& error) {
    return error.messages();
  }
  return {};
}

TEST(Config, reads_every_type) {
  const Settings settings = read_settings(R"([needle]
curvature_per_mm = 0.0047
wheelbase_mm = 25        # a whole number is a number
count = 7
enabled = false
title = "agar"
slip = "bevel-plane"
origin_mm = [0, 0.5, -1]
lags = [0.25]
[[camera]]
id = 4
[[camera]]
id = 5
rate_hz = 60.0
)");
  EXPECT_DOUBLE_EQ(settings.curvature_per_mm, 0.0047);
  EXPECT_DOUBLE_EQ(settings.wheelbase_mm, 25.0);
  EXPECT_EQ(settings.count, 7);
  EXPECT_FALSE(settings.enabled);
  EXPECT_EQ(settings.title, "agar");
  EXPECT_EQ(settings.slip, Slip::bevel_plane);
  EXPECT_THAT(settings.origin_mm, ElementsAre(0.0, 0.5, -1.0));
  EXPECT_THAT(settings.lags, ElementsAre(0.25));
  ASSERT_THAT(settings.cameras, SizeIs(2));
  EXPECT_EQ(settings.cameras[1].id, 5);
  EXPECT_DOUBLE_EQ(settings.cameras[0].rate_hz, 30.0);
  EXPECT_DOUBLE_EQ(settings.cameras[1].rate_hz, 60.0);
}

TEST(Config, absent_optional_keys_keep_the_structures_defaults) {
  const Settings settings = read_settings("[needle]\ncurvature_per_mm = 0\n");
  EXPECT_DOUBLE_EQ(settings.wheelbase_mm, 20.0);
  EXPECT_EQ(settings.count, 3);
  EXPECT_THAT(settings.origin_mm, ElementsAre(1.0, 2.0, 3.0));
  EXPECT_THAT(settings.cameras, SizeIs(0));
}

struct BadFile {
  const char* name;
  const char* text;
  std::vector<std::string> expected;  // parts of the one message
};

class BadFiles : public ::testing::TestWithParam<BadFile> {};

TEST_P(BadFiles, are_refused_with_one_message_that_names_the_matter) {
  const auto faults = faults_of(GetParam().text);
  ASSERT_THAT(faults, SizeIs(1));
  for (const auto& part : GetParam().expected) EXPECT_THAT(faults[0], HasSubstr(part));
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadFiles,
    ::testing::Values(
        BadFile{"unknown_key",
                "[needle]\ncurvature_per_mm = 0\nwheel_base_mm = 3\n",
                {"test.toml:3:", "needle.wheel_base_mm", "nearest known key is needle.wheelbase_mm"}},
        BadFile{"unknown_section",
                "[needle]\ncurvature_per_mm = 0\n[camra]\nid = 1\n",
                {"test.toml:3:", "camra", "camera"}},
        BadFile{"unknown_key_in_an_array_of_tables",
                "[needle]\ncurvature_per_mm = 0\n[[camera]]\nid = 1\n[[camera]]\nid = 2\nrate_Hz = 3\n",
                {"test.toml:7:", "camera[1].rate_Hz", "camera[1].rate_hz"}},
        BadFile{
            "missing_key", "[needle]\nwheelbase_mm = 20\n", {"test.toml:1:", "needle.curvature_per_mm", "required"}},
        BadFile{"missing_section", "", {"test.toml:", "[needle]", "required"}},
        BadFile{"missing_key_in_an_array_of_tables",
                "[needle]\ncurvature_per_mm = 0\n[[camera]]\n",
                {"test.toml:3:", "camera[0].id", "required"}},
        BadFile{"above_range",
                "[needle]\ncurvature_per_mm = 0.2\n",
                {"test.toml:2:", "needle.curvature_per_mm = 0.2", "from -0.05 to 0.05"}},
        BadFile{
            "at_an_open_end", "[needle]\ncurvature_per_mm = 0\nwheelbase_mm = 0\n", {"wheelbase_mm = 0", "above 0"}},
        BadFile{"nan", "[needle]\ncurvature_per_mm = nan\n", {"curvature_per_mm = nan", "-0.05"}},
        BadFile{"inf_where_only_a_lower_end_is_given",
                "[needle]\ncurvature_per_mm = 0\nwheelbase_mm = inf\n",
                {"wheelbase_mm = inf", "above 0"}},
        BadFile{"text_for_number",
                "[needle]\ncurvature_per_mm = \"0.004\"\n",
                {"test.toml:2:", "needle.curvature_per_mm", "is text", "a number is wanted"}},
        BadFile{"array_for_number",
                "[needle]\ncurvature_per_mm = [0.02, -9223372036854775808, {a = 1}, [2], 'b']\n",
                {"curvature_per_mm = [0.02, -9223372036854775808, {...}, [...], 'b'] is an array"}},
        BadFile{"truth_for_number", "[needle]\ncurvature_per_mm = true\n", {"is true or false", "a number is wanted"}},
        BadFile{"fraction_for_whole_number",
                "[needle]\ncurvature_per_mm = 0\ncount = 2.5\n",
                {"needle.count = 2.5", "whole number is wanted"}},
        BadFile{"whole_number_out_of_range",
                "[needle]\ncurvature_per_mm = 0\ncount = 11\n",
                {"count = 11", "from 1 to 10"}},
        BadFile{"number_for_truth",
                "[needle]\ncurvature_per_mm = 0\nenabled = 1\n",
                {"enabled", "true or false is wanted"}},
        BadFile{"choice",
                "[needle]\ncurvature_per_mm = 0\nslip = \"bevel_plane\"\n",
                {"needle.slip = \"bevel_plane\"", "isotropic, bevel-plane", "nearest is bevel-plane"}},
        BadFile{"array_too_short",
                "[needle]\ncurvature_per_mm = 0\norigin_mm = [1, 2]\n",
                {"needle.origin_mm", "2 elements", "exactly 3"}},
        BadFile{"array_element_out_of_range",
                "[needle]\ncurvature_per_mm = 0\norigin_mm = [1, 2, 300]\n",
                {"needle.origin_mm", "element 2 = 300", "from -100 to 100"}},
        BadFile{"array_of_mixed_types",
                "[needle]\ncurvature_per_mm = 0\nlags = [1, \"two\"]\n",
                {"needle.lags", "an array of numbers is wanted"}},
        BadFile{"key_for_section", "needle = 3\n", {"test.toml:1:", "needle = 3", "a section [needle] is wanted"}},
        BadFile{"section_for_array_of_tables",
                "[needle]\ncurvature_per_mm = 0\n[camera]\nid = 1\n",
                {"camera", "array of tables [[camera]]"}},
        BadFile{"not_toml", "[needle]\ncurvature_per_mm = \n", {"test.toml:2:", "not TOML"}},
        BadFile{"letter_that_is_not_ascii", "[needle]\nslip = \u00f6\n", {"test.toml:2:", "not TOML"}},
        BadFile{"header_without_a_key", "[[[needle]]]\n", {"test.toml:1:", "not TOML"}},
        BadFile{
            "same_key_twice", "[needle]\ncurvature_per_mm = 0\ncurvature_per_mm = 1\n", {"test.toml:3:", "not TOML"}}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Config, all_faults_are_reported_together_in_the_files_order) {
  const auto faults = faults_of("[needle]\nunknown = 1\ncount = 99\nwheelbase_mm = \"long\"\n");
  ASSERT_THAT(faults, SizeIs(4));
  EXPECT_THAT(faults[0], HasSubstr("needle.curvature_per_mm is missing"));
  EXPECT_THAT(faults[1], HasSubstr("test.toml:2: unknown key needle.unknown"));
  EXPECT_THAT(faults[2], HasSubstr("needle.count = 99"));
  EXPECT_THAT(faults[3], HasSubstr("needle.wheelbase_mm"));
}

TEST(Config, keys_that_something_else_decides_are_read_as_numbers) {
  ConfigFile file = ConfigFile::parse("[[effect]]\nname = \"windup\"\nlag = 0.6\ngain = 2\n", "m.toml");
  auto effects = file.sections("effect", optional);
  ASSERT_THAT(effects, SizeIs(1));
  std::string name;
  effects[0].read("name", name, required);
  const auto numbers = effects[0].read_remaining_numbers();
  EXPECT_THAT(numbers, ElementsAre(std::pair("gain", 2.0), std::pair("lag", 0.6)));
  EXPECT_NO_THROW(file.finish());
}

TEST(Config, a_file_that_cannot_be_read_is_named) {
  EXPECT_THROW(
      {
        try {
          ConfigFile::load("/nonexistent/model.toml");
        } catch (const ConfigError& error) {
          EXPECT_THAT(error.what(), AllOf(HasSubstr("/nonexistent/model.toml"), HasSubstr("No such file")));
          throw;
        }
      },
      ConfigError);
  EXPECT_THROW(ConfigFile::load("/tmp"), ConfigError);
}

std::string repeated(const std::string& part, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += part;
  return text;
}

// Each of these overflowed the stack of the parser.
TEST(ConfigLimits, a_key_of_many_parts_is_refused_with_its_line) {
  const std::string parts = repeated("a.", 299'999);
  const std::string spaced = repeated("\"a\" . ", 50'000);
  for (const std::string& key :
       {parts + "a = 1", "[" + parts + "a]", "[[" + parts + "a]]", "x = {" + parts + "a = 1}", spaced + "a = 1"})
    EXPECT_THAT([&] { ConfigFile::parse("first = 1\n" + key + "\n", "test.toml"); },
                ThrowsMessage<ConfigError>(AllOf(StartsWith("test.toml:2: a key has "),
                                                 HasSubstr(" parts; allowed at most 16; correct or remove"))))
        << key.substr(0, 12);
}

TEST(ConfigLimits, deep_nesting_is_refused_with_its_line) {
  for (const std::string& value :
       {repeated("[", 100'000), repeated("[", 40) + repeated("]", 40), repeated("{a = ", 40) + "1" + repeated("}", 40)})
    EXPECT_THAT([&] { ConfigFile::parse("first = 1\na = " + value + "\n", "test.toml"); },
                ThrowsMessage<ConfigError>(AllOf(StartsWith("test.toml:2: arrays or tables are nested "),
                                                 HasSubstr(" deep; allowed at most 16; "))));
}

TEST(ConfigLimits, a_large_file_is_refused_before_it_is_parsed) {
  EXPECT_THAT([] { ConfigFile::parse(std::string(2'000'000, '#'), "test.toml"); },
              ThrowsMessage<ConfigError>(StartsWith("test.toml: has 2000000 bytes; allowed at most 1048576; ")));
}

TEST(ConfigLimits, text_and_comments_count_neither_as_keys_nor_as_nesting) {
  const std::string dots = repeated(".", 50), brackets = repeated("[", 50);
  const std::string odd = dots + brackets + "#";
  ConfigFile file =
      ConfigFile::parse("# it's " + odd + "\na = \"\\\"" + odd + "\" # \"\nb = '" + odd + "\\'\nc = \"\"\"\n\"" + odd +
                            "\"\"\"\"\nd = '''" + odd + "'''\ne = [[1.5, 2.5], [3.5]]\n",
                        "test.toml");
  for (const char* key : {"a", "b", "c", "d", "e"}) EXPECT_TRUE(file.root().has(key)) << key;
}

TEST(Config, nearest_name_counts_swapped_neighbours_as_one_slip) {
  EXPECT_EQ(nearest_name("lamdba2", {"lambda2", "lamb2"}), "lambda2");
  EXPECT_EQ(nearest_name("x", {}), "");
}

TEST(Config, numbers_print_as_short_as_they_can_be_read_back) {
  EXPECT_EQ(format_number(0.1), "0.1");
  EXPECT_EQ(format_number(-3.0), "-3");
}

}  // namespace
}  // namespace bevel::io
