// SPDX-License-Identifier: MIT
#include <bevel/io/recording.hpp>

#include <algorithm>
#include <limits>
#include <set>
#include <sstream>

#include <bevel/error.hpp>
#include <bevel/io/file_bytes.hpp>
#include <bevel/io/messages.hpp>

namespace bevel::io {
namespace {

constexpr double kLargestShareLeftOut = 0.2;
// Messages of one rig are delayed by less. Cameras lag by tenths of a second, and estimators keep 0.3 s
// (bevel/estimator/needle_estimator.hpp).
constexpr std::int64_t kLongestDelay_us = 1'000'000;

// False if the message was refused.
template <class Message, class Store>
bool decode_into(Recording& recording, const LogEvent& event, Store&& store) {
  const auto decoded = checked_decode<Message>(event.data.data(), event.data.size());
  if (decoded) {
    store(*decoded);
  } else {
    ++recording.rejects[std::string(event.channel)][static_cast<std::size_t>(decoded.error->fault)];
  }
  return !decoded.error;
}

void add_event(Recording& recording, const LogEvent& event) {
  const auto to_sample_in = [](auto& samples) {
    return [&samples](const auto& message) { samples.push_back(to_sample(message)); };
  };
  const auto as_is_in = [](auto& messages) {
    return [&messages](const auto& message) { messages.push_back(message); };
  };
  const auto note = [&recording](bool taken, Arrival::Channel channel, std::size_t size) {
    if (taken) recording.arrivals.push_back({channel, size - 1});
  };
  if (event.channel == channel::kTipMeasurement) {
    const bool taken = decode_into<tip_measurement_t>(recording, event, to_sample_in(recording.tips));
    note(taken, Arrival::Channel::tip, recording.tips.size());
  } else if (event.channel == channel::kTipHeading) {
    const bool taken = decode_into<tip_heading_t>(recording, event, to_sample_in(recording.headings));
    note(taken, Arrival::Channel::heading, recording.headings.size());
  } else if (event.channel == channel::kActuatorState) {
    const bool taken = decode_into<actuator_state_t>(recording, event, to_sample_in(recording.actuators));
    note(taken, Arrival::Channel::actuator, recording.actuators.size());
  } else if (event.channel == channel::kMotionCommand) {
    decode_into<motion_command_t>(recording, event, to_sample_in(recording.commands));
  } else if (event.channel == channel::kSteeringTarget) {
    decode_into<steering_target_t>(recording, event, as_is_in(recording.targets));
  } else if (event.channel == channel::kNeedleState) {
    decode_into<needle_state_t>(recording, event, as_is_in(recording.estimates));
  } else if (event.channel == channel::kNeedleTruth) {
    decode_into<needle_state_t>(recording, event, as_is_in(recording.truths));
  } else if (event.channel == channel::kConfig) {
    recording.config.assign(event.data.begin(), event.data.end());
  } else {
    ++recording.skipped_channels[std::string(event.channel)];
  }
}

// Takes what was left out of `samples` and of the arrivals.
template <class Sample>
void drop(Recording& recording, Arrival::Channel channel, std::vector<Sample>& samples,
          const std::vector<bool>& left_out) {
  if (std::find(left_out.begin(), left_out.end(), true) == left_out.end()) return;
  std::vector<std::size_t> place(samples.size());
  std::vector<Sample> kept;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    place[i] = kept.size();
    if (!left_out[i]) kept.push_back(samples[i]);
  }
  samples = std::move(kept);
  std::erase_if(recording.arrivals, [&](const Arrival& a) { return a.channel == channel && left_out[a.index]; });
  for (Arrival& a : recording.arrivals)
    if (a.channel == channel) a.index = place[a.index];
}

template <class Sample>
std::map<int, std::vector<std::int64_t>> times_by_camera(const std::vector<Sample>& samples) {
  std::map<int, std::vector<std::int64_t>> times;
  for (const Sample& sample : samples) times[sample.camera].push_back(sample.utime);
  return times;
}

void leave_out_the_implausible(Recording& recording) {
  Judgement axes = judge(recording.actuators);
  drop(recording, Arrival::Channel::actuator, recording.actuators, axes.left_out);
  recording.actuator_oddities = std::move(axes.oddities);
  std::vector<model::ActuatorState> sorted = recording.actuators;
  std::ranges::stable_sort(sorted, {}, &model::ActuatorState::utime);
  Judgement tips = judge(recording.tips, sorted);
  drop(recording, Arrival::Channel::tip, recording.tips, tips.left_out);
  recording.tip_oddities = std::move(tips.oddities);
  Judgement headings = judge(recording.headings);
  drop(recording, Arrival::Channel::heading, recording.headings, headings.left_out);
  recording.heading_oddities = std::move(headings.oddities);
  recording.coverage = compare_times(times_by_camera(recording.tips), sorted, channel::kTipMeasurement);
  const Coverage of_headings = compare_times(times_by_camera(recording.headings), sorted, channel::kTipHeading);
  recording.coverage.inside += of_headings.inside;
  recording.coverage.outside += of_headings.outside;
  recording.coverage.faults += of_headings.faults;
}

std::int64_t count_late(std::int64_t time_us, std::int64_t newest_us) {
  return newest_us != std::numeric_limits<std::int64_t>::min() && time_us < newest_us - kLongestDelay_us ? 1 : 0;
}

// A log that a tool has sorted by channel: each channel is in the order of receipt, the whole log is not. A wall clock
// that was set, and a damaged time stamp, show in a channel too; such a log stays as it is. Returns how many events
// were received more than a second before one that stands above them.
std::int64_t sort_by_receipt(std::vector<LogEvent>& events) {
  std::map<std::string_view, std::int64_t> newest_of_channel;
  std::int64_t newest_us = std::numeric_limits<std::int64_t>::min(), count = 0;
  for (const LogEvent& event : events) {
    auto& newest = newest_of_channel.try_emplace(event.channel, event.timestamp_us).first->second;
    if (event.timestamp_us < newest) return 0;
    newest = event.timestamp_us;
    count += count_late(event.timestamp_us, newest_us);
    newest_us = std::max(newest_us, event.timestamp_us);
  }
  if (count > 0) std::ranges::stable_sort(events, {}, &LogEvent::timestamp_us);
  return count;
}

// Sorts the arrivals by event time if tips, headings and axes stand in one block each: the tool that sorted the log by
// channel also replaced the times of receipt.
std::int64_t sort_by_event_time(Recording& recording) {
  const auto utime_of = [&](const Arrival& a) {
    switch (a.channel) {
      case Arrival::Channel::tip:
        return recording.tips[a.index].utime;
      case Arrival::Channel::heading:
        return recording.headings[a.index].utime;
      case Arrival::Channel::actuator:
        return recording.actuators[a.index].utime;
    }
    return std::int64_t{0};
  };
  std::set<Arrival::Channel> channels;
  std::int64_t newest_us = std::numeric_limits<std::int64_t>::min(), count = 0;
  for (std::size_t i = 0; i < recording.arrivals.size(); ++i) {
    const Arrival& a = recording.arrivals[i];
    const bool is_same_block = i > 0 && recording.arrivals[i - 1].channel == a.channel;
    if (!is_same_block && !channels.insert(a.channel).second) return 0;
    count += count_late(utime_of(a), newest_us);
    newest_us = std::max(newest_us, utime_of(a));
  }
  if (count == 0) return 0;
  // At equal times the axes come first: a measurement is compared with where the axes are.
  std::ranges::stable_sort(recording.arrivals, {}, [&](const Arrival& a) {
    return std::pair(utime_of(a), a.channel == Arrival::Channel::actuator ? 0 : 1);
  });
  return count;
}

std::string one_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

std::string too_much_left_out(const std::vector<Oddity>& oddities, std::size_t kept, const char* channel) {
  const auto lost = static_cast<std::size_t>(std::ranges::count_if(oddities, &Oddity::left_out));
  if (static_cast<double>(lost) <= kLargestShareLeftOut * static_cast<double>(lost + kept)) return "";
  return "damaged beyond use: " + std::to_string(lost) + " of " + std::to_string(lost + kept) + " " + channel +
         " are implausible beside their neighbours; at most 20 % may be";
}

}  // namespace

