// SPDX-License-Identifier: MIT
// The bound of each integer code of each message is the last value of its enumeration.
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>

#include <bevel/io/checked_decode.hpp>

namespace bevel::io {
namespace {

// Largest accepted value by field, of every int32 field of a message.
struct Codes {
  std::map<std::string, std::int32_t> highest;
  void time(const char*, const std::int64_t&) {}
  void count(const char*, const std::int64_t&) {}
  void code(const char* name, const std::int32_t&, std::int32_t lowest, std::int32_t largest) {
    EXPECT_EQ(lowest, 0) << name;
    highest[name] = largest;
  }
  void number(const char*, const double*, std::size_t, double) {}
  void text(const char*, const std::string&) {}
};

template <class Message>
std::map<std::string, std::int32_t> codes_of() {
  const Message message{};
  Codes codes;
  visit_fields(message, codes);
  return codes.highest;
}

using Table = std::map<std::string, std::int32_t>;

enum class WithGap : std::int32_t { first = 0, second = 1, fourth = 3 };
enum Bits : std::int32_t { kNone = 0, kFirst = 1, kThird = 4 };

TEST(EnumRange, CountsTheEnumerators) {
  EXPECT_EQ(last_code<WithGap>(), 1);
  EXPECT_EQ(all_flags<Bits>(), 5);
}

// A new enumerator changes its bound in the decode without any other edit; a field that is added to a message without a
// row here fails.
TEST(WireCodes, EachHasTheBoundOfItsEnumeration) {
  EXPECT_EQ(codes_of<steering_target_t>(),
            (Table{{"request", static_cast<std::int32_t>(controller::Request::arm_to_retract)}}));
  EXPECT_EQ(codes_of<motion_command_t>(), (Table{{"mode", static_cast<std::int32_t>(model::MotionMode::run)}}));
  const auto fault = static_cast<std::int32_t>(model::AxisStatus::fault);
  EXPECT_EQ(codes_of<actuator_state_t>(), (Table{{"axis_status[0]", fault}, {"axis_status[1]", fault}}));
  EXPECT_EQ(codes_of<process_status_t>(), (Table{{"state_code", static_cast<std::int32_t>(ProcessState::fault)}}));
  EXPECT_EQ(codes_of<needle_state_t>(),
            (Table{{"rank", 3}, {"health", all_flags<estimator::Health>()}, {"reset_count", kAnyCode}}));
  // Senders of other makers define other reasons; every status but 0 means "not usable".
  EXPECT_EQ(codes_of<tip_measurement_t>(), (Table{{"camera", kAnyCode}, {"status", kAnyCode}}));
  EXPECT_EQ(codes_of<tip_heading_t>(), (Table{{"camera", kAnyCode}, {"status", kAnyCode}}));
  EXPECT_TRUE(codes_of<needle_shaft_t>().empty());
  EXPECT_TRUE(codes_of<operator_heartbeat_t>().empty());
}

TEST(WireCodes, EveryRequestPassesTheDecodeAndTheNextNumberDoesNot) {
  steering_target_t m{};
  m.utime = 1'700'000'000'000'000;
  for (m.request = 0; m.request <= last_code<controller::Request>(); ++m.request) {
    const auto bytes = encode(m);
    const auto decoded = checked_decode<steering_target_t>(bytes.data(), bytes.size());
    EXPECT_TRUE(decoded) << "request " << m.request << ": " << describe(*decoded.error);
  }
  EXPECT_EQ(m.request, 10) << "documented in bevel_steering_target_t.lcm";
  EXPECT_TRUE(check_fields(m));
}

TEST(WireCodes, EveryHealthFlagPassesTheDecodeAndAnUnknownOneDoesNot) {
  needle_state_t m{};
  m.utime = 1'700'000'000'000'000;
  m.orientation_wxyz[0] = 1;
  m.health = all_flags<estimator::Health>();
  EXPECT_FALSE(check_fields(m));
  ++m.health;
  EXPECT_TRUE(check_fields(m));
}

TEST(ProcessState, EveryStateHasAName) {
  for (std::int32_t code = 0; code <= last_code<ProcessState>(); ++code)
    EXPECT_STRNE(to_string(static_cast<ProcessState>(code)), "?") << code;
  EXPECT_STREQ(to_string(static_cast<ProcessState>(last_code<ProcessState>() + 1)), "?");
}

}  // namespace
}  // namespace bevel::io
