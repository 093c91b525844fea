// SPDX-License-Identifier: MIT
// Logs: written, read back, damaged at every byte, and read by LCM's own tools.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include <chrono>
#include <cstdlib>
#include <random>
#include <set>
#include <span>

#include <bevel/io/log_reader.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>
#include <bevel/io/recording.hpp>
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

using Bytes = std::vector<std::uint8_t>;

class TemporaryLog {
 public:
  explicit TemporaryLog(const std::string& name) : path_((folder_ / name).string()) {}
  const std::string& path() const { return path_; }
  Bytes bytes() const {
    const std::string text = test::text_of(path_);
    return {text.begin(), text.end()};
  }

 private:
  test::TemporaryFolder folder_;
  std::string path_;
};

actuator_state_t actuator(std::int64_t seq) {
  actuator_state_t message{};
  message.utime = 1'700'000'000'000'000 + 10'000 * seq;
  message.seq = seq;
  message.axis_status[0] = message.axis_status[1] = 2;
  message.insertion_mm = 0.05 * static_cast<double>(seq);
  return message;
}

tip_measurement_t tip(std::int64_t seq) {
  tip_measurement_t message{};
  message.utime = 1'700'000'000'000'000 + 33'000 * seq;
  message.seq = seq;
  message.position_mm[2] = static_cast<double>(seq);
  for (int i = 0; i < 3; ++i) message.information_per_mm2[4 * i] = 100.0;
  return message;
}

constexpr int kSmallLogEvents = 7;
Bytes small_log() {
  const TemporaryLog file("small.lcm");
  LogWriter writer(file.path());
  writer.write_text(1000, channel::kConfig, "[needle]\n");
  for (std::int64_t i = 1; i <= 3; ++i) {
    writer.write_message(1000 + 2 * i, channel::kActuatorState, actuator(i));
    writer.write_message(1001 + 2 * i, channel::kTipMeasurement, tip(i));
  }
  writer.close();
  return file.bytes();
}

std::vector<LogEvent> read_all(std::span<const std::uint8_t> bytes, LogDamage& damage) {
  std::vector<LogEvent> events;
  LogReader reader(bytes);
  while (const auto event = reader.next()) events.push_back(*event);
  damage = reader.damage();
  return events;
}

// Bytes of all events, so that with the damage reported every byte of the file is accounted for.
std::size_t size_of(const std::vector<LogEvent>& events) {
  std::size_t size = 0;
  for (const auto& event : events) size += 28 + event.channel.size() + event.data.size();
  return size;
}

TEST(Log, reads_back_what_was_written) {
  const Bytes log = small_log();
  LogDamage damage;
  const auto events = read_all(log, damage);
  ASSERT_EQ(events.size(), kSmallLogEvents);
  EXPECT_TRUE(damage.intact());
  EXPECT_EQ(events[0].channel, "CONFIG");
  EXPECT_EQ(events[2].channel, "TIP_MEASUREMENT");
  EXPECT_EQ(events[2].number, 2);
  EXPECT_EQ(events[2].timestamp_us, 1003);
  EXPECT_EQ(Bytes(events[2].data.begin(), events[2].data.end()), encode(tip(1)));
}

TEST(Log, an_empty_log_is_intact_and_a_foreign_file_is_not) {
  LogDamage damage;
  EXPECT_TRUE(read_all({}, damage).empty());
  EXPECT_TRUE(damage.intact());
  const Bytes foreign(1000, 'x');
  EXPECT_TRUE(read_all(foreign, damage).empty());
  EXPECT_EQ(damage.skipped_bytes, 1000);
}

TEST(Log, cut_at_every_byte_gives_the_whole_events_and_a_torn_tail) {
  const Bytes log = small_log();
  LogDamage damage;
  const auto whole = read_all(log, damage);
  std::set<std::size_t> ends{0};
  for (const auto& event : whole) ends.insert(event.offset + 28 + event.channel.size() + event.data.size());
  for (std::size_t size = 0; size <= log.size(); ++size) {
    const Bytes cut(log.begin(), log.begin() + static_cast<std::ptrdiff_t>(size));
    const auto events = read_all(cut, damage);
    const auto last_end = *std::prev(ends.upper_bound(size));
    EXPECT_EQ(size_of(events), last_end) << "cut at " << size;
    EXPECT_EQ(damage.torn_tail_bytes, static_cast<std::int64_t>(size - last_end)) << "cut at " << size;
    EXPECT_EQ(damage.skipped_bytes, 0) << "cut at " << size;
  }
}

