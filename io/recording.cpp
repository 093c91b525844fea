#include "io/recording.hpp"

#include "io/messages.hpp"

namespace bevel::io {
namespace {

template <class Message, class Store>
void decode_into(Recording& recording, const LogEvent& event, Store&& store) {
  const auto decoded = checked_decode<Message>(event.data.data(), event.data.size());
  if (decoded) {
    store(*decoded);
  } else {
    ++recording.rejects[std::string(event.channel)][static_cast<std::size_t>(decoded.error->fault)];
  }
}

void add_event(Recording& recording, const LogEvent& event) {
  const auto to_sample_in = [](auto& samples) {
    return [&samples](const auto& message) { samples.push_back(to_sample(message)); };
  };
  const auto as_is_in = [](auto& messages) {
    return [&messages](const auto& message) { messages.push_back(message); };
  };
  if (event.channel == channel::kTipMeasurement) {
    decode_into<tip_measurement_t>(recording, event, to_sample_in(recording.tips));
  } else if (event.channel == channel::kActuatorState) {
    decode_into<actuator_state_t>(recording, event, to_sample_in(recording.actuators));
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
  if (!damage.intact()) text += "log: " + damage.describe() + "\n";
  for (const auto& [channel, counts] : rejects) {
    for (std::size_t fault = 0; fault < counts.size(); ++fault) {
      if (counts[fault] == 0) continue;
      text += channel + ": " + std::to_string(counts[fault]) + " refused (" + name_of(static_cast<DecodeFault>(fault)) +
              ")\n";
    }
  }
  return text;
}

Recording read_recording(std::span<const std::uint8_t> log) {
  Recording recording;
  LogReader reader(log);
  while (const auto event = reader.next()) {
    ++recording.events;
    add_event(recording, *event);
  }
  recording.damage = reader.damage();
  return recording;
}

Recording read_recording(const std::string& path) {
  const MappedFile file(path);
  return read_recording(file.bytes());
}

}  // namespace bevel::io
