// SPDX-License-Identifier: MIT
// MCAP: what goes out comes back to the last bit, and what is damaged is said and harms nobody.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lz4frame.h>
#include <zstd.h>

#include <filesystem>
#include <set>
#include <tuple>

#include <bevel/io/csv_export.hpp>
#include <bevel/io/json_message.hpp>
#include <bevel/io/mcap_container.hpp>
#include <bevel/io/mcap_export.hpp>
#include <bevel/io/mcap_reader.hpp>
#include <bevel/io/mcap_writer.hpp>
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

Recording actuators_alone(int count) {
  Recording r;
  for (int i = 0; i < count; ++i) {
    r.arrivals.push_back({Arrival::Channel::actuator, r.actuators.size()});
    r.actuators.push_back({1'700'000'000'000'000 + std::int64_t{10'000} * i, i, {2, 2}, 1e-3 * i, 0.1, 1e-4 * i, 0.01});
  }
  return r;
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
  run("bevel-export", "--format mcap -o " + path("two") + " " + path("rec.lcm") + " " + path("other/rec.lcm"), 0);
  EXPECT_TRUE(fs::exists(path("two/other_rec.mcap")));
  EXPECT_TRUE(fs::exists(path("two/" + folder.path().filename().string() + "_rec.mcap")));
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
  std::string file = exported(actuators_alone(5000));
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
      {R"({"utime":1e300,"seq":0,"mode":1,"insertion_rate_mm_s":0,"rotation_rate_rad_s":0})", "'utime' is no whole"},
      {R"({"utime":5,"seq":0,"mode":-3e9,"insertion_rate_mm_s":0,"rotation_rate_rad_s":0})", "'mode' is no whole"},
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

// Scripts add fields, and JavaScript and pandas write integers as 1.0.
TEST_F(McapFile, UnknownFieldsAndIntegersWithAPointAreRead) {
  mcap::Writer file(path("rec.mcap"));
  const auto channel = file.add_channel("MOTION_COMMAND", "bevel.motion_command", "{}");
  file.write(channel, 0, 0,
             R"({"utime":1.7e15,"seq":3.0,"mode":1.0,"insertion_rate_mm_s":1,"rotation_rate_rad_s":2,"mood":"good"})");
  file.close();
  const ImportedMcap got = import_mcap_file(path("rec.mcap"));
  EXPECT_TRUE(got.intact()) << got.faults;
  ASSERT_EQ(got.recording.commands.size(), 1U);
  EXPECT_EQ(got.recording.commands[0].utime, 1'700'000'000'000'000);
  EXPECT_EQ(got.recording.commands[0].seq, 3);
  EXPECT_EQ(got.remarks("rec"), "rec: MOTION_COMMAND has fields that are not read: 'mood'\n");
}

std::string compressed(const std::string& name, const std::string& bytes) {
  std::string out(std::max(::ZSTD_compressBound(bytes.size()), ::LZ4F_compressFrameBound(bytes.size(), nullptr)), 0);
  out.resize(name == "zstd" ? ::ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3)
                            : ::LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr));
  return out;
}

template <class Integer>
std::string field(Integer value) {
  std::string out(sizeof value, 0);
  mcap::put(out.data(), value);
  return out;
}

// The data of `file` with each chunk compressed, and no summary. `size`: what a chunk declares, if that is not true.
std::string with_compressed_chunks(const std::string& file, const std::string& name, std::uint64_t size = 0) {
  std::string out(mcap::kMagic);
  for (std::size_t at = mcap::kMagic.size(); at < file.size();) {
    const auto op = static_cast<mcap::Op>(file[at]);
    const auto length = mcap::get<std::uint64_t>(file.data() + at + 1);
    std::string content = file.substr(at + mcap::kRecordHead, length);
    at += mcap::kRecordHead + length;
    if (op == mcap::Op::chunk) {
      const std::string stored = compressed(name, content.substr(40));
      content = content.substr(0, 28) + field(static_cast<std::uint32_t>(name.size())) + name +
                field(std::uint64_t{stored.size()}) + stored;
      if (size != 0) mcap::put(content.data() + 16, size);
    }
    if (op == mcap::Op::data_end) content.assign(4, 0);  // no CRC-32 of the data
    out += std::string(1, static_cast<char>(op)) + field(std::uint64_t{content.size()}) + content;
    if (op == mcap::Op::data_end) break;
  }
  return out + std::string(1, static_cast<char>(mcap::Op::footer)) + field(std::uint64_t{20}) + std::string(20, 0) +
         std::string(mcap::kMagic);
}

TEST_F(McapFile, CompressedChunksAreRead) {
  const std::string file = exported(actuators_alone(5000));
  const Got whole = read_all(file);
  for (const std::string name : {"zstd", "lz4"}) {
    const std::string small = with_compressed_chunks(file, name);
    ASSERT_LT(small.size(), file.size() / 2);
    const Got got = read_all(small);
    EXPECT_TRUE(got.damage.intact()) << name << ": " << got.damage.describe();
    EXPECT_EQ(got.messages, whole.messages) << name;

    std::string flipped = small;
    flipped[small.size() / 2] ^= 0x10;
    const Got less = read_all(flipped);
    EXPECT_FALSE(less.damage.intact()) << name;
    EXPECT_GT(less.messages.size(), 2000U) << name;
    EXPECT_LT(less.messages.size(), 5000U) << name;

    for (const std::uint64_t size : {std::uint64_t{1}, std::uint64_t{1} << 20U, ~std::uint64_t{0}}) {
      const Got none = read_all(with_compressed_chunks(file, name, size));
      EXPECT_TRUE(none.messages.empty()) << name;
      EXPECT_TRUE(none.damage.has(mcap::Fault::record)) << name;
    }
  }
}

// A recorder that is killed leaves half a chunk: all messages that are there are read.
TEST_F(McapFile, OfAChunkThatIsCutTheMessagesBeforeTheCutAreRead) {
  const std::string file = exported(actuators_alone(5000));
  const std::size_t messages_end = file.find("\"seq\":4000,");
  const Got got = read_all(std::string_view(file).substr(0, messages_end));
  EXPECT_EQ(got.messages.size(), 4000U);
  EXPECT_THAT(got.damage.describe(), HasSubstr("a chunk is cut off"));
  const ImportedMcap imported = import_mcap(std::string_view(file).substr(0, messages_end));
  EXPECT_EQ(imported.recording.actuators.size(), 4000U);
  EXPECT_FALSE(imported.intact());
  // Decoders give whole blocks only; chunks before the cut are read in any case.
  for (const std::string name : {"zstd", "lz4"}) {
    const std::string small = with_compressed_chunks(file, name);
    const Got some = read_all(std::string_view(small).substr(0, small.size() / 2));
    EXPECT_GT(some.messages.size(), 2000U) << name;
    EXPECT_LT(some.messages.size(), 5000U) << name;
    const Got whole = read_all(file);
    for (std::size_t i = 0; i < some.messages.size(); ++i) ASSERT_EQ(some.messages[i], whole.messages[i]) << name;
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
