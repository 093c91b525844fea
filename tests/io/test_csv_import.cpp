#include <gtest/gtest.h>

#include <filesystem>

#include "io/csv_export.hpp"
#include "io/csv_import.hpp"
#include "tests/support/shared_recordings.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

class CsvImport : public ::testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) const { return folder.write(name, text); }
  std::string map(const std::string& insertion = "column = \"-Base y\"\nsettled = true\n") const {
    return file("map.toml",
                "[time]\nseconds = \"s\"\nnanoseconds = \"ns\"\n[tip]\naxes = [\"Tip z\", \"-Tip x\", \"-Tip y\"]\n"
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
  EXPECT_NE(
      message(file("b.csv", std::string(kHeader) + row), map("column = \"-Bass y\"\n")).find("nearest is 'Base y'"),
      std::string::npos);
  const std::string text = message(file("c.csv", std::string(kHeader) + row + "102,0,ten,0,0,10,0,30,-5\n"), map());
  EXPECT_NE(text.find("c.csv:3: column 'Tip x' is 'ten'"), std::string::npos) << text;
  EXPECT_NE(message(file("d.csv", std::string(kHeader)), map()).find("no row with data"), std::string::npos);
  EXPECT_NE(message((folder / "none.csv").string(), map()).find("cannot be read"), std::string::npos);
  EXPECT_NE(message(file("e.csv", std::string(kHeader) + row), file("bad.toml", "[time]\n")).find("time"),
            std::string::npos);
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
    EXPECT_EQ(r.actuators.back().insertion_mm, 100) << entry.path();
    for (std::size_t i = 1; i < r.tips.size(); ++i)
      EXPECT_NEAR(r.tips[i].position_mm.z(), r.actuators[i].insertion_mm, 4.0) << entry.path() << " step " << i;
    EXPECT_LT(r.tips.back().position_mm.y(), -2) << "bends toward -y of {A}";
  }
  EXPECT_EQ(files, 12);
}

}  // namespace
}  // namespace bevel::io
