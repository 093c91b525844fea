// SPDX-License-Identifier: MIT
// The SDO client against a server that answers what it likes, beside a model of what CiA 301 allows it to believe; then
// against the simulated drive's own server, which has to answer every request.
//
// Input: operations of one byte, each with its arguments.
#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <bevel/drivers/can/memory_bus.hpp>
#include <bevel/drivers/stepper/cia301.hpp>
#include <bevel/rig/drives/simulated_drive.hpp>
#include "tests/fuzz/fuzz_support.hpp"

namespace bevel::fuzz {
namespace {

using can::Frame;
using stepper::cia301::ObjectAddress;
using stepper::cia301::SdoClient;
using Status = SdoClient::Status;

constexpr std::uint8_t kNode = 5;
constexpr std::int64_t kTimeout_ns = 500'000'000;

ObjectAddress object_of(const Frame& frame) {
  return {static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8), frame.data[3]};
}

// The client and what is known of its transfer by looking at the frames alone.
class WatchedClient {
 public:
  void begin_upload(ObjectAddress object) {
    begin(object, true, [&] { client.upload(object); });
  }
  void begin_download(ObjectAddress object, std::uint32_t value, std::uint8_t size_bytes) {
    begin(object, false, [&] { client.download(object, value, size_bytes); });
  }
  void begin(Input& input, bool upload) {
    const ObjectAddress object{input.take<std::uint16_t>(), input.byte()};
    if (upload) return begin_upload(object);
    const auto size_bytes = static_cast<std::uint8_t>(1 + input.byte() % 4);
    begin_download(object, input.take<std::uint32_t>(), size_bytes);
  }

  /// Sends what the client has to send, each frame through `put`: where an abort is still owed, it and then the
  /// request.
  template <class Put>
  void send(Put&& put) {
    const auto frame = client.frame_to_send();
    const Status before = client.status();
    const bool aborts = frame && frame->data[0] == 0x80;
    if (frame) BEVEL_MUST(frame->id == 0x600U + kNode && frame->size == 8);
    if (frame && !owes_abort_) BEVEL_MUST(object_of(*frame) == object_ && aborts == (before != Status::to_send));
    if (frame) put(*frame);
    client.sent(now_ns);
    if (std::exchange(owes_abort_, false)) {
      BEVEL_MUST(client.status() == before);
      return send(put);
    }
    BEVEL_MUST(client.status() == (before == Status::to_send ? Status::waiting : before));
    BEVEL_MUST(!client.frame_to_send());  // one request, or one abort
    if (before == Status::to_send) sent_ns_ = now_ns;
  }
  void send() {
    send([](const Frame&) {});
  }
  void cancel() {
    client.cancel();
    owes_abort_ = false;
    BEVEL_MUST(client.status() == Status::idle && !client.frame_to_send());
  }

  void answer(const Frame& frame) {
    const Status before = client.status();
    const auto ignored = client.ignored();
    client.on_response(frame);
    if (client.ignored() != ignored) {
      BEVEL_MUST(client.ignored() == ignored + 1 && client.status() == before);
      return;
    }
    BEVEL_MUST(before == Status::waiting && frame.size == 8 && object_of(frame) == object_);
    const unsigned command = frame.data[0];
    const std::uint32_t value = stepper::cia301::get_u32(frame, 4);
    if (client.status() == Status::aborted) {
      const bool theirs = command == 0x80;
      const bool segmented = upload_ && command >> 5 == 2 && (command & 2U) == 0;
      BEVEL_MUST(theirs || segmented);
      BEVEL_MUST(!theirs || client.abort_code() == value);
      BEVEL_MUST(client.frame_to_send().has_value() == segmented);
      return;
    }
    BEVEL_MUST(client.status() == Status::done && !client.frame_to_send());
    BEVEL_MUST(upload_ ? command >> 5 == 2 && (command & 2U) != 0 : command == 0x60);
    if (!upload_) return;
    const unsigned bytes = (command & 1U) != 0 ? 4 - (command >> 2 & 3U) : 4;
    BEVEL_MUST(client.value() == (bytes == 4 ? value : value & ((1U << 8 * bytes) - 1)));
  }

  void check_time() {
    const bool late = client.status() == Status::waiting && now_ns - sent_ns_ >= kTimeout_ns;
    const Status before = client.status();
    client.check_time(now_ns);
    BEVEL_MUST(client.status() == (late ? Status::timed_out : before));
    if (late) BEVEL_MUST(client.frame_to_send() && client.frame_to_send()->data[0] == 0x80);
  }

