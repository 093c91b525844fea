// SPDX-License-Identifier: MIT
// Which line of a CSV file is its header, and what separates cells and lines.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <bevel/io/csv_import.hpp>
#include <bevel/io/csv_table.hpp>
#include "tests/support/run_program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

using ::testing::HasSubstr;

class CsvHeaderLine : public ::testing::Test {
 protected:
  // Column "x" of both rows, or the message of the refusal.
  std::string read(const std::string& text) const {
    try {
      CsvTable table(folder.write("own.csv", text));
      std::string out;
      while (table.next())
        out += std::to_string(table.number("t").value()) + " " + std::to_string(*table.number("x")) + "\n";
      return out;
    } catch (const std::runtime_error& e) {
      return e.what();
    }
  }
  static constexpr const char* kRows = "0.000000 1.500000\n0.100000 2.500000\n";
  static constexpr const char* kMap =
      "[time]\ncolumn = \"t\"\nunit = \"s\"\n[tip]\naxes = [\"x\", \"y\", \"z\"]\nunit = \"mm\"\n"
      "sigma_mm = [0.2, 0.2, 0.2]\n[insertion]\ncolumn = \"depth\"\nunit = \"mm\"\n";
  test::TemporaryFolder folder;
};

TEST_F(CsvHeaderLine, IsReadBehindACommentMark) {
  for (const std::string text : {
           "# t,x,y\n0,1.5,7\n0.1,2.5,7\n",  // numpy.savetxt
           "#t,x,y\n0,1.5,7\n0.1,2.5,7\n",
           "% t,x,y\n0,1.5,7\n0.1,2.5,7\n",  // MATLAB
           "# bench A\n#\n# t,x,y\n0,1.5,7\n0.1,2.5,7\n",
           "# t x y\n0 1.5 7\n0.1 2.5 7\n",  // its separator if none is given
           "# t x y\n0,1.5,7\n0.1,2.5,7\n",  // header and rows by different separators
           "# t, x, y\n 0    1.5  7\n 0.1  2.5  7\n",
           "# t;x;y\n0;1,5;7\n0,1;2,5;7\n",
           "#,t,x\n1,0,1.5\n2,0.1,2.5\n",  // # is the name of a column
           "# t,x,y\n0,1.5,nan\n0.1,2.5,nan\n",
           "# t,x,y\n0,1.5,\n0.1,2.5,\n",
       })
    EXPECT_EQ(read(text), kRows) << text;
}

TEST_F(CsvHeaderLine, IsReadBelowANote) {
  for (const std::string text : {
           "bench A\nt,x,y\n0,1.5,7\n0.1,2.5,7\n",
           "bench A, needle 3\n\nt,x,y\n0,1.5,7\n0.1,2.5,7\n",
           "# from, bench, A\nt,x,y\n0,1.5,7\n0.1,2.5,7\n",
           "a note of a 12\" needle\nt,x,y\n0,1.5,7\n0.1,2.5,7\n",
           "note\nt,x,y\n0,1.5,\n0.1,2.5,\n",
           "t,x,y\n# from here on, moving\n0,1.5,7\n# turned here\n0.1,2.5,7\n",
       })
    EXPECT_EQ(read(text), kRows) << text;
}

TEST_F(CsvHeaderLine, SeparatorsAndLineEnds) {
  for (const std::string text : {
           "sep=;\r\nt;x;y\r\n0;1,5;7\r\n0,1;2,5;7\r\n",
           "sep=|\r\nt|x|y\r\n0|1.5|7\r\n0.1|2.5|7\r\n",
           "\xEF\xBB\xBFsep=,\nt,x,y\n0,1.5,7\n0.1,2.5,7\n",
           "\"SEP=;\"\nt;x;y\n0;1.5;7\n0.1;2.5;7\n",
           "sep=\t\nt\tx\ty\n0\t1.5\t7\n0.1\t2.5\t7\n",
           "t|x|y\n0|1,5|7\n0,1|2,5|7\n",
           "t x y\n0 1,5 7\n0,1 2,5 7\n",
           "t,x,y\r0,1.5,7\r0.1,2.5,7\r",
           "t,x,y\n0,1.5,7\r0.1,2.5,7\r\n",
           "t,x,y\r\r\n0,1.5,7\r\r\n0.1,2.5,7\r\r\n",
           "t,x,y\n0,1.5,7,\n0.1,2.5,7,\n",
       })
    EXPECT_EQ(read(text), kRows) << text;
}

