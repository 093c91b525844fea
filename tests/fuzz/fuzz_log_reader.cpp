// SPDX-License-Identifier: MIT
// Arbitrary bytes as a log. Every byte is accounted for once, every event lies where it says, the events alone make an
// intact log, and a recording of the same bytes holds each event once and only messages that pass their checks.
#include <map>
#include <vector>

#include <bevel/io/messages.hpp>
#include <bevel/io/recording.hpp>
#include "tests/fuzz/fuzz_support.hpp"

namespace bevel::fuzz {
namespace {

constexpr std::size_t kHeaderSize = 28;  // bevel/io/log_reader.hpp
constexpr std::size_t kLongestChannel = 63;

using Bytes = std::span<const std::uint8_t>;

bool same(const io::LogDamage& a, const io::LogDamage& b) {
  return a.regions == b.regions && a.skipped_bytes == b.skipped_bytes && a.torn_tail_bytes == b.torn_tail_bytes;
}

struct Walk {
  std::vector<std::uint8_t> events;  // their bytes, one after the other
  std::int64_t count = 0;
  std::int64_t configs = 0;
  std::int64_t others = 0;  // on channels that nobody decodes
  io::LogDamage damage;
};

bool is_decoded(std::string_view channel) {
  for (const char* known : {io::channel::kTipMeasurement, io::channel::kTipHeading, io::channel::kActuatorState,
                            io::channel::kMotionCommand, io::channel::kSteeringTarget, io::channel::kNeedleState,
                            io::channel::kNeedleTruth})
    if (channel == known) return true;
  return false;
}

Walk walk(Bytes log) {
  Walk found;
  io::LogReader reader(log);
  std::size_t end = 0;
  while (const auto event = reader.next()) {
    const std::size_t size = kHeaderSize + event->channel.size() + event->data.size();
    BEVEL_MUST(event->offset >= end && event->offset + size <= log.size());
    BEVEL_MUST(!event->channel.empty() && event->channel.size() <= kLongestChannel);
    const Bytes bytes = log.subspan(event->offset, size);
    BEVEL_MUST(reinterpret_cast<const std::uint8_t*>(event->channel.data()) == bytes.data() + kHeaderSize);
    BEVEL_MUST(event->data.data() == bytes.data() + kHeaderSize + event->channel.size());
    found.events.insert(found.events.end(), bytes.begin(), bytes.end());
    ++found.count;
    found.configs += event->channel == io::channel::kConfig ? 1 : 0;
    found.others += event->channel != io::channel::kConfig && !is_decoded(event->channel) ? 1 : 0;
    end = event->offset + size;
  }
  found.damage = reader.damage();
  BEVEL_MUST(!reader.next() && same(found.damage, reader.damage()));
  BEVEL_MUST(static_cast<std::int64_t>(log.size()) == static_cast<std::int64_t>(found.events.size()) +
                                                          found.damage.skipped_bytes + found.damage.torn_tail_bytes);
  BEVEL_MUST((found.damage.regions == 0) == (found.damage.skipped_bytes == 0));
  BEVEL_MUST(found.damage.intact() == (found.damage.describe() == "intact"));
  return found;
}

template <class Sample>
std::int64_t count_good(const std::vector<Sample>& samples) {
  for (const auto& sample : samples) {
    if constexpr (requires { io::to_message(sample); }) {
      BEVEL_MUST(!io::check_fields(io::to_message(sample)));
    } else {
      BEVEL_MUST(!io::check_fields(sample));
    }
  }
  return static_cast<std::int64_t>(samples.size());
}

}  // namespace
}  // namespace bevel::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bevel;
  const fuzz::Bytes log(data, size);
  const fuzz::Walk whole = fuzz::walk(log);
  const fuzz::Walk again = fuzz::walk(whole.events);
  BEVEL_MUST(again.damage.intact() && again.events == whole.events && again.count == whole.count);

  const io::Recording recording = io::read_recording(log);
  BEVEL_MUST(recording.events == whole.count && fuzz::same(recording.damage, whole.damage));
  std::int64_t skipped = 0;
  for (const auto& [channel, messages] : recording.skipped_channels) skipped += messages;
  BEVEL_MUST(skipped == whole.others);
  const std::int64_t held = fuzz::count_good(recording.tips) + fuzz::count_good(recording.headings) +
                            fuzz::count_good(recording.actuators) + fuzz::count_good(recording.commands) +
                            fuzz::count_good(recording.targets) + fuzz::count_good(recording.estimates) +
                            fuzz::count_good(recording.truths);
  std::int64_t left_out = 0;  // decoded and good, but no motion of a rig
  for (const auto* oddities : {&recording.tip_oddities, &recording.heading_oddities, &recording.actuator_oddities})
    for (const io::Oddity& oddity : *oddities) left_out += oddity.left_out ? 1 : 0;
  BEVEL_MUST(held + left_out + recording.rejected() + whole.configs + skipped == whole.count);
  BEVEL_MUST(recording.intact() == recording.describe_faults().empty());
  return 0;
}
