// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The part of CANopen (CiA 301) that a master of two drives needs: identifiers, NMT, SYNC, heartbeat, expedited SDO.

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include <bevel/drivers/can/frame.hpp>

namespace bevel::stepper::cia301 {

/// Frame of the bus below this protocol.
using can::Frame;

/// Identifier of NMT commands (predefined connection set, CiA 301 section 7.3.5).
inline constexpr std::uint32_t kNmtId = 0x000;
inline constexpr std::uint32_t kSyncId = 0x080;  ///< identifier of SYNC
/// Returns the identifier of the emergency messages of a node: function code + node id (CiA 301 section 7.3.5).
/// @param node node id, 1..127
/// @return 11-bit identifier
constexpr std::uint32_t emcy_id(std::uint8_t node) { return 0x080U + node; }
/// Returns the identifier of the first PDO that a node transmits.
/// @param node node id, 1..127
/// @return 11-bit identifier
constexpr std::uint32_t tpdo1_id(std::uint8_t node) { return 0x180U + node; }
/// Returns the identifier of the second PDO that a node transmits.
/// @param node node id, 1..127
/// @return 11-bit identifier
constexpr std::uint32_t tpdo2_id(std::uint8_t node) { return 0x280U + node; }
/// Returns the identifier of the first PDO that a node receives.
/// @param node node id, 1..127
/// @return 11-bit identifier
constexpr std::uint32_t rpdo1_id(std::uint8_t node) { return 0x200U + node; }
/// Returns the identifier of the responses of a node's default SDO server.
/// @param node node id, 1..127
/// @return 11-bit identifier
constexpr std::uint32_t sdo_response_id(std::uint8_t node) { return 0x580U + node; }
/// Returns the identifier of the requests to a node's default SDO server.
/// @param node node id, 1..127
/// @return 11-bit identifier
constexpr std::uint32_t sdo_request_id(std::uint8_t node) { return 0x600U + node; }
/// Returns the identifier of a node's heartbeat and boot-up messages.
/// @param node node id, 1..127
/// @return 11-bit identifier
constexpr std::uint32_t heartbeat_id(std::uint8_t node) { return 0x700U + node; }

/// NMT commands, coded as in the command's first byte.
enum class NmtCommand : std::uint8_t {
  start = 0x01,                ///< to operational
  stop = 0x02,                 ///< to stopped
  pre_operational = 0x80,      ///< to pre-operational
  reset_node = 0x81,           ///< reset of the application and the communication
  reset_communication = 0x82,  ///< reset of the communication
};
/// NMT states, coded as in a heartbeat.
enum class NmtState : std::uint8_t {
  boot_up = 0x00,         ///< boot-up message
  stopped = 0x04,         ///< stopped
  operational = 0x05,     ///< operational
  pre_operational = 0x7F  ///< pre-operational
};

/// SDO abort code: SDO protocol timed out.
inline constexpr std::uint32_t kAbortTimeout = 0x05040000;
/// SDO abort code: attempt to write a read-only object.
inline constexpr std::uint32_t kAbortReadOnly = 0x06010002;
/// SDO abort code: object does not exist.
inline constexpr std::uint32_t kAbortNoObject = 0x06020000;
/// SDO abort code: sub-index does not exist.
inline constexpr std::uint32_t kAbortNoSubIndex = 0x06090011;

/// Encodes an NMT command.
/// @param command command
/// @param node    node id, 1..127; 0 addresses all nodes
/// @return frame with identifier kNmtId
Frame nmt(NmtCommand command, std::uint8_t node);
/// Encodes a SYNC without a counter.
/// @return frame with identifier kSyncId and no data
Frame sync();
/// Encodes a heartbeat.
/// @param node  node id of the sender, 1..127
/// @param state NMT state of the sender
/// @return frame with identifier heartbeat_id(node)
Frame heartbeat(std::uint8_t node, NmtState state);
/// Decodes a heartbeat or boot-up message. The toggle bit is ignored.
/// @param frame received frame; the identifier is not checked
/// @return NMT state; empty if the frame is not 1 byte long or the state is not defined
std::optional<NmtState> decode_heartbeat(const Frame& frame);

/// Content of an emergency message.
struct Emergency {
  std::uint16_t code = 0;           ///< error code; 0x0000: all errors cleared
  std::uint8_t error_register = 0;  ///< error register (object 0x1001)
};
/// Decodes an emergency message.
/// @param frame received frame; the identifier is not checked
/// @return content; empty if the frame is not 8 bytes long
std::optional<Emergency> decode_emergency(const Frame& frame);

/// Reads a little-endian 16-bit field.
/// @param frame frame; the caller has checked its size
/// @param at    index of the first byte, 0..6
/// @return value
/// @throws std::out_of_range if the field exceeds the 8 data bytes
std::uint16_t get_u16(const Frame& frame, std::size_t at);
/// Reads a little-endian 32-bit field.
/// @param frame frame; the caller has checked its size
/// @param at    index of the first byte, 0..4
/// @return value
/// @throws std::out_of_range if the field exceeds the 8 data bytes
std::uint32_t get_u32(const Frame& frame, std::size_t at);
/// Writes a little-endian 16-bit field. Does not change the frame's size.
/// @param frame frame to change
/// @param at    index of the first byte, 0..6
/// @param value value to write
/// @throws std::out_of_range if the field exceeds the 8 data bytes
void put_u16(Frame& frame, std::size_t at, std::uint16_t value);
/// Writes a little-endian 32-bit field. Does not change the frame's size.
/// @param frame frame to change
/// @param at    index of the first byte, 0..4
/// @param value value to write
/// @throws std::out_of_range if the field exceeds the 8 data bytes
void put_u32(Frame& frame, std::size_t at, std::uint32_t value);

/// Address of one entry in an object dictionary.
struct ObjectAddress {
  std::uint16_t index = 0;  ///< index of the object
  std::uint8_t sub = 0;     ///< sub-index
  /// Compares both members.
  /// @return true if index and sub-index are equal
  bool operator==(const ObjectAddress&) const = default;
};

/// Client of one node's default SDO server, one transfer at a time.
///
/// Numbers are transferred expedited (a segmented answer to upload() is aborted), texts also in segments. An answer is
/// accepted only if command, index and sub-index match the request, or if command and toggle bit match those of a
/// segment. Every other answer is counted and ignored.
class SdoClient {
 public:
  /// State of the transfer.
  enum class Status : std::uint8_t {
    idle,       ///< no transfer
    to_send,    ///< frame_to_send() has a frame to send
    waiting,    ///< the request is sent, the answer is awaited
    done,       ///< complete; value() or text() is valid after an upload
    aborted,    ///< aborted with abort_code()
    timed_out,  ///< no answer in time; an abort is to be sent first (frame_to_send())
  };

