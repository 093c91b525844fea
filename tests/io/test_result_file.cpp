// SPDX-License-Identifier: MIT
// Result files on a disk that is full, over links and devices, and beside a file that is there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string>

#include <bevel/io/csv_export.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/io/result_file.hpp>
#include <bevel/report/page.hpp>
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::size_t files_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

// True if `write` throws where no file may have more than 100 bytes: further writes fail as on a full disk.
bool fails_on_a_full_disk(const std::function<void()>& write) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{100, 100};
    ::setrlimit(RLIMIT_FSIZE, &small);
    try {
      write();
    } catch (const std::runtime_error& e) {
      ::_exit(std::string(e.what()).find("cannot be written") == std::string::npos ? 2 : 0);
    }
    ::_exit(1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

class ResultFile : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
};

TEST_F(ResultFile, OnAFullDiskKeepsThePreviousOne) {
  const std::string path = folder_ / "result";
  std::ofstream(path) << "old";
  const std::function<void()> writers[] = {[&] { write_result_file(path, std::string(5000, 'n')); },
                                           [&] { save_model_file({}, path); },
                                           [&] { report::Page("Title").save(path); }};
  for (const auto& write : writers) {
    EXPECT_TRUE(fails_on_a_full_disk(write));
    EXPECT_EQ(text_of(path), "old");
    EXPECT_EQ(files_in(folder_.path()), 1U);
  }
}

TEST_F(ResultFile, OnAFullDiskLeavesNoTableCut) {
  Recording recording;
  recording.actuators.resize(50);
  const fs::path out = folder_ / "out";
  EXPECT_TRUE(fails_on_a_full_disk([&] { export_csv(recording, out.string()); }));
  EXPECT_FALSE(fs::exists(out / "actuator_state.csv"));
}

TEST_F(ResultFile, ReplacesTheFileAndKeepsItsMode) {
  const fs::path path = folder_ / "result";
  std::ofstream(path) << "old";
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  write_result_file(path.string(), "new");
  EXPECT_EQ(text_of(path), "new");
  EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(ResultFile, FollowsASymbolicLink) {
  const fs::path link = folder_ / "link", path = folder_ / "result";
  std::ofstream(path) << "old";
  fs::create_symlink("result", link);
  write_result_file(link.string(), "new");
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(text_of(path), "new");
}

TEST_F(ResultFile, WritesToADeviceAndDoesNotReplaceIt) {
  write_result_file("/dev/null", "new");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_THAT([] { write_result_file("/dev/full", "new"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("/dev/full: cannot be written: No space left on device")));
}

TEST_F(ResultFile, ReportsWhatPreventsIt) {
  EXPECT_THAT([&] { write_result_file(folder_.path().string(), "new"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("Is a directory")));
  EXPECT_THAT([&] { require_writable((folder_ / "none" / "result").string()); },
              ThrowsMessage<std::runtime_error>(HasSubstr("no file can be made in its folder: No such file")));
}

}  // namespace
}  // namespace bevel::io
