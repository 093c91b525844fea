// SPDX-License-Identifier: MIT
// Export, import, export: the same bytes, whatever a recording holds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include <bevel/io/csv_export.hpp>
#include "tests/io/odd_recordings.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

std::map<std::string, std::string> files_in(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder))
    files[entry.path().filename().string()] = test::text_of(entry.path());
  return files;
}

class RoundTrip : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder / name).string(); }
  test::TemporaryFolder folder;
};

TEST_F(RoundTrip, ExportImportExportGivesTheSameBytesAndTheSameOrderOfArrival) {
  int cells_not_seen = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Recording made = test::OddRecordings(seed).recording();
    write_log(made, path("made.lcm"));
    const Recording first = read_recording(path("made.lcm"));
    ASSERT_TRUE(first.intact()) << seed << ": " << first.describe_faults();
    export_csv(first, path("first"));
    write_log(import_exported(path("first")), path("again.lcm"));
    const Recording again = read_recording(path("again.lcm"));
    ASSERT_TRUE(again.intact()) << seed << ": " << again.describe_faults();
    export_csv(again, path("second"));
    ASSERT_EQ(files_in(path("first")), files_in(path("second"))) << "seed " << seed;
    ASSERT_EQ(first.arrivals.size(), again.arrivals.size());
    for (std::size_t i = 0; i < first.arrivals.size(); ++i)
      ASSERT_TRUE(first.arrivals[i].channel == again.arrivals[i].channel &&
                  first.arrivals[i].index == again.arrivals[i].index)
          << "seed " << seed;
    if (!first.tips.empty()) {
      const std::string tips = test::text_of(folder / "first/tip_measurement.csv");
      for (std::size_t at = 0; (at = tips.find(",,", at)) != std::string::npos; ++at) ++cells_not_seen;
    }
  }
  EXPECT_GT(cells_not_seen, 30) << "or the generator has no axis that was not seen";
}

TEST_F(RoundTrip, ThePrograms) {
  write_log(test::OddRecordings(7).recording(), path("rec.lcm"));
  const auto run = [&](const std::string& program, const std::string& arguments) {
    const test::Said said = test::run_program(folder, program, arguments);
    EXPECT_EQ(said.status, 0) << program << ": " << said.err;
  };
  run("bevel-export", "-o " + path("csv") + " " + path("rec.lcm"));
  run("bevel-import", "-o " + path("logs") + " " + path("csv/rec") + "/");
  run("bevel-export", "-o " + path("csv2") + " " + path("logs"));
  EXPECT_EQ(files_in(path("csv/rec")), files_in(path("csv2/rec")));
  const test::Said over =
      test::run_program(folder, "bevel-import", "-o " + folder.path().string() + " " + path("csv/rec"));
  EXPECT_EQ(over.status, 1) << "it would have replaced the log itself";
  EXPECT_THAT(over.err, HasSubstr("rec.lcm: is there already"));
}

TEST_F(RoundTrip, AnExportThatReplacesOneLeavesNothingOfIt) {
  Recording full = test::OddRecordings(3).recording();
  full.headings.push_back({.utime = 5, .seq = 0, .camera = 1, .status = 1});
  full.arrivals.push_back({Arrival::Channel::heading, full.headings.size() - 1});
  export_csv(full, path("csv"));
  ASSERT_TRUE(fs::exists(folder / "csv/tip_heading.csv"));
  full.headings.clear();
  std::erase_if(full.arrivals, [](const Arrival& a) { return a.channel == Arrival::Channel::heading; });
  export_csv(full, path("csv"));
  EXPECT_FALSE(fs::exists(folder / "csv/tip_heading.csv"));
}

TEST_F(RoundTrip, AFolderThatWasCutAnywhereIsRefused) {
  export_csv(test::OddRecordings(3).recording(), path("csv"));
  const auto whole = files_in(path("csv"));
  int refused = 0, cuts = 0;
  for (const auto& [name, text] : whole) {
    if (!name.ends_with(".csv")) continue;
    for (std::size_t size = 0; size < text.size(); size += 7, ++cuts) {
      folder.write("csv/" + name, text.substr(0, size));
      try {
        import_exported(path("csv"));
      } catch (const std::runtime_error&) {
        ++refused;
      }
    }
    const std::string up_to_a_row = text.substr(0, text.rfind('\n', text.size() - 2) + 1);
    folder.write("csv/" + name, up_to_a_row);
    EXPECT_THAT([&] { import_exported(path("csv")); },
                ::testing::ThrowsMessage<std::runtime_error>(HasSubstr("The folder is incomplete")));
    fs::remove(folder / "csv" / name);
    EXPECT_THROW(import_exported(path("csv")), std::runtime_error) << name;
    folder.write("csv/" + name, text);
  }
  EXPECT_GT(cuts, 200);
  EXPECT_EQ(refused, cuts);
  EXPECT_NO_THROW(import_exported(path("csv")));
}

TEST_F(RoundTrip, AConfigurationThatWasCutIsRefused) {
  Recording recording = test::OddRecordings(3).recording();
  recording.config = "[recording]\nclock = \"none\"\n";
  export_csv(recording, path("csv"));
  folder.write("csv/config.toml", "[recording]\n");
  EXPECT_THAT([&] { import_exported(path("csv")); },
              ::testing::ThrowsMessage<std::runtime_error>(
                  HasSubstr("config.toml: has 12 bytes; rows.toml lists 27. The folder is incomplete")));
}

TEST_F(RoundTrip, ATableThatWasChangedOnPurposeIsReadWithoutTheCounts) {
  export_csv(test::OddRecordings(3).recording(), path("csv"));
  const std::string text = test::text_of(folder / "csv/actuator_state.csv");
  folder.write("csv/actuator_state.csv", text.substr(0, text.rfind('\n', text.size() - 2) + 1));
  fs::remove(folder / "csv/rows.toml");
  EXPECT_NO_THROW(import_exported(path("csv")));
}

TEST_F(RoundTrip, WhatIsNoExportIsRefusedWithItsPlace) {
  const auto refusal = [&](const std::string& name, const std::string& text) {
    fs::create_directories(folder / "csv");
    folder.write("csv/" + name, text);
    try {
      import_exported(path("csv"));
    } catch (const std::runtime_error& e) {
      return std::string(e.what());
    }
    return std::string("taken");
  };
  const std::string header = "utime,seq,mode,insertion_rate_mm_s,rotation_rate_rad_s\n";
  EXPECT_THAT(refusal("motion_command.csv", header + "1,0,7,0,0\n"),
              HasSubstr("motion_command.csv:2: readers would refuse this row (out of range"));
  EXPECT_THAT(refusal("motion_command.csv", header + "1,0,1,,0\n"),
              HasSubstr("motion_command.csv:2: column 'insertion_rate_mm_s' is '', and must be given"));
  EXPECT_THAT(refusal("motion_command.csv", header + "1.5,0,1,0,0\n"), HasSubstr("column 'utime' is '1.5', not an"));
  EXPECT_THAT(refusal("motion_command.csv", "utime,seq\n1,0\n"), HasSubstr("no column 'mode'"));
  EXPECT_THAT([&] { import_exported(folder.path().string()); },
              ::testing::ThrowsMessage<std::runtime_error>(HasSubstr("has none of the files of bevel-export")));
}

}  // namespace
}  // namespace bevel::io
