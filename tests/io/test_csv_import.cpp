// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include <bevel/error.hpp>
#include <bevel/io/csv_export.hpp>
#include <bevel/io/csv_import.hpp>
#include <bevel/io/recording_clock.hpp>
#include "tests/support/run_program.hpp"
#include "tests/support/shared_recordings.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

using ::testing::HasSubstr;

class CsvImport : public ::testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) const { return folder.write(name, text); }
  std::string map(const std::string& insertion = "column = \"-Base y\"\nunit = \"mm\"\nsettled = true\n") const {
    return file("map.toml",
                "[time]\nseconds = \"s\"\nnanoseconds = \"ns\"\n[tip]\naxes = [\"Tip z\", \"-Tip x\", \"-Tip "
                "y\"]\nunit = \"mm\"\n"
                "origin = [\"E z\", \"-E x\", \"-E y\"]\nsigma_mm = [0.1, 0.2, 0]\n[insertion]\n" +
                    insertion + "[rows]\nnonzero = [\"Tip x\", \"E x\"]\n");
  }
  static constexpr const char* kHeader = "s, ns, Tip x, Tip y, Tip z, E x, E y, E z, Base y\n";
  test::TemporaryFolder folder;
};

TEST_F(CsvImport, MapsAxesDropsEmptyRowsAndKeepsOnlySettledSteps) {
  const std::string csv = file("a.csv", std::string(kHeader) +
                                            "100,0,0,0,0,0,0,0,0\n"          // no data
                                            "100,500000000,1,2,3,0,0,0,0\n"  // before the entry point was touched
                                            "101,0,10,0.5,30,10,0.5,30,0\n"  // the entry
                                            "101,500000000,10,-3,30,10,0.5,30,0\n"  // being pushed
                                            "102,0,11,-4.5,31,10,0.5,30,-5\n"       // step done
                                            "102,500000000,11,-4.6,31,10,0.5,30,-5\n");
  const ImportedRecording r = import_csv(csv, load_column_map(map()));
  EXPECT_EQ(r.rows, 6);
  EXPECT_EQ(r.rows_without_data, 2);
  EXPECT_EQ(r.rows_unsettled, 2);
  ASSERT_EQ(r.tips.size(), 2u);
  EXPECT_EQ(r.tips[0].position_mm, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(r.tips[1].position_mm, Eigen::Vector3d(1, -1, 0)) << "z has no sigma: not measured";
  EXPECT_EQ(r.tips[1].utime, 102'000'000);
  EXPECT_NEAR(r.tips[1].information_per_mm2(0, 0), 100, 1e-9);
  EXPECT_EQ(r.tips[1].information_per_mm2(2, 2), 0);
  EXPECT_EQ(r.actuators[1].insertion_mm, 5);
  EXPECT_EQ(r.actuators[1].insertion_rate_mm_s, 5);

  write_log(r, (folder / "a.lcm").string());
  const Recording back = read_recording((folder / "a.lcm").string());
  EXPECT_TRUE(back.intact());
  ASSERT_EQ(back.tips.size(), 2u);
  EXPECT_EQ(back.tips[1].position_mm, r.tips[1].position_mm);
  const auto files = export_csv(back, (folder / "out").string());
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].second, 2);
}

