// MCAP: what goes out comes back to the last bit, and what is damaged is said and harms nobody.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <tuple>

#include "io/csv_export.hpp"
#include "io/json_message.hpp"
#include "io/mcap_container.hpp"
#include "io/mcap_export.hpp"
#include "io/mcap_reader.hpp"
#include "io/mcap_writer.hpp"
#include "tests/io/odd_recordings.hpp"
#include "tests/support/run_program.hpp"

namespace bevel::io {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

struct McapFile : ::testing::Test {
  std::string path(const std::string& name) const { return (folder / name).string(); }
  std::string exported(const Recording& recording) const {
    export_mcap(recording, path("rec.mcap"));
    return test::text_of(path("rec.mcap"));
  }
  test::TemporaryFolder folder;
};

// What a reader was given.
struct Got {
  std::vector<std::tuple<std::string, std::uint32_t, std::string>> messages;
  std::vector<std::string> attachments;
  mcap::Damage damage;
};
Got read_all(std::string_view file) {
  Got got;
  got.damage = mcap::read(
      file, {.on_message = [&](const mcap::Message& m) { got.messages.emplace_back(m.topic, m.sequence, m.data); },
             .on_attachment = [&](const mcap::Attachment& a) { got.attachments.emplace_back(a.data); }});
  return got;
}

// A file with two chunks' worth of everything that is small enough to be broken at each byte.
std::string small_file(const std::string& path) {
  mcap::Writer file(path);
  const auto tips = file.add_channel("TIP", "bevel.tip", R"({"type":"object","properties":{}})");
  file.write(tips, 0, 1000, R"({"utime":1})");
  file.write(tips, 1, 2000, R"({"utime":2})");
  file.attach("config.toml", "application/toml", "a = 1\n");  // which ends a chunk
  file.write(tips, 2, 3000, R"({"utime":3})");
  const auto axes = file.add_channel("AXES", "bevel.axes", R"({"type":"object","properties":{}})");
  file.write(axes, 0, 3000, R"({"utime":3})");
  file.close();
  return test::text_of(path);
}

TEST_F(McapFile, LogMcapLogIsTheSameLogByteForByte) {
  int unseen = 0, negative_zeros = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    Recording made = test::OddRecordings(seed).recording();
    // Messages may hold a number along an axis of which they say nothing.
    for (std::size_t i = 0; i < made.tips.size(); ++i)
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        if (made.tips[i].information_per_mm2.row(axis).isZero(0)) {
          made.tips[i].position_mm[axis] = i % 3 == 0 ? -0.0 : i % 3 == 1 ? 17.25 : 0.0;
          unseen += i % 3 != 2;
        }
    write_log(made, path("made.lcm"));
    const Recording read = read_recording(path("made.lcm"));
    ASSERT_TRUE(read.intact()) << seed << ": " << read.describe_faults();
    const std::string file = exported(read);
    for (std::size_t at = 0; (at = file.find(":-0.0", at)) != std::string::npos; ++at) ++negative_zeros;
    const ImportedMcap back = import_mcap_file(path("rec.mcap"));
    ASSERT_TRUE(back.intact()) << seed << ": " << back.faults;
    write_log(back.recording, path("back.lcm"));
    ASSERT_EQ(test::text_of(path("made.lcm")), test::text_of(path("back.lcm"))) << "seed " << seed;
  }
  EXPECT_GT(unseen, 30);
  EXPECT_GT(negative_zeros, 30);
}

TEST_F(McapFile, ThePrograms) {
  write_log(test::OddRecordings(7).recording(), path("rec.lcm"));
  const auto run = [&](const std::string& program, const std::string& arguments, int status) {
    const test::Said said = test::run_program(folder, program, arguments);
    EXPECT_EQ(said.status, status) << program << ": " << said.err;
    return said.err;
  };
  run("bevel-export", "--format mcap -o " + path("out") + " " + path("rec.lcm"), 0);
  run("bevel-import", "-o " + path("logs") + " " + path("out/rec.mcap"), 0);
  EXPECT_EQ(test::text_of(path("rec.lcm")), test::text_of(path("logs/rec.lcm")));
  EXPECT_THAT(run("bevel-import", "-o " + path("logs") + " " + path("out/rec.mcap"), 1), HasSubstr("is there already"));

  std::string scratched = test::text_of(path("out/rec.mcap"));
  scratched[scratched.size() - 12] ^= 1;  // the summary's CRC: all messages are there
  folder.write("scratched.mcap", scratched);
  EXPECT_THAT(run("bevel-import", "-o " + path("logs") + " " + path("scratched.mcap"), 3),
              HasSubstr("scratched.mcap: damaged: byte"));
  EXPECT_EQ(test::text_of(path("rec.lcm")), test::text_of(path("logs/scratched.lcm")));
  folder.write("foreign.mcap", "no such format");
  EXPECT_THAT(run("bevel-import", "-o " + path("logs") + " " + path("foreign.mcap"), 1),
              HasSubstr("foreign.mcap: does not begin as an MCAP file"));
  EXPECT_FALSE(fs::exists(path("logs/foreign.lcm")));
  fs::create_directories(folder / "other");
  fs::copy_file(path("rec.lcm"), folder / "other/rec.lcm");
  EXPECT_THAT(run("bevel-export", "-o " + path("two") + " " + path("rec.lcm") + " " + path("other/rec.lcm"), 1),
              HasSubstr("would both become rec"));
}