// One flipped byte costs at most the event in which it lies, and nothing that is read is made up.
TEST(Log, flipped_at_every_byte_costs_at_most_one_event) {
  const Bytes log = small_log();
  LogDamage damage;
  const Recording original = read_recording(log);
  ASSERT_TRUE(original.intact());
  ASSERT_EQ(original.tips.size() + original.actuators.size(), 6U);
  for (std::size_t at = 0; at < log.size(); ++at) {
    for (const std::uint8_t mask : {0x01, 0x80, 0xff}) {
      Bytes flipped = log;
      flipped[at] ^= mask;
      const auto events = read_all(flipped, damage);
      EXPECT_GE(events.size(), kSmallLogEvents - 1U) << "byte " << at << " mask " << int{mask};
      EXPECT_EQ(size_of(events) + static_cast<std::size_t>(damage.skipped_bytes + damage.torn_tail_bytes), log.size())
          << "byte " << at << " mask " << int{mask};
      const Recording recording = read_recording(flipped);
      EXPECT_GE(recording.tips.size() + recording.actuators.size(), 5U) << "byte " << at << " mask " << int{mask};
    }
  }
}

// What a flipped byte can do to an axis without a word is no more than the axis could do between two samples.
TEST(Recording, a_flipped_byte_moves_no_axis_in_silence) {
  const TemporaryLog file("axes.lcm");
  constexpr std::int64_t kSamples = 24;
  {
    LogWriter writer(file.path());
    for (std::int64_t i = 1; i <= kSamples; ++i) {
      actuator_state_t message = actuator(i);
      message.insertion_mm = 20 + 0.1 * static_cast<double>(i);  // 10 mm/s
      message.rotation_rad = 1 + 0.02 * static_cast<double>(i);  // 2 rad/s
      writer.write_message(message.utime, channel::kActuatorState, message);
      if (i % 3 == 0) writer.write_message(message.utime, channel::kTipMeasurement, tip(i / 3));
    }
    writer.close();
  }
  const Bytes log = file.bytes();
  const Recording original = read_recording(log);
  ASSERT_TRUE(original.intact()) << original.describe_faults();
  int told = 0, flips = 0;
  double largest_mm = 0, largest_rad = 0;
  for (std::size_t at = 0; at < log.size(); ++at)
    for (const std::uint8_t mask : {0x01, 0x10, 0x40, 0x80, 0xff}) {
      Bytes flipped = log;
      flipped[at] ^= mask;
      const Recording recording = read_recording(flipped);
      EXPECT_EQ(recording.refusal(), "") << "byte " << at << " mask " << int{mask};
      EXPECT_GE(recording.actuators.size() + 1, original.actuators.size()) << "byte " << at << " mask " << int{mask};
      EXPECT_EQ(recording.intact(), recording.remarks("x").empty());
      ++flips;
      if (!recording.intact()) ++told;
      for (const auto& a : recording.actuators) {
        const auto same = std::ranges::find(original.actuators, a.seq, &model::ActuatorState::seq);
        if (same == original.actuators.end() || a.seq == 1 || a.seq == kSamples) continue;  // one neighbour only
        largest_mm = std::max(largest_mm, std::abs(a.insertion_mm - same->insertion_mm));
        largest_rad = std::max(largest_rad, std::abs(a.rotation_rad - same->rotation_rad));
      }
    }
  std::printf("%d of %d flipped bytes told; of the others the largest moves an axis by %.2f mm, %.2f rad\n", told,
              flips, largest_mm, largest_rad);
  EXPECT_LT(largest_mm, 1);
  EXPECT_LT(largest_rad, 0.5);
}

