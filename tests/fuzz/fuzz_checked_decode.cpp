// SPDX-License-Identifier: MIT
// Arbitrary bytes as each of the messages. What is accepted is exactly what encoding it gives, within its bounds by a
// second, independent look, and no other type; what is refused leaves nothing behind.
#include <utility>
#include <vector>

#include <bevel/io/checked_decode.hpp>
#include "tests/fuzz/fuzz_support.hpp"

namespace bevel::fuzz {
namespace {

using io::DecodeFault;

struct SecondLook {
  bool good = true;
  void time(const char*, std::int64_t utime) { good &= utime > 0; }
  void count(const char*, std::int64_t value) { good &= value >= 0; }
  void code(const char*, std::int32_t value, std::int32_t lowest, std::int32_t highest) {
    good &= value >= lowest && value <= highest;
  }
  void number(const char*, const double* values, std::size_t size, double largest) {
    for (std::size_t i = 0; i < size; ++i) good &= values[i] >= -largest && values[i] <= largest;  // NaN: neither
  }
  void text(const char*, const std::string& text) { good &= text.find('\0') == std::string::npos; }
};

template <class Message>
bool is_accepted(const std::uint8_t* data, std::size_t size) {
  const auto decoded = io::checked_decode<Message>(data, size);
  if (!decoded) {
    BEVEL_MUST(io::encode(decoded.message) == io::encode(Message{}));
    BEVEL_MUST(!io::describe(*decoded.error).empty());
    return false;
  }
  const Message& message = *decoded;
  BEVEL_MUST(io::encode(message) == std::vector<std::uint8_t>(data, data + size));
  BEVEL_MUST(!io::check_fields(message));
  SecondLook look;
  io::visit_fields(message, look);
  BEVEL_MUST(look.good);

  // A message has one length: neither a byte less nor a byte more.
  BEVEL_MUST(!io::checked_decode<Message>(data, size - 1));
  std::vector<std::uint8_t> longer(data, data + size);
  longer.push_back(0);
  BEVEL_MUST(!io::checked_decode<Message>(longer.data(), longer.size()));
  return true;
}

}  // namespace
}  // namespace bevel::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bevel;
  const int types = fuzz::is_accepted<tip_measurement_t>(data, size) + fuzz::is_accepted<tip_heading_t>(data, size) +
                    fuzz::is_accepted<actuator_state_t>(data, size) + fuzz::is_accepted<motion_command_t>(data, size) +
                    fuzz::is_accepted<needle_state_t>(data, size) + fuzz::is_accepted<needle_shaft_t>(data, size) +
                    fuzz::is_accepted<steering_target_t>(data, size) +
                    fuzz::is_accepted<operator_heartbeat_t>(data, size) +
                    fuzz::is_accepted<process_status_t>(data, size);
  BEVEL_MUST(types <= 1);
  return 0;
}