std::int64_t Recording::rejected() const {
  std::int64_t sum = 0;
  for (const auto& [channel, counts] : rejects) {
    for (const auto count : counts) sum += count;
  }
  return sum;
}

std::string Recording::describe_faults() const {
  std::string text;
  if (!file_change.empty()) text += file_change + "\n";
  if (!damage.intact()) text += "log: " + damage.describe() + "\n";
  for (const auto& [channel, counts] : rejects) {
    for (std::size_t fault = 0; fault < counts.size(); ++fault) {
      if (counts[fault] == 0) continue;
      text += channel + ": " + std::to_string(counts[fault]) + " refused (" + name_of(static_cast<DecodeFault>(fault)) +
              ")\n";
    }
  }
  std::int64_t start_utime = std::numeric_limits<std::int64_t>::max();
  for (const auto& a : actuators) start_utime = std::min(start_utime, a.utime);
  if (actuators.empty()) {
    for (const auto& t : tips) start_utime = std::min(start_utime, t.utime);
    for (const auto& h : headings) start_utime = std::min(start_utime, h.utime);
  }
  return text + describe(actuator_oddities, channel::kActuatorState, start_utime) +
         describe(tip_oddities, channel::kTipMeasurement, start_utime) +
         describe(heading_oddities, channel::kTipHeading, start_utime) + coverage.faults;
}