TEST(Recording, cut_at_every_byte_it_is_damaged_unless_the_cut_is_between_events) {
  const Bytes log = small_log();
  LogDamage damage;
  std::set<std::size_t> ends{0};
  for (const auto& event : read_all(log, damage))
    ends.insert(event.offset + 28 + event.channel.size() + event.data.size());
  for (std::size_t size = 0; size <= log.size(); ++size) {
    const Recording recording = read_recording(std::span(log).first(size));
    EXPECT_EQ(recording.intact(), ends.count(size) == 1) << "cut at " << size;
    const bool has_message = recording.tips.size() + recording.actuators.size() > 0;
    EXPECT_EQ(recording.refusal().empty(), has_message) << "cut at " << size;
  }
  EXPECT_THAT(read_recording(std::span(log).first(0)).refusal(), ::testing::HasSubstr("the file is empty"));
}

TEST(Log, damage_of_several_bytes_and_rubbish_between_events_are_skipped_and_counted) {
  const Bytes log = small_log();
  LogDamage damage;
  const auto whole = read_all(log, damage);
  Bytes damaged(log.begin(), log.begin() + static_cast<std::ptrdiff_t>(whole[3].offset));
  const Bytes rubbish(500, 0xED);  // the first byte of the magic, over and over
  damaged.insert(damaged.end(), rubbish.begin(), rubbish.end());
  damaged.insert(damaged.end(), log.begin() + static_cast<std::ptrdiff_t>(whole[3].offset), log.end());
  // The event before the rubbish ends where nothing that may follow an event stands, so it is doubted too.
  const auto events = read_all(damaged, damage);
  EXPECT_EQ(events.size(), kSmallLogEvents - 1U);
  EXPECT_EQ(damage.regions, 1);
  EXPECT_EQ(damage.torn_tail_bytes, 0);
  EXPECT_EQ(damage.skipped_bytes, static_cast<std::int64_t>(500 + whole[3].offset - whole[2].offset));
  EXPECT_THAT(damage.describe(), ::testing::HasSubstr("1 damaged place"));
}

TEST(Log, a_data_length_of_2_to_the_31_is_damage_and_not_a_crash) {
  Bytes log = small_log();
  log[24] = 0x7f;
  log[25] = log[26] = log[27] = 0xff;
  LogDamage damage;
  EXPECT_EQ(read_all(log, damage).size(), kSmallLogEvents - 1U);
  EXPECT_FALSE(damage.intact());
}

TEST(Log, random_bytes_full_of_magics_are_read_in_linear_time) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  Bytes noise(1 << 20);
  for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
  for (std::size_t i = 0; i + 32 < noise.size(); i += 32) {
    const Bytes magic{0xED, 0xA1, 0xDA, 0x01};
    std::copy(magic.begin(), magic.end(), noise.begin() + static_cast<std::ptrdiff_t>(i));
  }
  LogDamage damage;
  const auto events = read_all(noise, damage);
  EXPECT_EQ(size_of(events) + static_cast<std::size_t>(damage.skipped_bytes + damage.torn_tail_bytes), noise.size());
}

TEST(Log, files_that_cannot_be_opened_are_named) {
  EXPECT_THROW(read_recording("/nonexistent.lcm"), std::runtime_error);
  EXPECT_THROW(read_recording("/tmp"), std::runtime_error);
  EXPECT_THROW(LogWriter("/nonexistent/out.lcm"), std::runtime_error);
}

