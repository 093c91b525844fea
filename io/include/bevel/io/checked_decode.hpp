// SPDX-License-Identifier: MIT
// The one way from bytes to a message. LCM's generated decoders trust their input: they accept trailing bytes and NaN,
// and allocate what a length in the message says. Here bytes are refused, with a reason and the field, before any harm:
// no exception, and no allocation except for strings whose lengths have been checked against the bytes that are there.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <bevel/io/message_fields.hpp>

namespace bevel::io {

enum class DecodeFault {
  size,          // not the number of bytes of this type, or no buffer
  fingerprint,   // another type, or another version of this one
  text,          // a string's length is outside the message, or it does not end at its first zero
  not_finite,    // NaN or infinity
  out_of_range,  // a code without meaning, a negative counter, a magnitude that no bench has
  inconsistent,  // a quaternion or heading without unit length, a covariance that is none
  time,          // not positive
};
inline constexpr int kDecodeFaultCount = 7;
const char* name_of(DecodeFault fault);

struct DecodeError {
  DecodeFault fault = DecodeFault::size;
  const char* field = "";  // static text; "" when the fault is not in one field
};
std::string describe(const DecodeError& error);

template <class Message>
struct Decoded {
  Message message{};                 // zero where `error` is set
  std::optional<DecodeError> error;  // empty: the message may be used

  explicit operator bool() const { return !error; }
  const Message& operator*() const { return message; }
  const Message* operator->() const { return &message; }
};

template <class Message>
Decoded<Message> checked_decode(const void* data, std::size_t size) noexcept;

// The same checks on a message that is already a structure: before it is sent, or after memory-to-memory transport.
template <class Message>
std::optional<DecodeError> check_fields(const Message& message) noexcept;

template <class Message>
std::vector<std::uint8_t> encode(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace bevel::io