  // However it was left: one frame and one time-out later it has ended, and it is quiet after one abort.
  void must_end() {
    if (client.status() == Status::to_send) send();
    now_ns += kTimeout_ns;
    check_time();
    BEVEL_MUST(client.status() != Status::waiting && client.status() != Status::to_send);
    send();
    BEVEL_MUST(!client.frame_to_send());
  }

  SdoClient client{kNode, kTimeout_ns};
  std::int64_t now_ns = 1'000'000'000;

 private:
  template <class Call>
  void begin(ObjectAddress object, bool upload, Call&& call) {
    const auto abort = client.frame_to_send();
    owes_abort_ = abort && abort->data[0] == 0x80;
    object_ = object;
    upload_ = upload;
    call();
    BEVEL_MUST(client.status() == Status::to_send && client.frame_to_send());
    // A transfer that was given up is ended first, under its own object.
    BEVEL_MUST(owes_abort_ ? client.frame_to_send() == abort
                           : client.frame_to_send()->data[0] >> 5 == (upload ? 2 : 1));
  }

  ObjectAddress object_{};
  bool upload_ = false;
  bool owes_abort_ = false;  // of a transfer before this one
  std::int64_t sent_ns_ = 0;
};

// An answer of arbitrary bytes; every other one with the request's own object, or nothing would ever match.
Frame some_answer(Input& input, const std::optional<Frame>& request) {
  Frame frame{0x580U + kNode, 8, input.take<std::array<std::uint8_t, 8>>()};
  const std::uint8_t shape = input.byte();
  if ((shape & 0x80U) != 0) frame.size = shape % 9;
  if ((shape & 1U) != 0 && request) std::copy_n(request->data.begin() + 1, 3, frame.data.begin() + 1);
  return frame;
}

void arbitrary_server(Input input) {
  WatchedClient watched;
  std::optional<Frame> request;
  while (!input.empty()) {
    switch (input.byte() % 7) {
      case 0:
      case 1:
        watched.begin(input, true);
        break;
      case 2:
        watched.begin(input, false);
        break;
      case 3:
        watched.send([&](const Frame& frame) { request = frame; });
        break;
      case 4:
        watched.answer(some_answer(input, request));
        break;
      case 5:
        watched.now_ns += input.take<std::uint32_t>();
        watched.check_time();
        break;
      default:
        watched.cancel();
        break;
    }
  }
  watched.must_end();
}

// Requests for any object reach the simulated drive: each ends at once, done or aborted, and a value that was taken is
// read back.
void simulated_server(Input input) {
  can::MemoryNetwork wire;
  const auto bus = wire.attach();
  const auto drive_bus = wire.attach();
  rig::SimulatedDriveConfig config;
  config.node_id = kNode;
  rig::SimulatedDrive drive(*drive_bus, config);
  WatchedClient watched;
  Frame request;
  const auto transfer = [&] {
    // Before the request goes the abort of a text, if one was met where a number was asked for.
    watched.send([&](const Frame& frame) {
      request = frame;
      BEVEL_MUST(bus->send(frame) == can::SendResult::sent);
    });
    watched.now_ns += 1'000'000;
    drive.step(watched.now_ns);
    for (can::Reception r = bus->receive(); r.kind != can::Reception::Kind::nothing; r = bus->receive())
      if (r.kind == can::Reception::Kind::frame && r.frame.id == 0x580U + kNode) watched.answer(r.frame);
    BEVEL_MUST(watched.client.status() == Status::done || watched.client.status() == Status::aborted);
    return watched.client.status() == Status::done;
  };
  while (!input.empty()) {
    const bool upload = input.byte() % 2 == 0;
    watched.begin(input, upload);
    if (!transfer() || upload) continue;
    const ObjectAddress object = object_of(request);
    const unsigned bytes = 4 - (request.data[0] >> 2 & 3U);
    const std::uint32_t written = stepper::cia301::get_u32(request, 4);
    watched.begin_upload(object);
    BEVEL_MUST(drive.objects().find(object.index, object.sub) != nullptr);
    BEVEL_MUST(drive.objects().get(object.index, object.sub) ==
               (bytes == 4 ? written : written & ((1U << 8 * bytes) - 1)));
    BEVEL_MUST(transfer());
    BEVEL_MUST(watched.client.value() == drive.objects().get(object.index, object.sub));
  }
}

}  // namespace
}  // namespace bevel::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bevel::fuzz::Input input(data, size);
  if (input.byte() % 4 != 0) {
    bevel::fuzz::arbitrary_server(input);
  } else {
    bevel::fuzz::simulated_server(input);
  }
  return 0;
}
