// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include <bevel/error.hpp>
#include <bevel/io/json_message.hpp>
#include <bevel/io/log_order.hpp>
#include <bevel/io/mcap_export.hpp>
#include <bevel/io/mcap_reader.hpp>
#include <bevel/io/messages.hpp>

namespace bevel::io {
namespace {

// Any JSON object with a message's fields, in whatever order and however spaced: what is not as JsonWriter writes it.
class FromObject {
 public:
  explicit FromObject(const nlohmann::json& object) : object_(object) {}
  template <class Integer>
  void whole(const char* name, Integer& value) {
    const auto field = find(name);
    if (field == object_.end() || !fits(*field, value))
      return fail(name, "is no whole number that this field can have");
    value = as_integer<Integer>(*field);
  }
  void number(const char* name, double& value) {
    const auto field = find(name);
    if (field == object_.end() || !field->is_number()) return fail(name, "is no number");
    value = field->get<double>();
  }
  template <class IsSeen>
  void seen(const char* name, double& value, IsSeen&&) {
    for (const std::string& key : {std::string(name), std::string("unseen_") + name}) {
      const auto field = find(key);
      if (field == object_.end() || field->is_null()) continue;
      if (!field->is_number()) return fail(name, "is no number");
      value = field->get<double>();
    }
  }
  std::optional<std::int64_t> arrival() {
    std::int64_t value = 0;
    const auto field = find(exported::kArrival);
    if (field == object_.end() || !fits(*field, value)) return std::nullopt;
    return as_integer<std::int64_t>(*field);
  }
  // "" if all was there.
  const std::string& fault() const { return fault_; }
  // Fields that the message does not have.
  void add_unknown(std::set<std::string>& names) const {
    if (taken_.size() == object_.size()) return;
    for (const auto& [name, value] : object_.items())
      if (!taken_.contains(name) && names.size() < kMostUnknown) names.insert(name.substr(0, kLongestName));
  }

 private:
  nlohmann::json::const_iterator find(const std::string& name) {
    const auto field = object_.find(name);
    if (field != object_.end()) taken_.insert(name);
    return field;
  }
  template <class Integer>
  static bool fits(const nlohmann::json& field, Integer) {
    constexpr auto kLargest = std::numeric_limits<Integer>::max();
    // 1.0 is an integer in JSON. Doubles beyond 2^53 are not exact.
    if (field.is_number_float()) {
      const auto value = field.get<double>();
      return std::trunc(value) == value && std::abs(value) <= std::min(0x1p53, static_cast<double>(kLargest)) &&
             value >= static_cast<double>(std::numeric_limits<Integer>::min());
    }
    if (field.is_number_unsigned()) return field.get<std::uint64_t>() <= static_cast<std::uint64_t>(kLargest);
    return field.is_number_integer() && field.get<std::int64_t>() >= std::numeric_limits<Integer>::min();
  }
  template <class Integer>
  static Integer as_integer(const nlohmann::json& field) {
    return field.is_number_float() ? static_cast<Integer>(field.get<double>()) : field.get<Integer>();
  }
  void fail(const char* name, const char* why) {
    if (fault_.empty()) fault_ = "'" + std::string(name) + "' " + why;
  }
  const nlohmann::json& object_;
  static constexpr std::size_t kMostUnknown = 8, kLongestName = 40;  // for a message that fits on some lines
  std::set<std::string> taken_;
  std::string fault_;
};

// "" and the message, or why there is none.
template <class Message>
std::string parse(const JsonLayout& layout, std::string_view json, Message& message,
                  std::optional<std::int64_t>& arrival, std::set<std::string>& unknown) {
  JsonReader reader(layout, json);
  visit_columns(message, reader);
  std::int64_t number = 0;
  if (layout.numbers_arrivals() && reader.arrival(number)) arrival = number;
  if (!reader.is_whole()) {
    message = {};
    arrival.reset();
    const auto object = nlohmann::json::parse(json.begin(), json.end(), nullptr, false);
    if (!object.is_object()) return "is no JSON object";
    FromObject fields(object);
    visit_columns(message, fields);
    if (layout.numbers_arrivals()) arrival = fields.arrival();
    if (!fields.fault().empty()) return fields.fault();
    fields.add_unknown(unknown);
  }
  if (const auto error = check_fields(message)) return "would be refused by readers (" + describe(*error) + ")";
  return "";
}

// One channel's messages, in the order of the file.
template <class Message>
class ChannelReader {
 public:
  ChannelReader(const char* topic, bool numbers_arrivals)
      : topic_(topic), layout_(JsonLayout::of<Message>(numbers_arrivals)) {}
  const char* topic() const { return topic_; }
  // A line, or "".
  std::string note() const {
    std::string names;
    for (const std::string& name : unknown_) names += (names.empty() ? "'" : ", '") + name + "'";
    return names.empty() ? "" : std::string(topic_) + " has fields that are not read: " + names + "\n";
  }