// Several rows a stop; a depth is noted when it is reached, and its last rows are of the way to the next.
TEST_F(CsvImport, RowsOfOneStopAreOneReadingWithoutAClock) {
  const std::string stops =
      file("stops.toml",
           "[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\nsigma_mm = [0.1, 0.1, 0.1]\nheading = [\"hx\", \"hy\", "
           "\"hz\"]\n"
           "heading_sd_rad = 0.01\n[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\nstops = true\n");
  const std::string csv = file("stops.csv",
                               "depth,x,y,z,hx,hy,hz\n"
                               "0,0.1,0,0.1,0,0,1\n0,0.0,0,0.0,0,0,1\n0,0.2,0,0.2,0,0,1\n"
                               "0,0.0,0,2.9,0,0.1,0.99498744\n0,0.1,0,4.9,0,0,1\n"  // on the way
                               "5,0.3,0,5.0,0,0,1\n5,0.3,0.2,5.1,0,0,1\n5,0.2,0,8.0,0,0,1\n"
                               "10,0.5,-0.1,10.0,0,-0.02,0.9998\n");
  const ImportedRecording r = import_csv(csv, load_column_map(stops));
  EXPECT_FALSE(r.has_clock);
  ASSERT_EQ(r.tips.size(), 3u);
  EXPECT_EQ(r.rows_unsettled, 3);
  EXPECT_NEAR((r.tips[0].position_mm - Eigen::Vector3d(0.1, 0, 0.1)).norm(), 0, 1e-12) << "median of three";
  EXPECT_NEAR((r.tips[1].position_mm - Eigen::Vector3d(0.3, 0.1, 5.05)).norm(), 0, 1e-12) << "mean of two";
  EXPECT_NEAR(r.tips[1].information_per_mm2(0, 0), 200, 1e-9);
  EXPECT_NEAR(r.tips[2].information_per_mm2(0, 0), 100, 1e-9);
  EXPECT_EQ(r.actuators[2].insertion_mm, 10);
  EXPECT_EQ(r.actuators[2].insertion_rate_mm_s, 0) << "nobody knows it";
  EXPECT_NEAR(r.headings[2].heading.y(), -0.02, 1e-5);

  write_log(r, (folder / "stops.lcm").string());
  const Recording back = read_recording((folder / "stops.lcm").string());
  EXPECT_TRUE(back.intact());
  EXPECT_FALSE(has_clock(back));
  EXPECT_EQ(back.headings.size(), 3u);
}

// The needle lies at the next stop before its depth is noted, and longer than it lay at the one before.
TEST_F(CsvImport, RowsThatLieAtTheNextStopAlreadyAreNotTheStopBefore) {
  const std::string stops = file("stops.toml",
                                 "[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\nsigma_mm = [0.1, 0.1, 0.1]\n"
                                 "[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\nstops = true\n");
  const std::string csv = file("early.csv",
                               "depth,x,y,z\n"
                               "0,0,0,0\n0,0,0,0.1\n0,0,0,5.9\n0,0,0,5.1\n0,0,0,5\n0,0,0,5\n"
                               "5,0,0,5\n5,0,0,5.1\n5,0,0,9.6\n5,0,0,9.6\n5,0,0,9.6\n5,0,0,9.6\n"
                               "10,0,0,9.6\n10,0,0,9.5\n");
  const ImportedRecording r = import_csv(csv, load_column_map(stops));
  ASSERT_EQ(r.tips.size(), 3u);
  EXPECT_NEAR(r.tips[0].position_mm.z(), 0.05, 1e-12);
  EXPECT_NEAR(r.tips[1].position_mm.z(), 5.05, 1e-12);
  EXPECT_NEAR(r.tips[2].position_mm.z(), 9.55, 1e-12);
  EXPECT_EQ(r.rows_unsettled, 8);
}

// A needle that is turned over between two stops: rows of the base alone are the way there.
TEST_F(CsvImport, SettledStepsMayTurnOnTheWay) {
  const std::string turned =
      file("turned.toml",
           "[time]\nrate_hz = 1.0\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\nsigma_mm = [0.1, 0.1, 0.1]\n"
           "[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\nsettled = true\n[rotation]\ncolumn = \"roll\"\nunit = "
           "\"deg\"\n");
  const std::string csv = file("turned.csv",
                               "depth,roll,x,y,z\n"
                               "0,0,0,0,0\n"
                               "3,0,,,\n3,180,,,\n4,180,,,\n4,180,,,\n4,0,,,\n"  // one row says nothing new
                               "4,0,0.1,0.2,3.9\n"                               // the same place, and now the tip
                               "4,0,0.1,0.2,4.9\n");                             // being pushed
  const ImportedRecording r = import_csv(csv, load_column_map(turned));
  EXPECT_FALSE(r.has_clock);
  EXPECT_EQ(r.rows_unsettled, 2);
  ASSERT_EQ(r.tips.size(), 2u);
  EXPECT_EQ(r.tips[1].position_mm.z(), 3.9);
  ASSERT_EQ(r.actuators.size(), 6u);
  EXPECT_NEAR(r.actuators[2].rotation_rad, EIGEN_PI, 1e-12);
  EXPECT_EQ(r.actuators[2].insertion_mm, 3);
  EXPECT_NEAR(r.actuators[3].rotation_rad, EIGEN_PI, 1e-12);
  EXPECT_EQ(r.actuators[5].insertion_mm, 4);
}