  /// Creates an idle client.
  /// @param node       node id of the server, 1..127
  /// @param timeout_ns longest time from a request to its answer, ns
  SdoClient(std::uint8_t node, std::int64_t timeout_ns) : node_(node), timeout_ns_(timeout_ns) {}

  /// Largest length of a text, bytes. The transfer of a longer one is aborted.
  static constexpr std::size_t kLongestText = 64;

  /// Begins to read a number of at most 4 bytes. A transfer under way is dropped.
  /// @param object entry to read
  void upload(ObjectAddress object);
  /// Begins to read a text. The time-out applies to each segment.
  /// @param object entry to read
  void upload_text(ObjectAddress object);
  /// Begins to write a number.
  /// @param object     entry to write
  /// @param value      value to write
  /// @param size_bytes size of the entry, 1..4 bytes
  void download(ObjectAddress object, std::uint32_t value, std::uint8_t size_bytes);
  /// Drops the transfer without an abort message to the server.
  void cancel();

  /// Returns the frame to send, without removing it. Call sent() once the bus has accepted it.
  /// @return request or abort; empty if there is nothing to send
  std::optional<Frame> frame_to_send() const;
  /// Records that the frame of frame_to_send() was accepted by the bus.
  /// @param now_ns steady clock, ns
  void sent(std::int64_t now_ns);
  /// Ends a transfer whose answer is overdue: an abort is to be sent, and the status is Status::timed_out.
  /// @param now_ns steady clock, ns
  void check_time(std::int64_t now_ns);
  /// Processes a response of the server.
  /// @param frame received frame with identifier sdo_response_id()
  void on_response(const Frame& frame);

  /// @return state of the transfer
  Status status() const { return status_; }
  /// @return entry of the last transfer
  ObjectAddress object() const { return object_; }
  /// @return value of the last complete upload()
  std::uint32_t value() const { return value_; }
  /// @return text of the last complete upload_text(); valid until the next transfer
  std::string_view text() const { return {text_.data(), text_size_}; }
  /// @return code of the last abort, received or sent
  std::uint32_t abort_code() const { return abort_code_; }
  /// @return number of responses that did not match a request
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
  std::optional<Frame> abort_;  // abort of a dropped transfer, not sent yet
  std::int64_t sent_ns_ = 0;
  std::uint32_t value_ = 0;
  std::uint32_t abort_code_ = 0;
  std::uint64_t ignored_ = 0;
};

}  // namespace bevel::stepper::cia301