TEST_F(McapFile, EachFlippedByteIsTold) {
  const std::string file = small_file(path("small.mcap"));
  const Got whole = read_all(file);
  ASSERT_TRUE(whole.damage.intact()) << whole.damage.describe();
  ASSERT_EQ(whole.messages.size(), 4U);
  ASSERT_EQ(whole.attachments, std::vector<std::string>{"a = 1\n"});
  const std::set known(whole.messages.begin(), whole.messages.end());
  int lost_nothing = 0, cases = 0;
  for (std::size_t at = 0; at < file.size(); ++at)
    for (const int mask : {0x01, 0x10, 0x80, 0xFF}) {
      std::string flipped = file;
      flipped[at] = static_cast<char>(flipped[at] ^ mask);
      const Got got = read_all(flipped);
      ASSERT_FALSE(got.damage.intact()) << "byte " << at << " ^ " << mask;
      for (const auto& message : got.messages) ASSERT_TRUE(known.contains(message)) << "byte " << at << " ^ " << mask;
      for (const auto& attachment : got.attachments) ASSERT_EQ(attachment, "a = 1\n");
      ASSERT_FALSE(got.damage.describe().empty());
      lost_nothing += got.messages.size() == 4 ? 1 : 0;
      ++cases;
    }
  // Half of so small a file is indices and summary, of which nothing is needed.
  EXPECT_GT(lost_nothing, cases / 3);
}

TEST_F(McapFile, OfACutFileTheChunksBeforeTheCutAreRead) {
  const std::string file = small_file(path("small.mcap"));
  const Got whole = read_all(file);
  std::size_t most = 0;
  for (std::size_t size = 0; size < file.size(); ++size) {
    const Got got = read_all(std::string_view(file).substr(0, size));
    ASSERT_FALSE(got.damage.intact()) << size;
    ASSERT_LE(got.messages.size(), whole.messages.size());
    for (std::size_t i = 0; i < got.messages.size(); ++i) ASSERT_EQ(got.messages[i], whole.messages[i]) << size;
    ASSERT_GE(got.messages.size(), most) << "a longer piece holds no less, cut at " << size;
    most = got.messages.size();
  }
  EXPECT_EQ(most, whole.messages.size());
}

TEST_F(McapFile, LengthsThatLeadAnywhereLeadNowhere) {
  const std::string file = small_file(path("small.mcap"));
  const std::set known = [&] {
    const Got got = read_all(file);
    return std::set(got.messages.begin(), got.messages.end());
  }();
  for (const std::uint64_t length : {std::uint64_t{1} << 31U, std::uint64_t{1} << 63U, ~std::uint64_t{0},
                                     ~std::uint64_t{0} - 8, std::uint64_t{file.size()}})
    for (std::size_t at = 0; at + 8 <= file.size(); ++at) {
      std::string wrong = file;
      mcap::put(wrong.data() + at, length);
      const Got got = read_all(wrong);
      ASSERT_FALSE(got.damage.intact()) << "byte " << at;
      for (const auto& message : got.messages) ASSERT_TRUE(known.contains(message)) << "byte " << at;
    }
}

TEST_F(McapFile, ADamagedChunkCostsItselfAndIsCounted) {
  Recording r;
  for (int i = 0; i < 5000; ++i) {
    r.arrivals.push_back({Arrival::Channel::actuator, r.actuators.size()});
    r.actuators.push_back({1'700'000'000'000'000 + std::int64_t{10'000} * i, i, {2, 2}, 1e-3 * i, 0.1, 1e-4 * i, 0.01});
  }
  std::string file = exported(r);
  file[file.size() / 2] ^= 1;
  const ImportedMcap some = import_mcap(file);
  EXPECT_THAT(some.faults, HasSubstr("has not its CRC-32; it is left out"));
  EXPECT_THAT(some.faults, HasSubstr(std::to_string(some.recording.actuators.size()) +
                                     " messages were read of 5000 that the file says it has"));
  EXPECT_GT(some.recording.actuators.size(), 2000U);
  EXPECT_LT(some.recording.actuators.size(), 5000U);
  for (const auto& a : some.recording.actuators) ASSERT_EQ(a.insertion_mm, 1e-3 * static_cast<double>(a.seq));
}

