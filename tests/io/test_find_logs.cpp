// SPDX-License-Identifier: MIT
// Which files of a folder are logs, and that no two results get one name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include <bevel/io/find_logs.hpp>
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

const std::string kSync = "\xED\xA1\xDA\x01";

struct FoundLogs : ::testing::Test {
  std::string write(const std::string& name, const std::string& text = "") const {
    fs::create_directories((folder / name).parent_path());
    return folder.write(name, text);
  }
  std::vector<std::string> names(const std::vector<std::string>& paths) const {
    std::vector<std::string> out;
    for (const std::string& log : find_logs(paths)) out.push_back(fs::relative(log, folder.path()).string());
    return out;
  }
  test::TemporaryFolder folder;
};

TEST_F(FoundLogs, HaveTheNamesThatLoggersGive) {
  for (const char* name :
       {"lcmlog-2026-03-02.00", "lcmlog-2026-03-02.01", "lcmlog-today", "a.lcm", "a.lcm.10", "a.lcm.2"})
    write(name);
  for (const char* name : {"run", "run.00", "a.lcm.unfinished", "a.lcm.bak", "b.csv", ".hidden.lcm"})
    write(name, kSync);
  for (const char* name : {"Makefile", "notes.00", "model.toml", "lcmlog-2026.txt"}) write(name, "text");
  fs::create_directories(folder / "folder.lcm");
  EXPECT_THAT(names({folder.path().string()}), ElementsAre("a.lcm", "a.lcm.2", "a.lcm.10", "lcmlog-2026-03-02.00",
                                                           "lcmlog-2026-03-02.01", "lcmlog-today", "run", "run.00"));
}

TEST_F(FoundLogs, AreRefusedIfGivenTwice) {
  const std::string log = write("monday/rec.lcm");
  EXPECT_THAT(
      [&] {
        find_logs({log, (folder / "monday").string()});
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("rec.lcm: given twice")));
  EXPECT_THAT(
      [&] {
        find_logs({(folder / "monday/../monday/rec.lcm").string(), log});
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("given twice")));
}

TEST(ResultNames, AreUniqueAndFromThePath) {
  EXPECT_THAT(result_names({"lcmlog-2026-03-02.00", "lcmlog-2026-03-02.01"}),
              ElementsAre("lcmlog-2026-03-02.00", "lcmlog-2026-03-02.01"));
  EXPECT_THAT(result_names({"x/rec01.lcm", "x/rec02.lcm"}), ElementsAre("rec01", "rec02"));
  EXPECT_THAT(result_names({"monday/rec01.lcm", "tuesday/rec01.lcm", "tuesday/rec02.lcm"}),
              ElementsAre("monday_rec01", "tuesday_rec01", "rec02"));
  EXPECT_THAT(result_names({"a/x/rec01.lcm", "b/x/rec01.lcm"}), ElementsAre("a_x_rec01", "b_x_rec01"));
  EXPECT_THAT(result_names({"rec01.lcm", "rec01.csv"}), ElementsAre("rec01.lcm", "rec01.csv"));
  EXPECT_THAT(result_names({"rec01.lcm", "rec01.lcm.0"}), ElementsAre("rec01", "rec01.lcm.0"));
  EXPECT_THAT(result_names({"/csv/rec01/", "/csv/rec.b"}), ElementsAre("rec01", "rec"));
  // Names that are joined to the same text, up to the root.
  for (const std::vector<std::string>& paths :
       std::vector<std::vector<std::string>>{{"/a_b/c/rec.lcm", "/a/b_c/rec.lcm"},
                                             {"/m/rec.lcm", "/t/rec.lcm", "/t/m_rec.lcm", "/t/t_rec.lcm"},
                                             {"/rec.lcm", "/a/rec.lcm", "/a/a/rec.lcm", "/a_a/rec.lcm"},
                                             {"/a/rec.lcm", "/a/rec.0.lcm", "/b/rec", "/b/rec.0"}}) {
    const auto names = result_names(paths);
    EXPECT_EQ(std::set(names.begin(), names.end()).size(), paths.size()) << ::testing::PrintToString(names);
    for (const std::string& name : names) EXPECT_EQ(name.find('/'), std::string::npos);
  }
}

}  // namespace
}  // namespace bevel::io
