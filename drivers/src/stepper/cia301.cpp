// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/cia301.hpp>

namespace bevel::stepper::cia301 {
namespace {

constexpr std::uint8_t kDownloadBase = 0x23;  // expedited, size indicated; (4 - n) << 2 gives the unused bytes
constexpr std::uint8_t kDownloadDone = 0x60;
constexpr std::uint8_t kUpload = 0x40;
constexpr std::uint8_t kUploadExpedited = 0x42;  // command specifier and the expedited bit
constexpr std::uint8_t kUploadMask = 0xE2;
constexpr std::uint8_t kAbort = 0x80;
constexpr std::uint8_t kSegment = 0x60;  // request; the answer's command specifier is 0
constexpr std::uint8_t kCommandMask = 0xE0;
constexpr std::uint8_t kToggle = 0x10;
constexpr std::uint32_t kAbortCommand = 0x05040001;
constexpr std::uint32_t kAbortMemory = 0x05040005;

}  // namespace

std::uint16_t get_u16(const Frame& frame, std::size_t at) {
  return static_cast<std::uint16_t>(frame.data.at(at) | frame.data.at(at + 1) << 8);
}

std::uint32_t get_u32(const Frame& frame, std::size_t at) {
  return get_u16(frame, at) | static_cast<std::uint32_t>(get_u16(frame, at + 2)) << 16;
}

void put_u16(Frame& frame, std::size_t at, std::uint16_t value) {
  frame.data.at(at) = static_cast<std::uint8_t>(value);
  frame.data.at(at + 1) = static_cast<std::uint8_t>(value >> 8);
}

void put_u32(Frame& frame, std::size_t at, std::uint32_t value) {
  put_u16(frame, at, static_cast<std::uint16_t>(value));
  put_u16(frame, at + 2, static_cast<std::uint16_t>(value >> 16));
}

Frame nmt(NmtCommand command, std::uint8_t node) { return {kNmtId, 2, {static_cast<std::uint8_t>(command), node}}; }

Frame sync() { return {kSyncId, 0, {}}; }

Frame heartbeat(std::uint8_t node, NmtState state) {
  return {heartbeat_id(node), 1, {static_cast<std::uint8_t>(state)}};
}

std::optional<NmtState> decode_heartbeat(const Frame& frame) {
  if (frame.size != 1) return std::nullopt;
  const auto state = static_cast<NmtState>(frame.data[0] & 0x7F);
  switch (state) {
    case NmtState::boot_up:
    case NmtState::stopped:
    case NmtState::operational:
    case NmtState::pre_operational:
      return state;
  }
  return std::nullopt;
}

std::optional<Emergency> decode_emergency(const Frame& frame) {
  if (frame.size != 8) return std::nullopt;
  return Emergency{get_u16(frame, 0), frame.data[2]};
}

void SdoClient::begin(Frame request, ObjectAddress object, bool is_upload) {
  request.id = sdo_request_id(node_);
  request.size = 8;
  put_u16(request, 1, object.index);
  request.data[3] = object.sub;
  request_ = request;
  object_ = object;
  is_upload_ = is_upload;
  is_text_ = in_segments_ = false;
  status_ = Status::to_send;
}

void SdoClient::upload(ObjectAddress object) {
  Frame request;
  request.data[0] = kUpload;
  begin(request, object, true);
}

void SdoClient::upload_text(ObjectAddress object) {
  upload(object);
  is_text_ = true;
  text_size_ = 0;
}

void SdoClient::download(ObjectAddress object, std::uint32_t value, std::uint8_t size_bytes) {
  Frame request;
  request.data[0] = static_cast<std::uint8_t>(kDownloadBase | (4 - size_bytes) << 2);
  put_u32(request, 4, value);
  begin(request, object, false);
}

void SdoClient::cancel() {
  status_ = Status::idle;
  abort_.reset();
}

void SdoClient::give_up(Status end, std::uint32_t code) {
  // Made now: when it is sent, the client may already be about another object.
  Frame frame{sdo_request_id(node_), 8, {kAbort}};
  put_u16(frame, 1, object_.index);
  frame.data[3] = object_.sub;
  put_u32(frame, 4, code);
  abort_ = frame;
  abort_code_ = code;
  status_ = end;
}

std::optional<Frame> SdoClient::frame_to_send() const {
  if (abort_) return abort_;
  if (status_ == Status::to_send) return request_;
  return std::nullopt;
}

void SdoClient::sent(std::int64_t now_ns) {
  if (abort_) {
    abort_.reset();
  } else if (status_ == Status::to_send) {
    status_ = Status::waiting;
    sent_ns_ = now_ns;
  }
}

void SdoClient::check_time(std::int64_t now_ns) {
  if (status_ != Status::waiting || now_ns - sent_ns_ < timeout_ns_) return;
  give_up(Status::timed_out, kAbortTimeout);
}

void SdoClient::ask_for_segment() {
  request_ = {sdo_request_id(node_), 8, {static_cast<std::uint8_t>(kSegment | toggle_)}};
  status_ = Status::to_send;
}

void SdoClient::append(const Frame& frame, std::size_t from, std::size_t bytes) {
  if (text_size_ + bytes > kLongestText) return give_up(Status::aborted, kAbortMemory);
  for (std::size_t i = 0; i < bytes; ++i) text_.at(text_size_++) = static_cast<char>(frame.data.at(from + i));
}

void SdoClient::on_upload_begun(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  if ((command & kUploadMask) == kUploadExpedited) {
    const unsigned unused = (command & 1U) != 0 ? (command >> 2) & 3U : 0U;
    value_ = get_u32(frame, 4) & (0xFFFFFFFFU >> (8 * unused));
    if (is_text_) append(frame, 4, 4 - unused);
    status_ = Status::done;
  } else if (is_text_) {
    in_segments_ = true;
    toggle_ = 0;
    ask_for_segment();
  } else {
    give_up(Status::aborted, kAbortCommand);  // no number is longer than 4 bytes
  }
}

void SdoClient::on_segment(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  if ((command & (kCommandMask | kToggle)) != toggle_) {
    ++ignored_;  // of another transfer, or the one before again
    return;
  }
  status_ = Status::done;
  append(frame, 1, 7U - ((command >> 1) & 7U));
  toggle_ ^= kToggle;
  if (status_ == Status::done && (command & 1U) == 0) ask_for_segment();
}

void SdoClient::on_response(const Frame& frame) {
  const bool is_answer = status_ == Status::waiting && frame.size == 8;
  if (is_answer && in_segments_ && frame.data[0] != kAbort) return on_segment(frame);
  const bool matches = is_answer && get_u16(frame, 1) == object_.index && frame.data[3] == object_.sub;
  if (!matches) {
    ++ignored_;  // late, duplicate, or meant for a request that was given up
    return;
  }
  const std::uint8_t command = frame.data[0];
  if (command == kAbort) {
    abort_code_ = get_u32(frame, 4);
    status_ = Status::aborted;
  } else if (!is_upload_ && command == kDownloadDone) {
    status_ = Status::done;
  } else if (is_upload_ && (command & kCommandMask) == kUpload) {
    on_upload_begun(frame);
  } else {
    ++ignored_;
  }
}

}  // namespace bevel::stepper::cia301