// By the summary, which is sound: without it whatever is behind such a length would be lost.
TEST_F(McapFile, BehindALengthThatLeadsNowhereTheNextChunkIsFound) {
  const std::string file = small_file(path("small.mcap"));
  const std::size_t first_chunk = mcap::kMagic.size() + mcap::kRecordHead + 4 + 4 + std::string_view("bevel").size();
  ASSERT_EQ(file[first_chunk], static_cast<char>(mcap::Op::chunk));
  std::string wrong = file;
  mcap::put(wrong.data() + first_chunk + 1, std::uint64_t{1} << 63U);
  const Got got = read_all(wrong);
  const Got whole = read_all(file);
  EXPECT_EQ(got.attachments, whole.attachments);
  EXPECT_EQ(got.messages, decltype(got.messages)(whole.messages.begin() + 2, whole.messages.end()));
  EXPECT_THAT(got.damage.describe(), HasSubstr("a record that leads beyond the file"));
  EXPECT_THAT(got.damage.describe(), HasSubstr("2 messages were read of 4"));
}

// Messages as other writers put them: spaces, another order, null, text where a number should be.
TEST_F(McapFile, AnyGoodJsonIsReadAndAnyOtherIsNamed) {
  const auto import = [&](const std::vector<std::string>& commands) {
    mcap::Writer file(path("rec.mcap"));
    const auto channel = file.add_channel("MOTION_COMMAND", "bevel.motion_command", "{}");
    for (std::uint32_t i = 0; i < commands.size(); ++i) file.write(channel, i, std::uint64_t{1000} * i, commands[i]);
    file.close();
    return import_mcap_file(path("rec.mcap"));
  };
  const std::string as_written = R"({"utime":5,"seq":0,"mode":1,"insertion_rate_mm_s":0.1,"rotation_rate_rad_s":-0.0})";
  const std::string otherwise =
      R"({ "rotation_rate_rad_s": -0.0, "insertion_rate_mm_s": 1e-1, "mode": 1, "seq": 0, "utime": 5 })";
  const ImportedMcap both = import({as_written, otherwise});
  EXPECT_TRUE(both.intact()) << both.faults;
  ASSERT_EQ(both.recording.commands.size(), 2U);
  for (const auto& c : both.recording.commands) {
    EXPECT_EQ(c.insertion_rate_mm_s, 0.1);
    EXPECT_TRUE(std::signbit(c.rotation_rate_rad_s));
  }
  const std::vector<std::pair<std::string, std::string>> wrong{
      {R"({"utime":5})", "'seq' is no whole number"},
      {R"([1,2])", "is no JSON object"},
      {R"({"utime":5,)", "is no JSON object"},
      {R"({"utime":5,"seq":0,"mode":1.5,"insertion_rate_mm_s":0,"rotation_rate_rad_s":0})", "'mode' is no whole"},
      {R"({"utime":5,"seq":0,"mode":5000000000,"insertion_rate_mm_s":0,"rotation_rate_rad_s":0})", "'mode' is no"},
      {R"({"utime":5,"seq":0,"mode":1,"insertion_rate_mm_s":"0","rotation_rate_rad_s":0})", "'insertion_rate_mm_s' is"},
      {R"({"utime":5,"seq":0,"mode":1,"insertion_rate_mm_s":0,"rotation_rate_rad_s":nan})", "not finite"},
      {R"({"utime":5,"seq":0,"mode":1,"insertion_rate_mm_s":0,"rotation_rate_rad_s":0,"x":1})", "fields that these"},
      {R"({"utime":5,"seq":0,"mode":7,"insertion_rate_mm_s":0,"rotation_rate_rad_s":0})", "out of range"}};
  for (const auto& [json, why] : wrong) {
    const ImportedMcap one = import({as_written, json});
    EXPECT_THAT(one.faults, HasSubstr(why)) << json;
    EXPECT_THAT(one.faults, HasSubstr("message 1 of MOTION_COMMAND")) << json;
    EXPECT_EQ(one.recording.commands.size(), 1U) << json;
    const auto alone = [&, message = json] { import({message}); };
    EXPECT_THAT(alone, ThrowsMessage<std::runtime_error>(HasSubstr("no message that can be used")));
  }
}

TEST_F(McapFile, WhatWasNotSeenIsNotThere) {
  tip_measurement_t tip{};
  tip.utime = 5;
  tip.position_mm[0] = 1.5, tip.position_mm[1] = 2.5;
  tip.information_per_mm2[0] = 44;
  const JsonLayout layout = JsonLayout::of<tip_measurement_t>(false);
  std::string text(layout.largest_size(), ' ');
  JsonWriter writer(layout, text.data());
  visit_columns(tip, writer);
  text.resize(static_cast<std::size_t>(writer.end() - text.data()));
  EXPECT_THAT(text, ::testing::StartsWith(
                        R"({"utime":5,"seq":0,"camera":0,"status":0,"x_mm":1.5,"unseen_y_mm":2.5,"ixx_per_mm2":44,)"));
  const std::string schema = layout.schema();
  EXPECT_THAT(schema, HasSubstr(R"("x_mm":{"type":"number"})"));
  EXPECT_THAT(schema, HasSubstr(R"("required":["utime","seq","camera","status","ixx_per_mm2",)"));
  tip.position_mm[2] = std::nan("");
  tip.information_per_mm2[8] = 1;
  EXPECT_THROW(visit_columns(tip, JsonWriter(layout, text.data())), std::runtime_error);
}

}  // namespace
}  // namespace bevel::io
