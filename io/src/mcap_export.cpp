// SPDX-License-Identifier: MIT
#include <bevel/io/mcap_export.hpp>

#include <bevel/io/json_message.hpp>
#include <bevel/io/log_order.hpp>
#include <bevel/io/mcap_writer.hpp>
#include <bevel/io/messages.hpp>

namespace bevel::io {
namespace {

// One kind of message into one channel, which is there from its first message on.
template <class Message>
class ChannelWriter {
 public:
  ChannelWriter(mcap::Writer& file, const char* topic, const char* schema, bool numbers_arrivals = false)
      : file_(file), topic_(topic), schema_(schema), layout_(JsonLayout::of<Message>(numbers_arrivals)) {
    text_.resize(layout_.largest_size());
  }
  void write(const Message& message, std::size_t arrival = 0) {
    if (id_ == 0) id_ = file_.add_channel(topic_, schema_, layout_.schema());
    JsonWriter writer(layout_, text_.data());
    visit_columns(message, writer);
    if (layout_.numbers_arrivals()) writer.whole("", arrival);
    const auto size = static_cast<std::size_t>(writer.end() - text_.data());
    file_.write(id_, sequence_++, static_cast<std::uint64_t>(message.utime) * 1000, {text_.data(), size});
  }

 private:
  mcap::Writer& file_;
  const char* topic_;
  const char* schema_;
  JsonLayout layout_;
  std::string text_;
  std::uint16_t id_ = 0;
  std::uint32_t sequence_ = 0;
};

}  // namespace

void export_mcap(const Recording& recording, const std::string& path) {
  mcap::Writer file(path);
  ChannelWriter<tip_measurement_t> tips(file, channel::kTipMeasurement, "bevel.tip_measurement", true);
  ChannelWriter<tip_heading_t> headings(file, channel::kTipHeading, "bevel.tip_heading", true);
  ChannelWriter<actuator_state_t> actuators(file, channel::kActuatorState, "bevel.actuator_state", true);
  ChannelWriter<motion_command_t> commands(file, channel::kMotionCommand, "bevel.motion_command");
  ChannelWriter<needle_state_t> estimates(file, channel::kNeedleState, "bevel.needle_state");
  ChannelWriter<needle_state_t> truths(file, channel::kNeedleTruth, "bevel.needle_truth");
  const ArrivalNumbers numbers(recording);
  for (const auto& [time_us, channel, i] : log_order(recording)) {
    switch (channel) {
      case Placed::Channel::tip:
        tips.write(to_message(recording.tips[i]), numbers.tips[i]);
        break;
      case Placed::Channel::heading:
        headings.write(to_message(recording.headings[i]), numbers.headings[i]);
        break;
      case Placed::Channel::actuator:
        actuators.write(to_message(recording.actuators[i]), numbers.actuators[i]);
        break;
      case Placed::Channel::command:
        commands.write(to_message(recording.commands[i]));
        break;
      case Placed::Channel::estimate:
        estimates.write(recording.estimates[i]);
        break;
      case Placed::Channel::truth:
        truths.write(recording.truths[i]);
        break;
    }
  }
  if (!recording.config.empty()) file.attach(exported::kConfig, "application/toml", recording.config);
  file.close();
}

}  // namespace bevel::io