std::string Recording::remarks(const std::string& name) const {
  std::istringstream faults(describe_faults());
  std::string text, line;
  while (std::getline(faults, line)) text += name + ": damaged: " + line + "\n";
  return text;
}

std::string Recording::order_note(const std::string& name) const {
  if (out_of_order == 0) return "";
  return name + ": " + std::to_string(out_of_order) + " of " + std::to_string(events) +
         " events stand behind later ones, as in a log that is sorted by channel; they were sorted by time\n";
}

std::string Recording::refusal() const {
  if (events == 0)
    return "no LCM event in its " + std::to_string(bytes) + " bytes; " +
           (bytes == 0 ? "the file is empty" : "not a log, or damaged throughout");
  if (tips.empty() && headings.empty() && actuators.empty() && commands.empty() && targets.empty() &&
      estimates.empty() && truths.empty())
    return "no usable message in its " + std::to_string(events) + " events; " + std::to_string(rejected()) +
           " were refused, the others are on channels that are not read here";
  for (const Oddity& oddity : actuator_oddities)
    if (oddity.kind == Oddity::Kind::motion && !oddity.left_out)
      return "damaged beyond use: " + one_line(describe({oddity}, channel::kActuatorState, actuators.front().utime)) +
             ", so that where the base was is not known";
  if (coverage.inside == 0 && coverage.outside > 0)
    return "no measurement within the time of the axes, so that the motion to each measurement is unknown: " +
           one_line(coverage.faults);
  const std::string axes = too_much_left_out(actuator_oddities, actuators.size(), channel::kActuatorState);
  if (!axes.empty()) return axes;
  const std::string positions = too_much_left_out(tip_oddities, tips.size(), channel::kTipMeasurement);
  return positions.empty() ? too_much_left_out(heading_oddities, headings.size(), channel::kTipHeading) : positions;
}

Recording read_recording(std::span<const std::uint8_t> log) {
  Recording recording;
  recording.bytes = static_cast<std::int64_t>(log.size());
  LogReader reader(log);
  std::vector<LogEvent> events;
  while (const auto event = reader.next()) events.push_back(*event);
  recording.events = std::ssize(events);
  recording.damage = reader.damage();
  recording.out_of_order = sort_by_receipt(events);
  for (const LogEvent& event : events) add_event(recording, event);
  leave_out_the_implausible(recording);
  recording.out_of_order += sort_by_event_time(recording);
  return recording;
}

Recording read_recording(const std::string& path) {
  const FileBytes file(path);
  Recording recording = read_recording(file.bytes());
  recording.file_change = file.change();
  return recording;
}

void require_usable(const std::string& name, const Recording& recording) {
  const std::string refusal = recording.refusal();
  if (!refusal.empty()) throw ParseError(name + ": " + refusal);
}

}  // namespace bevel::io
