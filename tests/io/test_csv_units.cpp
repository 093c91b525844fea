// SPDX-License-Identifier: MIT
// One's own CSV: units, separators, empty cells, streams; and what cannot be true of a needle.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include <bevel/io/csv_export.hpp>
#include <bevel/io/csv_import.hpp>
#include "tests/support/run_program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// A needle that goes in at 10 mm/s, turns at 0.5 rad/s, and bends toward -y.
double depth_mm(double t_s) { return 10 * t_s; }
double turn_rad(double t_s) { return 0.5 * t_s; }
Eigen::Vector3d tip_mm(double t_s) { return {0.01 * depth_mm(t_s), -0.002 * depth_mm(t_s) * t_s * 10, depth_mm(t_s)}; }

std::string number(double value) { return format_number(value); }

struct Units {
  std::string time = "s", length = "mm", angle = "rad";
  double time_scale = 1, length_scale = 1, angle_scale = 1;
};

class OwnCsv : public ::testing::Test {
 protected:
  std::string map(const Units& u, const std::string& more = "") const {
    return folder.write("map.toml", "[time]\ncolumn = \"t\"\nunit = \"" + u.time +
                                        "\"\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"" + u.length +
                                        "\"\nsigma_mm = [0.1, 0.1, 0.2]\n[insertion]\ncolumn = \"depth\"\nunit = \"" +
                                        u.length + "\"\n[rotation]\ncolumn = \"roll\"\nunit = \"" + u.angle + "\"\n" +
                                        more);
  }
  // `change`: the cells t, depth, roll, x, y, z of row i, in SI-like units before scaling.
  std::string csv(
      const Units& u = {}, const std::string& separator = ",",
      const std::function<void(int, std::vector<std::string>&)>& change = [](int, auto&) {}) const {
    std::string text;
    const std::vector<std::string> names{"t", "depth", "roll", "x", "y", "z"};
    for (std::size_t c = 0; c < names.size(); ++c) text += (c > 0 ? separator : "") + names[c];
    for (int i = 0; i < 50; ++i) {
      const double t_s = 0.1 * i;
      const Eigen::Vector3d tip = tip_mm(t_s) / u.length_scale;
      std::vector<std::string> cells{number(t_s / u.time_scale),
                                     number(depth_mm(t_s) / u.length_scale),
                                     number(turn_rad(t_s) / u.angle_scale),
                                     number(tip.x()),
                                     number(tip.y()),
                                     number(tip.z())};
      change(i, cells);
      text += '\n';
      for (std::size_t c = 0; c < cells.size(); ++c) text += (c > 0 ? separator : "") + cells[c];
    }
    return folder.write("own.csv", text + "\n");
  }
  std::string refusal(const std::string& csv_path, const std::string& map_path) const {
    try {
      import_csv(csv_path, load_column_map(map_path));
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "taken";
  }
  test::TemporaryFolder folder;
};

TEST_F(OwnCsv, OneInsertionInAllUnitsIsOneRecording) {
  const ImportedRecording expected = import_csv(csv(), load_column_map(map({})));
  ASSERT_EQ(expected.tips.size(), 50U);
  EXPECT_EQ(expected.tips[20].position_mm.z(), 20);
  const double deg = std::acos(-1.0) / 180;
  for (const Units& u : {Units{"ms", "m", "deg", 1e-3, 1000, deg}, Units{"us", "in", "rev", 1e-6, 25.4, 360 * deg},
                         Units{"ns", "um", "rad", 1e-9, 1e-3, 1}, Units{"s", "cm", "rad", 1, 10, 1}}) {
    const ImportedRecording got = import_csv(csv(u), load_column_map(map(u)));
    ASSERT_EQ(got.tips.size(), 50U) << u.length;
    for (std::size_t i = 0; i < 50; ++i) {
      EXPECT_EQ(got.tips[i].utime, expected.tips[i].utime) << u.time;
      EXPECT_LT((got.tips[i].position_mm - expected.tips[i].position_mm).norm(), 1e-9) << u.length;
      EXPECT_NEAR(got.actuators[i].insertion_mm, expected.actuators[i].insertion_mm, 1e-9) << u.length;
      EXPECT_NEAR(got.actuators[i].rotation_rad, expected.actuators[i].rotation_rad, 1e-9) << u.angle;
    }
  }
}

TEST_F(OwnCsv, AUnitThatIsNotGivenIsAskedForAndOneThatIsUnknownIsNamed) {
  const std::string none = folder.write("none.toml",
                                        "[time]\ncolumn = \"t\"\n[tip]\naxes = [\"x\", \"y\", \"z\"]\n"
                                        "sigma_mm = [0.1, 0.1, 0.2]\n[insertion]\ncolumn = \"depth\"\n"
                                        "[rotation]\ncolumn = \"roll\"\nunit = \"degree\"\n");
  EXPECT_THAT(
      refusal(csv(), none),
      AllOf(HasSubstr("none.toml:1: time.unit is missing and is required; allowed: s, ms, us, ns"),
            HasSubstr("tip.unit is missing and is required; allowed: mm, cm, m, um, in"),
            HasSubstr("insertion.unit is missing"),
            HasSubstr("rotation.unit = \"degree\" is not allowed; allowed: rad, deg, rev; the nearest is deg")));
}

TEST_F(OwnCsv, SpreadsheetsOfOtherCountriesAreRead) {
  const auto decimal_commas = [](int, std::vector<std::string>& cells) {
    for (std::string& cell : cells) std::ranges::replace(cell, '.', ',');
  };
  const ImportedRecording expected = import_csv(csv(), load_column_map(map({})));
  const auto expect_same = [&](const std::string& path, const std::string& said) {
    const ImportedRecording got = import_csv(path, load_column_map(map({})));
    ASSERT_EQ(got.tips.size(), expected.tips.size()) << said;
    for (std::size_t i = 0; i < got.tips.size(); ++i)
      EXPECT_EQ(got.tips[i].position_mm, expected.tips[i].position_mm) << said;
    EXPECT_EQ(got.format, said);
  };
  expect_same(csv({}, ";", decimal_commas), "';' between cells, decimal comma");
  expect_same(csv({}, "\t"), "tabs between cells");
  const std::string text = test::text_of(csv());
  expect_same(folder.write("own.csv", "\xEF\xBB\xBF" + text), "',' between cells");
  expect_same(folder.write("own.csv", "# a stage, 2024\n\n" + text), "',' between cells");
  std::string quoted = "\"t\",\"depth\",\"roll\",\"x\",\"y\",\"z\"" + text.substr(text.find('\n'));
  expect_same(folder.write("own.csv", quoted), "',' between cells");
  std::string windows = text;
  for (std::size_t at = 0; (at = windows.find('\n', at)) != std::string::npos; at += 2) windows.replace(at, 1, "\r\n");
  expect_same(folder.write("own.csv", windows), "',' between cells");
}

TEST_F(OwnCsv, WhatATableLeavesOpenIsRefusedWithItsLine) {
  const std::string header = "t,depth,roll,x,y,z\n", row = "0,0,0,0,0,0\n";
  for (const auto& [text, said] : std::vector<std::pair<std::string, std::string>>{
           {header + row + "0,1,0,0,1,0,0,0\n",
            "own.csv:3: has 8 cells, and the header (line 1) names 6; decimal commas need"},
           {header + row + "0.1,0,0,0\n", "own.csv:3: has 4 cells, and the header (line 1) names 6"},
           {header + row + "0.1,\"1,000\",0,0,0,0\n", "own.csv:3: column 'depth' is '1,000', in which the comma may"},
           {"t;depth;roll;x;y;z\n0;0;0.5;0;0;0\n1;1,5;0;0;0;0\n",
            "own.csv:3: column 'depth' is '1,5', but numbers above have '.' for a decimal mark"},
           {header + row + "0.1,\"0,0,0,0,0\n", "own.csv:3: a quote (\") is opened and not closed"},
           {"t,depth,roll,x,x,z\n" + row, "column 'x' is there twice"},
           {header + row + ",1,0,0,0,1\n", "own.csv:3: column 't' is '', and every row with data needs a time"},
           {header + row + "0.1,1,0,0,0,inf\n", "own.csv:3: column 'z' is 'inf', not a finite number; where nothing"},
           {std::string("\xFF\xFEt\0,", 5), "is UTF-16"},
           {"time,depth,roll,x,y,z\n0,0,0,0,0,0\n", "no column 't'; the nearest is 'x'; there are 'time', 'depth'"}})
    EXPECT_THAT(refusal(folder.write("own.csv", text), map({})), HasSubstr(said)) << text;
}

TEST_F(OwnCsv, AnEmptyCellIsNotSeenAndNotZero) {
  const std::string path = csv({}, ",", [](int i, auto& cells) {
    if (i == 10) cells[5] = "";                             // z not seen
    if (i == 11) cells[3] = cells[4] = cells[5] = "";       // nothing seen
    if (i == 12) cells[3] = cells[4] = cells[5] = "-9999";  // the tracker's word for it
    if (i == 13)
      for (std::string& cell : cells) cell.clear();  // a spreadsheet's empty row
  });
  const ImportedRecording r = import_csv(path, load_column_map(map({}, "[rows]\nunseen = [\"-9999\"]\n")));
  EXPECT_EQ(r.tips.size(), 47U);
  EXPECT_EQ(r.actuators.size(), 49U);
  EXPECT_EQ(r.rows_without_data, 1);
  EXPECT_EQ(r.tips[10].information_per_mm2(2, 2), 0);
  EXPECT_NEAR(r.tips[10].information_per_mm2(0, 0), 100, 1e-9);
  EXPECT_THAT(summary(r), AllOf(HasSubstr("z 0 to 49 mm (in 46 of them)"), HasSubstr("depth    0 to 49 mm")));

  write_log(r, (folder / "own.lcm").string());
  export_csv(read_recording((folder / "own.lcm").string()), (folder / "out").string());
  const std::string exported = test::text_of(folder / "out/tip_measurement.csv");
  EXPECT_THAT(exported, HasSubstr("\n2000000,10,0,0,0.1,-0.2,,")) << "neither is it 0 in the export";
}

TEST_F(OwnCsv, TheSummaryLetsOneSeeTheMotion) {
  const ImportedRecording r = import_csv(csv(), load_column_map(map({})));
  EXPECT_EQ(summary(r),
            "  rows     50, 0 without data, 0 between steps, 0 left out; ',' between cells\n"
            "  time     4.9 s\n"
            "  base     50 readings, 10 a second; longest gap 0.1 s, longest step 1 mm\n"
            "  depth    0 to 49 mm, fastest 10 mm/s\n"
            "  turning  2.45 rad in all (0.3899 turns), from 0 to 2.45 rad, fastest 0.5 rad/s\n"
            "  tip      50 readings, 10 a second; x 0 to 0.49 mm; y -4.802 to 0 mm; z 0 to 49 mm\n");
}

TEST_F(OwnCsv, WhatCannotBeOfANeedleIsRefusedWithFiguresAndLine) {
  const std::string in_mm = map({});
  // Metres taken for millimetres: the tip stands still while the base goes in.
  const auto tip_in_m = [](int, std::vector<std::string>& cells) {
    for (std::size_t c = 3; c < 6; ++c) cells[c] = number(std::stod(cells[c]) / 1000);
  };
  EXPECT_THAT(refusal(csv({}, ",", tip_in_m), in_mm),
              AllOf(HasSubstr("own.csv:37: the tip's z changed by 0.034 mm from line 2 on, while the insertion changed "
                              "by 35 mm; allowed: 7 mm or more"),
                    HasSubstr("tip.axes")));
  const auto base_in_m = [](int, std::vector<std::string>& cells) { cells[1] = number(std::stod(cells[1]) / 1000); };
  EXPECT_THAT(refusal(csv({}, ",", base_in_m), in_mm),
              AllOf(HasSubstr("own.csv:13: the tip is 7.003 mm from where it began (line 2), and the base had moved by "
                              "0.011 mm; allowed 6.012 mm; in all 39 of 50 tips are too far"),
                    HasSubstr("tip.unit")));
  const auto outward = [](int, std::vector<std::string>& cells) { cells[5] = "-" + cells[5]; };
  EXPECT_THAT(refusal(csv({}, ",", outward), in_mm), HasSubstr("own.csv:37: the tip's z changed by -35 mm"));
  const auto swapped = [](int, std::vector<std::string>& cells) { std::swap(cells[3], cells[5]); };
  EXPECT_THAT(refusal(csv({}, ",", swapped), in_mm), HasSubstr("the order of tip.axes"));
  const auto backwards = [](int i, std::vector<std::string>& cells) {
    if (i == 30) cells[0] = "2.85";
  };
  EXPECT_THAT(refusal(csv({}, ",", backwards), in_mm),
              HasSubstr("own.csv:32: column 't' is '2.85', but time does not grow; allowed: later than in line 31"));
  // Seconds taken for milliseconds: faster than any rig.
  EXPECT_THAT(refusal(csv(), map({.time = "ms"})), HasSubstr("insertion"));
}

TEST_F(OwnCsv, ACameraThatTookSomethingElseForTheTipForAWhileIsSaidAndStays) {
  const std::string path = csv({}, ",", [](int i, auto& cells) {
    if (i >= 20 && i < 25) cells[3] = "60";
  });
  const ImportedRecording r = import_csv(path, load_column_map(map({})));
  EXPECT_EQ(r.tips.size(), 50U);
  EXPECT_THAT(r.remarks("own.csv"), AllOf(HasSubstr("own.csv:22: the tip is 62.93 mm from where it began (line 2)"),
                                          HasSubstr("in all 5 of 50 tips are too far, and stay")));
}

TEST_F(OwnCsv, ACameraThatBeginsWithSomethingElseIsNoReasonToRefuse) {
  const std::string path = csv({}, ",", [](int i, auto& cells) {
    if (i < 15) cells[1] = cells[5] = number(0.01 * i);  // the base rests at first
    if (i < 4) cells[4] = "40";
  });
  const ImportedRecording r = import_csv(path, load_column_map(map({})));
  EXPECT_THAT(r.remarks("own.csv"), HasSubstr("in all 3 of 50 tips are too far")) << "all but the first";
}

// Base and tip in files of their own, at rates of their own, by clocks that are 2 s apart.
TEST_F(OwnCsv, SeparateFilesKeepTheirInstantsAndTheBaseIsReadOffInBetween) {
  const Units u;
  const std::string both = map(u, "[base]\n[base.time]\ncolumn = \"ms\"\nunit = \"ms\"\noffset_s = -2.0\n");
  std::string tips = "t,x,y,z\n", base = "ms;depth;roll\n";
  for (int i = 0; i < 30; ++i) {
    const double t_s = 0.033 + i / 10.0;
    const Eigen::Vector3d tip = tip_mm(t_s);
    tips += number(t_s) + "," + number(tip.x()) + "," + number(tip.y()) + "," + number(tip.z()) + "\n";
  }
  for (int i = 0; i <= 10; ++i)  // every 0.25 s
    base += number(2000 + 250 * i) + ";" + number(depth_mm(0.25 * i)) + ";" + number(turn_rad(0.25 * i)) + "\n";
  const std::string tip_path = folder.write("tip.csv", tips), base_path = folder.write("base.csv", base);
  const test::Said said =
      test::run_program(folder, "bevel-import",
                        "-c " + both + " -o " + (folder / "logs").string() + " " + tip_path + " --base " + base_path);
  EXPECT_EQ(said.status, 0) << said.err;
  EXPECT_THAT(said.err, HasSubstr("5 of the tip's readings are from before the base's first or after its last"));
  const Recording back = read_recording((folder / "logs/tip.lcm").string());
  EXPECT_TRUE(back.intact()) << back.describe_faults();
  ASSERT_EQ(back.actuators.size(), 11U);
  ASSERT_EQ(back.tips.size(), 25U);
  // Not the next row's: 20 ms late would be 0.2 mm here.
  EXPECT_EQ(back.tips[7].utime - back.actuators[0].utime, 733'000);
  EXPECT_NEAR(back.tips[7].position_mm.z(), 7.33, 1e-9);

  EXPECT_THAT(refusal(tip_path, both), HasSubstr("the column map has [base], and no file for it is given"));
  const std::string elsewhere = folder.write("base.csv", "ms;depth;roll\n900000;0;0\n900250;1;0\n");
  EXPECT_THAT([&] { import_csv(tip_path, load_column_map(both), elsewhere); },
              ::testing::ThrowsMessage<std::runtime_error>(
                  AllOf(HasSubstr("the tip was read at 0.033 to 2.933 s, the base at 898 to 898.25 s"),
                        HasSubstr("no time in common"))));
}

// Rows of one file that each hold one stream.
TEST_F(OwnCsv, StreamsInOneFileAreJoinedByInterpolation) {
  const std::string path = folder.write("own.csv",
                                        "t,depth,roll,x,y,z\n"
                                        "0,0,,,,\n1,10,,,,\n2,20,,,,\n"
                                        "0,,0,,,\n0.5,,1,,,\n2,,4,,,\n"
                                        "0.25,,,0,0,2.5\n1.25,,,0,0,12.5\n");
  const ImportedRecording r = import_csv(path, load_column_map(map({})));
  ASSERT_EQ(r.actuators.size(), 4U);
  EXPECT_NEAR(r.actuators[1].insertion_mm, 5, 1e-12) << "at 0.5 s, half way from 0 to 10";
  EXPECT_NEAR(r.actuators[2].rotation_rad, 2, 1e-12) << "at 1 s, a third of the way from 1 to 4";
  ASSERT_EQ(r.tips.size(), 2U);
  EXPECT_EQ(r.tips[1].utime - r.actuators[0].utime, 1'250'000);
}

TEST_F(OwnCsv, AQuaternionGivesTheHeading) {
  const std::string quaternion = "[tip.quaternion]\ncolumns = [\"qw\", \"qx\", \"qy\", \"qz\"]\nalong = \"-x\"\n";
  const auto with = [&](const std::string& axes) {
    return folder.write("map.toml",
                        "[time]\nseconds = \"t\"\n[tip]\naxes = [\"z\", \"-x\", \"-y\"]\nunit = \"mm\"\n"
                        "sigma_mm = [0.1, 0.1, 0.1]\nheading_sd_rad = 0.01\n" +
                            quaternion + "axes = " + axes + "\n[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\n");
  };
  // The sensor's x turned by +90 degrees about the tracker's z points along its y: -x along -y, which is z of {A}.
  const std::string path = folder.write("q.csv",
                                        "t,depth,x,y,z,qw,qx,qy,qz\n0,0,0,0,0,0.70710678,0,0,0.70710678\n"
                                        "1,10,0,-10,0,0.70710678,0,0,0.70710678\n2,20,0,-20,0,,,,\n");
  const ImportedRecording r = import_csv(path, load_column_map(with("[\"z\", \"-x\", \"-y\"]")));
  ASSERT_EQ(r.headings.size(), 2U);
  EXPECT_LT((r.headings[1].heading - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_EQ(r.tips.size(), 3U) << "a row without a heading has a tip";
  EXPECT_THAT(refusal(path, with("[\"z\", \"x\", \"-y\"]")), HasSubstr("tip.quaternion.axes: is a left-handed frame"));
  EXPECT_THAT(refusal(path, with("[\"z\", \"x\", \"x\"]")), HasSubstr("names an axis twice"));
  const std::string long_one = folder.write("q.csv", "t,depth,x,y,z,qw,qx,qy,qz\n0,0,0,0,0,1,0,0,0.7\n");
  EXPECT_THAT(refusal(long_one, with("[\"z\", \"-x\", \"-y\"]")),
              HasSubstr("q.csv:2: column 'qw' is '1', and the quaternion's length is 1.22"));
}

}  // namespace
}  // namespace bevel::io
