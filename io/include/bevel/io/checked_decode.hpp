// SPDX-License-Identifier: MIT
/// \file
/// Checked decoding of LCM messages.
///
/// LCM's generated decoders trust their input: they accept trailing bytes and NaN, and allocate the memory that a
/// length in the message asks for. The functions of this file reject such bytes and return the reason and the field.
/// They throw no exception. They allocate memory only for strings whose lengths have been compared with the bytes that
/// exist.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <bevel/io/message_fields.hpp>

namespace bevel::io {

/// Reasons to reject a message.
enum class DecodeFault {
  size,          ///< the number of bytes is not that of the type, or there is no buffer
  fingerprint,   ///< the bytes are another type, or another version of the type
  text,          ///< the length of a string leads outside the message, or the string does not end at its first zero
  not_finite,    ///< NaN or infinity
  out_of_range,  ///< undefined code, negative counter, or magnitude beyond the limits of message_fields.hpp
  inconsistent,  ///< quaternion or heading without unit length, matrix that is no covariance or information matrix
  time,          ///< the time is not positive
};
inline constexpr int kDecodeFaultCount = 7;  ///< number of enumerators of DecodeFault
/// Returns the name of a fault, "not finite" for instance.
/// @param fault  enumerator
/// @return static text
const char* name_of(DecodeFault fault);

/// Reason why a message was rejected.
struct DecodeError {
  DecodeFault fault = DecodeFault::size;  ///< kind of fault
  const char* field = "";                 ///< static text: name of the field; "" if the fault is not in one field
};
/// Describes a fault, "not finite: position_mm" for instance.
/// @param error  fault and field
/// @return text without a line end
std::string describe(const DecodeError& error);

/// Result of checked_decode().
/// @tparam Message  LCM type
template <class Message>
struct Decoded {
  Message message{};                 ///< decoded message; all fields are zero if \ref error is set
  std::optional<DecodeError> error;  ///< empty if the message is valid

  /// Returns true if the message is valid.
  explicit operator bool() const { return !error; }
  /// Returns the message.
  /// @return the decoded message; all fields are zero after a fault
  const Message& operator*() const { return message; }
  /// Returns a pointer to the message.
  /// @return address of the decoded message; never null
  const Message* operator->() const { return &message; }
};

/// Decodes a message and checks all its fields.
/// @tparam Message  LCM type
/// @param data  encoded message; may be null
/// @param size  number of bytes
/// @return the message, or the reason why it was rejected
template <class Message>
Decoded<Message> checked_decode(const void* data, std::size_t size) noexcept;

/// Checks all fields of a message that is not encoded: before it is sent, or after transport in memory.
/// @tparam Message  LCM type
/// @param message  message to check
/// @return the first fault; nothing if the message is valid
template <class Message>
std::optional<DecodeError> check_fields(const Message& message) noexcept;

/// Encodes a message.
/// @tparam Message  LCM type
/// @param message  encoded without checks of its fields
/// @return the bytes that LCM transmits
template <class Message>
std::vector<std::uint8_t> encode(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace bevel::io
