// SPDX-License-Identifier: MIT
// The part of CANopen (CiA 301) that a master of two drives needs: identifiers, NMT, SYNC, heartbeat, expedited SDO.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include <bevel/drivers/can/frame.hpp>

namespace bevel::stepper::cia301 {

using can::Frame;

// Predefined connection set, CiA 301 section 7.3.5: function code + node id.
inline constexpr std::uint32_t kNmtId = 0x000;
inline constexpr std::uint32_t kSyncId = 0x080;
constexpr std::uint32_t emcy_id(std::uint8_t node) { return 0x080U + node; }
constexpr std::uint32_t tpdo1_id(std::uint8_t node) { return 0x180U + node; }
constexpr std::uint32_t tpdo2_id(std::uint8_t node) { return 0x280U + node; }
constexpr std::uint32_t rpdo1_id(std::uint8_t node) { return 0x200U + node; }
constexpr std::uint32_t sdo_response_id(std::uint8_t node) { return 0x580U + node; }
constexpr std::uint32_t sdo_request_id(std::uint8_t node) { return 0x600U + node; }
constexpr std::uint32_t heartbeat_id(std::uint8_t node) { return 0x700U + node; }

enum class NmtCommand : std::uint8_t {
  start = 0x01,
  stop = 0x02,
  pre_operational = 0x80,
  reset_node = 0x81,
  reset_communication = 0x82,
};
enum class NmtState : std::uint8_t { boot_up = 0x00, stopped = 0x04, operational = 0x05, pre_operational = 0x7F };

inline constexpr std::uint32_t kAbortTimeout = 0x05040000;
inline constexpr std::uint32_t kAbortReadOnly = 0x06010002;
inline constexpr std::uint32_t kAbortNoObject = 0x06020000;
inline constexpr std::uint32_t kAbortNoSubIndex = 0x06090011;

Frame nmt(NmtCommand command, std::uint8_t node);
Frame sync();
Frame heartbeat(std::uint8_t node, NmtState state);
std::optional<NmtState> decode_heartbeat(const Frame& frame);

struct Emergency {
  std::uint16_t code = 0;  // 0x0000: all errors cleared
  std::uint8_t error_register = 0;
};
std::optional<Emergency> decode_emergency(const Frame& frame);  // nothing when the frame is not 8 bytes

// Little-endian fields of a frame; the caller has checked the frame's size.
std::uint16_t get_u16(const Frame& frame, std::size_t at);
std::uint32_t get_u32(const Frame& frame, std::size_t at);
void put_u16(Frame& frame, std::size_t at, std::uint16_t value);
void put_u32(Frame& frame, std::size_t at, std::uint32_t value);

// One object of a dictionary.
struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  bool operator==(const ObjectAddress&) const = default;
};

// Client of one node's default SDO server, one transfer at a time: numbers expedited (a segmented answer to upload() is
// aborted), texts also in segments. An answer is taken only when command, index and sub-index match the request, or
// command and toggle bit that of a segment; anything else is counted and ignored.
class SdoClient {
 public:
  enum class Status : std::uint8_t {
    idle,
    to_send,  // frame_to_send() has a frame to send
    waiting,
    done,       // value() or text() is valid after an upload
    aborted,    // abort_code() says why
    timed_out,  // an abort is to be sent first: frame_to_send()
  };

  SdoClient(std::uint8_t node, std::int64_t timeout_ns) : node_(node), timeout_ns_(timeout_ns) {}

  static constexpr std::size_t kLongestText = 64;  // of a longer one the transfer is aborted

  void upload(ObjectAddress object);
  void upload_text(ObjectAddress object);  // each segment has the whole time-out
  void download(ObjectAddress object, std::uint32_t value, std::uint8_t size_bytes);
  void cancel();  // forget the transfer, without a word to the server

  std::optional<Frame> frame_to_send() const;  // peek; call sent() once it was accepted by the bus
  void sent(std::int64_t now_ns);
  void check_time(std::int64_t now_ns);  // a transfer over its time: abort frame to send, then timed_out
  void on_response(const Frame& frame);

  Status status() const { return status_; }
  ObjectAddress object() const { return object_; }  // of the last transfer
  std::uint32_t value() const { return value_; }
  std::string_view text() const { return {text_.data(), text_size_}; }
  std::uint32_t abort_code() const { return abort_code_; }
  std::uint64_t ignored() const { return ignored_; }

 private:
  void begin(Frame request, ObjectAddress object, bool is_upload);
  void give_up(Status end, std::uint32_t code);
  void on_upload_begun(const Frame& frame);
  void on_segment(const Frame& frame);
  void ask_for_segment();
  void append(const Frame& frame, std::size_t from, std::size_t bytes);

  std::uint8_t node_;
  std::int64_t timeout_ns_;
  Status status_ = Status::idle;
  Frame request_{};
  ObjectAddress object_{};
  bool is_upload_ = false;
  bool is_text_ = false;
  bool in_segments_ = false;
  std::uint8_t toggle_ = 0;
  std::array<char, kLongestText> text_{};
  std::size_t text_size_ = 0;
  std::optional<Frame> abort_;  // of a transfer given up, yet to be sent
  std::int64_t sent_ns_ = 0;
  std::uint32_t value_ = 0;
  std::uint32_t abort_code_ = 0;
  std::uint64_t ignored_ = 0;
};

}  // namespace bevel::stepper::cia301