TEST_F(CsvImport, ALogHasAClockUnlessItsConfigSaysNo) {
  Recording recording;
  EXPECT_TRUE(has_clock(recording));
  recording.config = "[recording]\nclock = \"none\"\n";
  EXPECT_FALSE(has_clock(recording));
  for (const char* other : {"[recording]\nclock = \"ptp\"\n", "[needle]\n", "[[[a]]]", "clock = none", "\xff"}) {
    recording.config = other;
    EXPECT_TRUE(has_clock(recording)) << other;
  }
}

TEST_F(CsvImport, ATimeBesideStopsIsRefused) {
  const std::string both =
      file("both.toml",
           "[time]\nrate_hz = 10.0\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\n"
           "sigma_mm = [0.1, 0.1, 0.1]\n[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\nstops = true\n");
  EXPECT_THAT([&] { load_column_map(both); },
              ::testing::ThrowsMessage<ConfigError>(::testing::AllOf(HasSubstr("stops"), HasSubstr("clock"))));
}

TEST_F(CsvImport, FaultsNameFileLineColumnAndTheNearestName) {
  const auto message = [&](const std::string& csv, const std::string& map_path) {
    try {
      import_csv(csv, load_column_map(map_path));
    } catch (const std::exception& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const std::string row = "101,0,10,0.5,30,10,0.5,30,0\n";
  EXPECT_NE(message(file("b.csv", std::string(kHeader) + row), map("column = \"-Bass y\"\nunit = \"mm\"\n"))
                .find("nearest is 'Base y'"),
            std::string::npos);
  const std::string text = message(file("c.csv", std::string(kHeader) + row + "102,0,ten,0,0,10,0,30,-5\n"), map());
  EXPECT_NE(text.find("c.csv:3: column 'Tip x' is 'ten'"), std::string::npos) << text;
  EXPECT_NE(message(file("d.csv", std::string(kHeader)), map()).find("no row with data"), std::string::npos);
  EXPECT_NE(message((folder / "none.csv").string(), map()).find("cannot be read"), std::string::npos);
  EXPECT_NE(message(file("e.csv", std::string(kHeader) + row), file("bad.toml", "[time]\n")).find("time"),
            std::string::npos);
}

// A CSV of time, depth, roll and tip, a row each 0.1 s.
class PlainCsv : public CsvImport {
 protected:
  std::string columns =
      file("plain.toml",
           "[time]\nseconds = \"t\"\nnanoseconds = \"ns\"\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\n"
           "sigma_mm = [0.1, 0.1, 0.2]\n[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\n[rotation]\ncolumn = "
           "\"roll\"\nunit = \"rad\"\n");
  std::string csv(const std::function<void(int, std::vector<std::string>&)>& change = [](int, auto&) {}) const {
    std::string text = "t,ns,depth,roll,x,y,z\n";
    for (int i = 0; i < 40; ++i) {
      const std::string depth = std::to_string(0.5 * i);
      std::vector<std::string> cells{std::to_string(1'700'000'000 + i), "0", depth, "0.1", "0", "0", depth};
      change(i, cells);
      for (std::size_t c = 0; c < cells.size(); ++c) text += (c > 0 ? "," : "") + cells[c];
      text += '\n';
    }
    return file("plain.csv", text);
  }
  test::Said import(const std::string& path) const {
    return test::run_program(folder, "bevel-import",
                             "-c " + columns + " -o " + (folder / "logs").string() + " " + path);
  }
  std::string log() const { return (folder / "logs/plain.lcm").string(); }
};

TEST_F(PlainCsv, ReadsBackIntact) {
  const test::Said said = import(csv());
  EXPECT_EQ(said.status, 0) << said.err;
  EXPECT_EQ(said.err, "");
  const Recording back = read_recording(log());
  EXPECT_TRUE(back.intact()) << back.describe_faults();
  EXPECT_EQ(back.actuators.size(), 40U);
  EXPECT_EQ(back.actuators.front().utime, 1'700'000'000'000'000);
}

// Whatever reads a log takes the needle to be at the entry point where the log begins.
TEST_F(PlainCsv, ADepthThatDoesNotBeginAtZeroIsSaid) {
  EXPECT_THAT(import(csv()).out, Not(HasSubstr("begins at")));
  const test::Said said = import(csv([](int i, auto& cells) { cells[2] = std::to_string(0.12 + 0.5 * i); }));
  EXPECT_EQ(said.status, 0) << said.err;
  EXPECT_THAT(said.out, HasSubstr("begins at 0.12 mm, not at 0"));
}

TEST_F(PlainCsv, AHeadingsColumnsBecomeATipHeadingEachAndComeBackInTheExport) {
  const std::string with_heading =
      file("heading.toml",
           "[time]\nseconds = \"t\"\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\nsigma_mm = [0.1, 0.1, 0.2]\n"
           "heading = [\"heading_x\", \"-heading_y\", \"heading_z\"]\nheading_sd_rad = 0.02\n"
           "[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\n");
  const std::string table = file("heading.csv",
                                 "t,depth,x,y,z,heading_x,heading_y,heading_z\n"
                                 "1,0,0,0,0,0,0,1\n2,5,0,0,5,0,0.6,0.8\n3,10,0,0,10,0.707,0.0,0.707\n");
  const ImportedRecording r = import_csv(table, load_column_map(with_heading));
  ASSERT_EQ(r.headings.size(), 3U);
  EXPECT_LT((r.headings[1].heading - Eigen::Vector3d(0, -0.6, 0.8)).norm(), 1e-12);
  EXPECT_NEAR(r.headings[2].heading.norm(), 1, 1e-12) << "three digits of a file are no damage";
  EXPECT_NEAR(r.headings[1].information_per_rad2(0, 0), 2500, 1e-9);
  EXPECT_NEAR(r.headings[1].information_per_rad2.trace(), 5000, 1e-9);

  write_log(r, (folder / "heading.lcm").string());
  const Recording back = read_recording((folder / "heading.lcm").string());
  EXPECT_TRUE(back.intact()) << back.describe_faults();
  ASSERT_EQ(back.headings.size(), 3U);
  EXPECT_EQ(back.headings[2].heading, r.headings[2].heading);
  EXPECT_EQ(back.arrivals.size(), 9U);
  export_csv(back, (folder / "out").string());
  const std::string exported = test::text_of(folder / "out/tip_heading.csv");
  EXPECT_THAT(exported, HasSubstr("utime,seq,camera,status,heading_x,heading_y,heading_z,ixx_per_rad2,"));
  EXPECT_THAT(exported, HasSubstr("\n1000000,0,0,0,0,-0,1,2500,"));

  const std::string bad = file("bad.csv", "t,depth,x,y,z,heading_x,heading_y,heading_z\n1,0,0,0,0,0,0.6,0.6\n");
  try {
    import_csv(bad, load_column_map(with_heading));
    FAIL() << "taken";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("bad.csv:2: column 'heading_x' is '0', and the heading's length is 0.8485"));
  }
  const std::string unsure = file("unsure.toml",
                                  "[time]\nrate_hz = 30.0\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\n"
                                  "sigma_mm = [0.1, 0.1, 0]\nheading = [\"a\", \"b\", \"c\"]\n"
                                  "[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\n");
  try {
    load_column_map(unsure);
    FAIL() << "taken";
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("heading_sd_rad"));
  }
}

TEST_F(PlainCsv, ATimeThatStartsAtZeroOrBelowIsShiftedAndThatIsSaid) {
  for (const int start : {0, -7, -100}) {
    const test::Said said = import(csv([start](int i, auto& cells) { cells[0] = std::to_string(start + i); }));
    EXPECT_EQ(said.status, 0) << said.err;
    EXPECT_THAT(said.err, HasSubstr("plain.csv: time starts at " + std::to_string(start) + " s"));
    EXPECT_THAT(said.err, HasSubstr("shifted by " + std::to_string(1 - start) + " s"));
    const Recording back = read_recording(log());
    EXPECT_TRUE(back.intact()) << back.describe_faults();
    ASSERT_EQ(back.tips.size(), 40U);
    EXPECT_EQ(back.tips.front().utime, 1'000'000);
    EXPECT_EQ(back.tips.back().utime, 40'000'000);
  }
}

TEST_F(PlainCsv, WhatReadersWouldRefuseIsRefusedWithItsPlaceAndLeavesNoFile) {
  struct Case {
    std::size_t column;
    std::string value, said;
  };
  for (const Case& wrong : {Case{0, "9e18", "column 't' is '9e18', outside what is allowed, -1e+10 to 1e+10 s"},
                            {1, "-3", "column 'ns' is '-3', outside what is allowed, 0 to 1e+09 ns"},
                            {2, "1e308", "column 'depth' is '1e308', outside what is allowed, -1e+05 to 1e+05 mm"},
                            {3, "-2e7", "column 'roll' is '-2e7', outside what is allowed, -1e+07 to 1e+07 rad"},
                            {5, "1e6", "column 'y' is '1e6', outside what is allowed, -1e+05 to 1e+05 mm"},
                            {6, "nan", "column 'z' is 'nan', not a finite number"},
                            {0, "1700000003", "column 't' is '1700000003', but time does not grow"}}) {
    const test::Said said = import(csv([&wrong](int i, auto& cells) {
      if (i == 20) cells[wrong.column] = wrong.value;
    }));
    EXPECT_EQ(said.status, 1) << wrong.value;
    EXPECT_THAT(said.err, HasSubstr("plain.csv:22: " + wrong.said));
    EXPECT_TRUE(std::filesystem::is_empty(folder / "logs")) << wrong.value;
  }
}

TEST_F(PlainCsv, AnImplausibleRowIsLeftOutAndSaidAJumpThatLastsIsRefused) {
  const test::Said spike = import(csv([](int i, auto& cells) {
    if (i == 20) cells[2] = "800";
    if (i == 30) cells[4] = "-999";
  }));
  EXPECT_EQ(spike.status, 3);
  EXPECT_THAT(spike.err,
              HasSubstr("plain.csv:22: insertion jumps by 790.5 mm in 1 s; allowed 250.5 mm; the row is left"));
  EXPECT_THAT(spike.err, HasSubstr("plain.csv:32: the tip jumps by 999 mm"));
  const Recording back = read_recording(log());
  EXPECT_TRUE(back.intact()) << back.describe_faults();
  EXPECT_EQ(back.actuators.size(), 38U);
  EXPECT_NEAR(back.actuators[20].insertion_rate_mm_s, 0.5, 1e-9) << "over the row left out";

  std::filesystem::remove(log());
  const test::Said jump = import(csv([](int i, auto& cells) {
    if (i >= 20) cells[2] = std::to_string(800 + i);
  }));
  EXPECT_EQ(jump.status, 1);
  EXPECT_THAT(jump.err, HasSubstr("plain.csv:22: insertion jumps by 810.5 mm"));
  EXPECT_TRUE(std::filesystem::is_empty(folder / "logs"));
}

TEST_F(PlainCsv, AFolderThatCannotBeWrittenToIsNamedAndNothingIsLeft) {
  std::filesystem::create_directories(folder / "logs/plain.lcm/in-the-way");
  const test::Said said = import(csv());
  EXPECT_EQ(said.status, 1);
  EXPECT_THAT(said.err, HasSubstr("plain.lcm"));
  EXPECT_FALSE(std::filesystem::exists(log() + ".unfinished"));
}

TEST_F(PlainCsv, SigmasWithoutInformationThatReadersAcceptAreRefused) {
  const std::string wild = file("wild.toml",
                                "[time]\nrate_hz = 30.0\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\n"
                                "sigma_mm = [1e-9, 0.1, 0]\n[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\n");
  try {
    load_column_map(wild);
    FAIL() << "taken";
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("tip.sigma_mm: is 1e-09"));
  }
}

TEST_F(CsvImport, RealInsertionsBecomeLogsOfTwentyOneSteps) {
  const std::filesystem::path real = test::shared_recordings() / "real/bwh";
  BEVEL_SKIP_WITHOUT(real);
  const ColumnMap columns = load_column_map(std::string(BEVEL_SOURCE_DIR) + "/docs/import/bwh.toml");
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(real)) {
    if (entry.path().extension() != ".csv") continue;
    ++files;
    const ImportedRecording r = import_csv(entry.path().string(), columns);
    EXPECT_EQ(r.tips.size(), 21u) << entry.path();
    write_log(r, (folder / "real.lcm").string());
    const Recording back = read_recording((folder / "real.lcm").string());
    EXPECT_TRUE(back.intact() && r.remarks("").empty()) << entry.path() << back.describe_faults() << r.remarks("");
    EXPECT_EQ(r.actuators.back().insertion_mm, 100) << entry.path();
    for (std::size_t i = 1; i < r.tips.size(); ++i)
      EXPECT_NEAR(r.tips[i].position_mm.z(), r.actuators[i].insertion_mm, 4.0) << entry.path() << " step " << i;
    EXPECT_LT(r.tips.back().position_mm.y(), -2) << "bends toward -y of {A}";
  }
  EXPECT_EQ(files, 12);
}

}  // namespace
}  // namespace bevel::io