  void take(const mcap::Message& one, mcap::Damage& damage) {
    Row row{.sequence = one.sequence};
    std::optional<std::int64_t> arrival;
    const std::string fault = parse(layout_, one.data, row.message, arrival, unknown_);
    if (!fault.empty()) {
      damage.note(mcap::Fault::message, one.offset,
                  "message " + std::to_string(one.sequence) + " of " + topic_ + " " + fault + "; left out");
      return;
    }
    row.arrival = arrival.value_or(0);
    in_order_ = in_order_ && (rows_.empty() || rows_.back().sequence <= row.sequence);
    rows_.push_back(row);
  }
  // store(message, arrival) for each, in the order of their sequence, which other tools keep when they move messages.
  template <class Store>
  void give(Store&& store) {
    if (!in_order_) std::ranges::stable_sort(rows_, {}, &Row::sequence);
    for (const Row& row : rows_) store(row.message, row.arrival);
    rows_ = {};
  }

 private:
  struct Row {
    std::uint32_t sequence = 0;
    std::int64_t arrival = 0;
    Message message{};
  };
  const char* topic_;
  JsonLayout layout_;
  std::vector<Row> rows_;
  std::set<std::string> unknown_;
  bool in_order_ = true;
};

struct Channels {
  ChannelReader<tip_measurement_t> tips{channel::kTipMeasurement, true};
  ChannelReader<tip_heading_t> headings{channel::kTipHeading, true};
  ChannelReader<actuator_state_t> actuators{channel::kActuatorState, true};
  ChannelReader<motion_command_t> commands{channel::kMotionCommand, false};
  ChannelReader<needle_state_t> estimates{channel::kNeedleState, false}, truths{channel::kNeedleTruth, false};

  void take(const mcap::Message& one, mcap::Damage& damage) {
    const auto offer = [&](auto&... readers) {
      (void)((one.topic == readers.topic() ? (require_json(one), readers.take(one, damage), true) : false) || ...);
    };
    offer(tips, actuators, headings, commands, estimates, truths);
  }
  std::string notes() const {
    return tips.note() + headings.note() + actuators.note() + commands.note() + estimates.note() + truths.note();
  }
  void give(Recording& recording) {
    ArrivalsByNumber arrivals;
    const auto arriving = [&](auto& reader, Arrival::Channel channel, auto& samples) {
      reader.give([&](const auto& message, std::int64_t arrival) {
        arrivals.add(arrival, message.utime, {channel, samples.size()});
        samples.push_back(to_sample(message));
      });
    };
    // Of equal number the axes come first: a reading of the tip is taken of where the base is.
    arriving(actuators, Arrival::Channel::actuator, recording.actuators);
    arriving(tips, Arrival::Channel::tip, recording.tips);
    arriving(headings, Arrival::Channel::heading, recording.headings);
    recording.arrivals = arrivals.sorted();
    commands.give([&](const auto& m, auto) { recording.commands.push_back(to_sample(m)); });
    estimates.give([&](const auto& m, auto) { recording.estimates.push_back(m); });
    truths.give([&](const auto& m, auto) { recording.truths.push_back(m); });
  }

 private:
  static void require_json(const mcap::Message& one) {
    if (one.encoding != "json")
      throw ParseError(std::string(one.topic) + " is '" + std::string(one.encoding.substr(0, 16)) + "'; allowed: json");
  }
};

}  // namespace

std::string ImportedMcap::remarks(const std::string& name) const {
  std::string text, line;
  for (std::istringstream lines(faults); std::getline(lines, line);) text += name + ": damaged: " + line + "\n";
  for (std::istringstream lines(notes); std::getline(lines, line);) text += name + ": " + line + "\n";
  return text;
}

ImportedMcap import_mcap(std::string_view file) {
  ImportedMcap out;
  Channels channels;
  mcap::Damage unusable;
  const mcap::Damage damage = mcap::read(file, {.on_message =
                                                    [&](const mcap::Message& one) {
                                                      ++out.recording.events;
                                                      channels.take(one, unusable);
                                                    },
                                                .on_attachment =
                                                    [&](const mcap::Attachment& one) {
                                                      if (one.name == exported::kConfig)
                                                        out.recording.config = one.data;
                                                    }});
  for (const mcap::Damage::Place& place : damage.places)
    if (place.fault == mcap::Fault::magic || place.fault == mcap::Fault::compression) throw ParseError(place.what);
  out.recording.bytes = static_cast<std::int64_t>(file.size());
  channels.give(out.recording);
  out.faults = damage.describe() + unusable.describe();
  out.notes = channels.notes();
  const Recording& r = out.recording;
  if (r.arrivals.empty() && r.commands.empty() && r.estimates.empty() && r.truths.empty())
    throw ParseError("no message that can be used, of " + std::to_string(r.events) + " on any channel" +
                     (out.faults.empty() ? "" : "; " + out.faults.substr(0, out.faults.find('\n'))));
  return out;
}

ImportedMcap import_mcap_file(const std::string& path) {
  const FileBytes file(path, kLargestMcap_bytes);
  const auto bytes = file.bytes();
  try {
    ImportedMcap out = import_mcap({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (!file.change().empty()) out.faults += file.change() + "\n";
    return out;
  } catch (const Error& e) {
    throw ParseError(path + ": " + e.what());
  }
}

bool is_mcap(const std::string& path) { return std::filesystem::path(path).extension() == ".mcap"; }

}  // namespace bevel::io