TEST(Log, a_full_disk_is_said_with_the_files_name) {
  const auto fill = [](int messages) -> std::string {
    try {
      LogWriter writer("/dev/full");
      for (std::int64_t i = 1; i <= messages; ++i) writer.write_message(i, channel::kActuatorState, actuator(i));
      writer.close();
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "written";
  };
  EXPECT_EQ(fill(1), "/dev/full: cannot be written: No space left on device");       // at close()
  EXPECT_EQ(fill(10'000), "/dev/full: cannot be written: No space left on device");  // at a write()
}

TEST(Recording, sorts_channels_counts_rejects_and_skips_what_it_does_not_know) {
  const TemporaryLog file("recording.lcm");
  {
    LogWriter writer(file.path());
    writer.write_text(1, channel::kConfig, "k = 1");
    writer.write_text(2, "LCM_SELF_TEST", "lcm self test");
    writer.write_message(3, channel::kTipMeasurement, tip(1));
    auto bad = tip(2);
    bad.position_mm[1] = std::numeric_limits<double>::quiet_NaN();
    writer.write_message(4, channel::kTipMeasurement, bad);
    writer.write_message(5, channel::kTipMeasurement, actuator(3));  // the wrong type on the channel
    writer.write_message(6, channel::kActuatorState, actuator(4));
    writer.close();
  }
  const Recording recording = read_recording(file.path());
  EXPECT_EQ(recording.events, 6);
  EXPECT_EQ(recording.config, "k = 1");
  ASSERT_EQ(recording.tips.size(), 1U);
  EXPECT_DOUBLE_EQ(recording.tips[0].information_per_mm2(1, 1), 100.0);
  EXPECT_EQ(recording.actuators.size(), 1U);
  EXPECT_EQ(recording.skipped_channels.at("LCM_SELF_TEST"), 1);
  EXPECT_EQ(recording.rejected(), 2);
  EXPECT_FALSE(recording.intact());
  EXPECT_THAT(recording.describe_faults(), ::testing::HasSubstr("TIP_MEASUREMENT: 1 refused (not finite)"));
  EXPECT_THAT(recording.describe_faults(), ::testing::HasSubstr("TIP_MEASUREMENT: 1 refused (size)"));
}

// PROCESS_STATUS gained state_code: its events in older logs have another fingerprint, and four bytes less.
TEST(Recording, CountsAProcessStatusOfAnOlderLogAsSkippedAndStaysIntact) {
  process_status_t status{};
  status.utime = 1'700'000'000'000'000;
  status.process = "bevel-controller";
  status.state = "stopped";
  Bytes older = encode(status);
  older[0] ^= 1U;
  older.erase(older.end() - 4, older.end());
  EXPECT_FALSE(checked_decode<process_status_t>(older.data(), older.size()));
  const TemporaryLog file("older.lcm");
  {
    LogWriter writer(file.path());
    writer.write_message(1, channel::kTipMeasurement, tip(1));
    writer.write(2, channel::kProcessStatus, older);
    writer.write(3, channel::kProcessStatus, older);
    writer.write_message(4, channel::kActuatorState, actuator(4));
    writer.close();
  }
  const Recording recording = read_recording(file.path());
  EXPECT_EQ(recording.skipped_channels.at(channel::kProcessStatus), 2);
  EXPECT_EQ(recording.tips.size() + recording.actuators.size(), 2U);
  EXPECT_EQ(recording.rejected(), 0);
  EXPECT_TRUE(recording.intact());
}

TEST(Recording, speed) {
  const TemporaryLog file("speed.lcm");
  constexpr int kEvents = 200'000;
  {
    LogWriter writer(file.path());
    for (std::int64_t i = 1; i <= kEvents; ++i) writer.write_message(i, channel::kActuatorState, actuator(i));
    writer.close();
  }
  const auto start = std::chrono::steady_clock::now();
  const Recording recording = read_recording(file.path());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  EXPECT_EQ(recording.actuators.size(), static_cast<std::size_t>(kEvents));
  RecordProperty("million_events_per_s", std::to_string(1e-6 * kEvents / took.count()));
  std::printf("decoded %.1f million events/s\n", 1e-6 * kEvents / took.count());
}

// Python's lcm.EventLog reads what we write, and the other way round.
TEST(LogInterop, pythons_event_log_and_ours_agree) {
  const std::string source = BEVEL_SOURCE_DIR;
  const std::string environment =
      "PYTHONPATH='" + source + "/.deps/lcm:" + BEVEL_BINARY_DIR + "/lcmtypes/python' python3 ";
  if (std::system((environment + "-c 'import lcm' 2>/dev/null").c_str()) != 0) {
    GTEST_SKIP() << "Python's lcm is not there; run tools/setup";
  }
  const TemporaryLog ours("ours.lcm");
  const TemporaryLog theirs("theirs.lcm");
  {
    LogWriter writer(ours.path());
    for (std::int64_t i = 1; i <= 3; ++i) writer.write_message(1000 + i, channel::kTipMeasurement, tip(i));
    writer.close();
  }
  const std::string script = source + "/tests/io/event_log_interop.py";
  ASSERT_EQ(std::system((environment + script + " " + ours.path() + " " + theirs.path()).c_str()), 0);
  const Recording recording = read_recording(theirs.path());
  EXPECT_TRUE(recording.intact()) << recording.describe_faults();
  ASSERT_EQ(recording.tips.size(), 3U);
  EXPECT_DOUBLE_EQ(recording.tips[2].position_mm.z(), 3.0);
  EXPECT_EQ(recording.tips[2].utime, tip(3).utime);
}

// 3 s of axes and tips as a tool leaves them that sorts by channel: with the times of receipt, or with its own.
Bytes sorted_by_channel(bool own_times) {
  const TemporaryLog file("sorted.lcm");
  LogWriter writer(file.path());
  std::int64_t own = 1'700'000'100'000'000;
  for (std::int64_t i = 0; i < 300; ++i)
    writer.write_message(own_times ? ++own : actuator(i).utime + 500, channel::kActuatorState, actuator(i));
  for (std::int64_t i = 0; i < 90; ++i)
    writer.write_message(own_times ? ++own : tip(i).utime + 40'000, channel::kTipMeasurement, tip(i));
  writer.close();
  return file.bytes();
}

TEST(Recording, OfALogSortedByChannelIsSortedByTimeAndCounted) {
  for (const bool own_times : {false, true}) {
    const Bytes log = sorted_by_channel(own_times);
    const Recording r = read_recording(log);
    ASSERT_EQ(r.arrivals.size(), 390U);
    std::int64_t newest = 0, latest_by = 0;
    for (const Arrival& a : r.arrivals) {
      const std::int64_t utime =
          a.channel == Arrival::Channel::tip ? r.tips[a.index].utime : r.actuators[a.index].utime;
      latest_by = std::max(latest_by, newest - utime);
      newest = std::max(newest, utime);
    }
    EXPECT_LE(latest_by, own_times ? 0 : 40'000) << "the delay of the camera, where the log has it";
    EXPECT_EQ(r.tips.size(), 90U);
    EXPECT_TRUE(r.intact()) << "nothing is lost";
    EXPECT_THAT(r.order_note("rec"), ::testing::HasSubstr("of 390 events stand behind later ones"));
    EXPECT_EQ(r.refusal(), "");
  }
}

// A camera that lags by two seconds, and a wall clock that was set, are in the log as they were live.
TEST(Recording, LeavesTheOrderOfReceiptAsItWas) {
  const auto arrivals_of = [](const std::function<void(LogWriter&)>& fill) {
    const TemporaryLog file("live.lcm");
    LogWriter writer(file.path());
    fill(writer);
    writer.close();
    const Recording r = read_recording(file.bytes());
    EXPECT_EQ(r.out_of_order, 0);
    std::string order;
    for (const Arrival& a : r.arrivals) order += a.channel == Arrival::Channel::tip ? 't' : 'a';
    return order;
  };
  const std::string lagging = arrivals_of([](LogWriter& writer) {
    for (std::int64_t i = 0; i < 600; ++i) {
      writer.write_message(actuator(i).utime, channel::kActuatorState, actuator(i));
      if (i >= 200 && i % 4 == 0) writer.write_message(actuator(i).utime, channel::kTipMeasurement, tip((i - 200) / 4));
    }
  });
  EXPECT_EQ(lagging.substr(0, 206), std::string(201, 'a') + "taaaa");
  const std::string set_back = arrivals_of([](LogWriter& writer) {
    for (std::int64_t i = 0; i < 10; ++i) {
      const std::int64_t back_us = i < 5 ? 0 : 3'600'000'000;
      writer.write_message(actuator(i).utime - back_us, channel::kActuatorState, actuator(i));
      writer.write_message(actuator(i).utime - back_us, channel::kTipMeasurement, tip(i));
    }
  });
  EXPECT_EQ(set_back, "atatatatatatatatatat");
}

}  // namespace
}  // namespace bevel::io