TEST_F(CsvHeaderLine, IsRefusedWithTheCause) {
  for (const auto& [text, wanted] : std::vector<std::pair<std::string, std::string>>{
           {"sep=:\nt:x\n0:1\n", "own.csv:1: the separator in 'sep=:' is not known; allowed: sep= with a comma"},
           {"sep=\nt:x\n0:1\n", "own.csv:1: the separator"},
           {"# t,x\n# s,mm\n0,1\n", "own.csv:2: this comment and that of line 1 both have 2 cells"},
           {"0,1.5\n0.1,2.5\n", "line 1 holds numbers: put a line with the names of the columns before it"},
           {"# t,x,y\n0,1.5\n0.1,2.5\n", "line 2 holds numbers: put a line with the names of the columns before it"},
           {"# nothing\n", "has no line but comments"},
           {"", "is empty"},
           {"t,x\n0,1\n#0.1,2\n", "own.csv:3: column 't' is '#0.1', not a number"},  // a row behind # is not left out
           {"t,x\n0,1,5\n0,1,2,5\n", "own.csv:2: has 3 cells, and the header (line 1) names 2; decimal commas need"},
           {"bench A\ntoday 0,1\n",
            "own.csv:2: has 2 cells, and the header (line 1) names 1; if line 1 is a note, put a #"},
       })
    EXPECT_THAT(read(text), HasSubstr(wanted)) << text;
}

TEST_F(CsvHeaderLine, NamesOfNumbersAreNames) {
  CsvTable table(folder.write("own.csv", "0,1,2\n5,6,7\n"));  // pandas.DataFrame without names
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.number("1"), 6);
  EXPECT_FALSE(table.next());
}

TEST_F(CsvHeaderLine, ASecondInsertionIsRefusedWithItsRow) {
  const ColumnMap map = load_column_map(folder.write("map.toml", kMap));
  std::string rows = "t,depth,x,y,z\n";
  int i = 0;
  const auto add = [&](int depth_mm) {
    rows += std::to_string(0.1 * i++) + "," + std::to_string(depth_mm) + ",0,0," + std::to_string(depth_mm) + "\n";
  };
  for (int depth = 0; depth <= 30; ++depth) add(depth);
  for (int depth = 29; depth >= 0; --depth) add(depth);
  EXPECT_NO_THROW(import_csv(folder.write("own.csv", rows), map)) << "withdrawn at the end";
  for (int depth = 1; depth <= 30; ++depth) add(depth);
  try {
    import_csv(folder.write("own.csv", rows), map);
    ADD_FAILURE() << "taken";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("own.csv:62: a second insertion begins"));
  }
}

// One file that cannot be used takes nothing from the others, and leaves no log.
TEST_F(CsvHeaderLine, AFolderWithOneBadFileIsImportedBesidesIt) {
  folder.write("map.toml", kMap);
  std::string rows = "t,depth,x,y,z\n";
  for (int i = 0; i < 30; ++i)
    rows += std::to_string(0.1 * i) + "," + std::to_string(i) + ",0,0," + std::to_string(i) + "\n";
  std::filesystem::create_directories(folder / "in");
  for (const char* name : {"a.csv", "c.csv"}) folder.write(std::string("in/") + name, rows);
  folder.write("in/b.csv", rows + "9,x,0,0,0\n");
  const auto path = [&](const char* name) { return (folder / name).string(); };
  const test::Said said =
      test::run_program(folder, "bevel-import", "-c " + path("map.toml") + " -o " + path("logs") + " " + path("in"));
  EXPECT_EQ(said.status, 1);
  EXPECT_THAT(said.err, HasSubstr("b.csv:32: column 'depth' is 'x', not a number"));
  EXPECT_THAT(said.err, HasSubstr("1 of 3 recordings"));
  std::vector<std::string> left;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "logs"))
    left.push_back(entry.path().filename().string());
  EXPECT_THAT(left, ::testing::UnorderedElementsAre("a.lcm", "c.lcm"));

  const test::Said out = test::run_program(
      folder, "bevel-export",
      "-o " + path("csv") + " " + path("logs/a.lcm") + " " + path("in/b.csv") + " " + path("logs/c.lcm"));
  EXPECT_EQ(out.status, 1);
  EXPECT_THAT(out.err, HasSubstr("1 of 3 logs"));
  left.clear();
  for (const auto& entry : std::filesystem::directory_iterator(folder / "csv"))
    left.push_back(entry.path().filename().string());
  EXPECT_THAT(left, ::testing::UnorderedElementsAre("a", "c"));
}

}  // namespace
}  // namespace bevel::io
