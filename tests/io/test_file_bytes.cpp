// SPDX-License-Identifier: MIT
// Reading files that are not what they should be: one message each, at once, and never a signal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <numeric>
#include <thread>

#include <bevel/io/config.hpp>
#include <bevel/io/csv_import.hpp>
#include <bevel/io/file_bytes.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/io/recording.hpp>
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

template <class Read>
std::string refusal(Read&& read) {
  try {
    read();
  } catch (const std::exception& e) {
    return e.what();
  }
  return "taken";
}

TEST(FileBytes, AreThoseOfTheFile) {
  const test::TemporaryFolder folder;
  const std::string text("a\0b\r\n", 5);
  const std::string path = folder.write("bytes", text);
  const FileBytes file(path);
  EXPECT_EQ(std::string(file.bytes().begin(), file.bytes().end()), text);
  EXPECT_EQ(file.change(), "");
  EXPECT_EQ(read_text_file(path), text);
  EXPECT_TRUE(FileBytes(folder.write("empty", "")).bytes().empty());
}

TEST(FileBytes, EveryReaderRefusesWhatIsNoRegularFileAndSaysWhatItIs) {
  const test::TemporaryFolder folder;
  const std::string fifo = (folder / "fifo").string();
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  const std::pair<std::string, std::string> wrong[] = {{fifo, "it is a FIFO; allowed: a regular file"},
                                                       {"/dev/zero", "it is a device; allowed: a regular file"},
                                                       {folder.path().string(), "it is a directory"},
                                                       {(folder / "none").string(), "No such file"}};
  for (const auto& [path, why] : wrong) {
    const auto expected = AllOf(HasSubstr(path + ": cannot be read: "), HasSubstr(why));
    EXPECT_THAT(refusal([&] { FileBytes file(path); }), expected);
    EXPECT_THAT(refusal([&] { read_recording(path); }), expected);
    EXPECT_THAT(refusal([&] { ConfigFile::load(path); }), expected);
    EXPECT_THAT(refusal([&] { load_model_file(path); }), expected);
    EXPECT_THAT(refusal([&] { load_column_map(path); }), expected);
    EXPECT_THAT(refusal([&] { import_csv(path, {}); }), expected);
  }
}

TEST(FileBytes, ASizeBeyondTheLimitIsRefusedBeforeMemoryIsTaken) {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("sparse", "");
  fs::resize_file(path, kLargestText_bytes + 1);
  EXPECT_THAT(refusal([&] { read_text_file(path); }),
              AllOf(HasSubstr("sparse: cannot be read: 67108865 bytes; at most 67108864 are allowed")));
  fs::resize_file(path, kLargestLog_bytes + 1);
  EXPECT_THAT(refusal([&] { read_recording(path); }), HasSubstr("at most 1073741824 are allowed"));
}

// Memory mapped from a file that is then cut is no longer there: SIGBUS.
TEST(FileBytes, StayWhenTheFileIsCut) {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("cut.lcm", std::string(1 << 20, '\1'));
  const FileBytes file(path);
  fs::resize_file(path, 0);
  EXPECT_EQ(std::accumulate(file.bytes().begin(), file.bytes().end(), 0), 1 << 20);
}

TEST(FileBytes, AFileThatChangesWhileItIsReadIsSaid) {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("busy.lcm", "");
  std::atomic<bool> stop{false};
  std::jthread other([&] {
    for (std::uintmax_t size = 1; !stop; size = size % (8U << 20U) + (1U << 16U)) fs::resize_file(path, size);
  });
  int changed = 0;
  // On a busy machine the other thread may not have its turn for long.
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (changed < 3 && std::chrono::steady_clock::now() < give_up) {
    const FileBytes file(path);
    if (!file.change().empty()) {
      ++changed;
      EXPECT_THAT(file.change(), HasSubstr("changed while it was read, from "));
    }
    const Recording recording = read_recording(path);
    EXPECT_FALSE(recording.intact() && recording.bytes > 0);
  }
  stop = true;
  EXPECT_GT(changed, 0);
}

}  // namespace
}  // namespace bevel::io
