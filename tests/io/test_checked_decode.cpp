// SPDX-License-Identifier: MIT
// The checked decode against every way in which bytes can be wrong; each test runs over all message types and fields.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include <bevel/io/checked_decode.hpp>
#include <bevel/io/messages.hpp>

namespace bevel::io {
namespace {

template <class Message>
Message valid_message() {
  Message m{};
  m.utime = 1'700'000'000'000'000;
  m.seq = 41;
  if constexpr (std::is_same_v<Message, tip_measurement_t>) {
    for (int i = 0; i < 3; ++i) m.information_per_mm2[4 * i] = 100.0;
    m.position_mm[2] = 35.5;
  } else if constexpr (std::is_same_v<Message, tip_heading_t>) {
    m.heading[2] = 1;
    m.information_per_rad2[0] = m.information_per_rad2[4] = 2500;
  } else if constexpr (std::is_same_v<Message, actuator_state_t>) {
    m.axis_status[0] = m.axis_status[1] = 2;
    m.insertion_mm = 35.5;
  } else if constexpr (std::is_same_v<Message, motion_command_t>) {
    m.mode = 1;
    m.insertion_rate_mm_s = 5.0;
  } else if constexpr (std::is_same_v<Message, needle_state_t>) {
    m.orientation_wxyz[0] = 1.0;
    for (int i = 0; i < 9; ++i) m.covariance[10 * i] = 0.01;
    m.rank = 3;
  } else if constexpr (std::is_same_v<Message, needle_shaft_t>) {
    m.bending_mm = 40.0;
    m.bending_sd_mm = 8.0;
    m.guide_mm = 15.0;
  } else if constexpr (std::is_same_v<Message, steering_target_t>) {
    m.position_mm[2] = 100.0;
    m.tolerance_mm = 0.5;
  } else if constexpr (std::is_same_v<Message, operator_heartbeat_t>) {
    m.session = 7;
  } else {
    m.process = "bevel-estimator";
    m.state = "running";
    m.state_code = 1;
    m.reason = "";
  }
  return m;
}

template <class Message>
Decoded<Message> decode_bytes(const std::vector<std::uint8_t>& bytes) {
  return checked_decode<Message>(bytes.data(), bytes.size());
}

template <class Message>
class CheckedDecode : public ::testing::Test {};
using MessageTypes =
    ::testing::Types<tip_measurement_t, tip_heading_t, actuator_state_t, motion_command_t, needle_state_t,
                     needle_shaft_t, steering_target_t, operator_heartbeat_t, process_status_t>;
TYPED_TEST_SUITE(CheckedDecode, MessageTypes);

// Calls `action` for each field value in turn; base for the property tests below.
struct FieldVisitor {
  void time(const char*, std::int64_t&) {}
  void count(const char*, std::int64_t&) {}
  void code(const char*, std::int32_t&, std::int32_t, std::int32_t) {}
  void number(const char*, double*, std::size_t, double) {}
  void text(const char*, std::string&) {}
};

template <class Message>
struct BadNumbers : FieldVisitor {
  Message* message = nullptr;
  int tried = 0;
  void number(const char* name, double* values, std::size_t size, double largest) {
    const std::pair<double, DecodeFault> bad[] = {{std::numeric_limits<double>::quiet_NaN(), DecodeFault::not_finite},
                                                  {std::numeric_limits<double>::infinity(), DecodeFault::not_finite},
                                                  {-std::numeric_limits<double>::infinity(), DecodeFault::not_finite},
                                                  {1.001 * largest, DecodeFault::out_of_range},
                                                  {-1.001 * largest, DecodeFault::out_of_range}};
    for (std::size_t i = 0; i < size; ++i) {
      for (const auto& [value, fault] : bad) {
        const double good = values[i];
        values[i] = value;
        const auto decoded = decode_bytes<Message>(encode(*message));
        ASSERT_TRUE(decoded.error) << name << "[" << i << "] = " << value;
        EXPECT_EQ(decoded.error->fault, fault) << name << "[" << i << "] = " << value;
        EXPECT_STREQ(decoded.error->field, name);
        values[i] = good;
        ++tried;
      }
    }
  }
};

template <class Message>
struct BadCodes : FieldVisitor {
  Message* message = nullptr;
  int tried = 0;
  template <class Integer>
  void expect_refused(const char* name, Integer& field, Integer value, DecodeFault fault) {
    const Integer good = field;
    field = value;
    const auto decoded = decode_bytes<Message>(encode(*message));
    ASSERT_TRUE(decoded.error) << name << " = " << value;
    EXPECT_EQ(decoded.error->fault, fault) << name << " = " << value;
    EXPECT_STREQ(decoded.error->field, name);
    field = good;
    ++tried;
  }
  void code(const char* name, std::int32_t& value, std::int32_t lowest, std::int32_t highest) {
    expect_refused(name, value, lowest - 1, DecodeFault::out_of_range);
    expect_refused(name, value, std::numeric_limits<std::int32_t>::min(), DecodeFault::out_of_range);
    if (highest != kAnyCode) expect_refused(name, value, highest + 1, DecodeFault::out_of_range);
  }
  void count(const char* name, std::int64_t& value) {
    expect_refused(name, value, std::int64_t{-1}, DecodeFault::out_of_range);
    expect_refused(name, value, std::numeric_limits<std::int64_t>::min(), DecodeFault::out_of_range);
  }
  void time(const char* name, std::int64_t& value) {
    expect_refused(name, value, std::int64_t{0}, DecodeFault::time);
    expect_refused(name, value, std::numeric_limits<std::int64_t>::min(), DecodeFault::time);
  }
};

TYPED_TEST(CheckedDecode, accepts_a_valid_message_unchanged) {
  const auto bytes = encode(valid_message<TypeParam>());
  const auto decoded = decode_bytes<TypeParam>(bytes);
  ASSERT_TRUE(decoded) << describe(*decoded.error);
  EXPECT_EQ(encode(*decoded), bytes);
}

TYPED_TEST(CheckedDecode, refuses_every_bad_number_in_every_field) {
  auto message = valid_message<TypeParam>();
  BadNumbers<TypeParam> visitor;
  visitor.message = &message;
  visit_fields(message, visitor);
  if constexpr (std::is_same_v<TypeParam, operator_heartbeat_t>)
    EXPECT_EQ(visitor.tried, 0) << "it has no number";
  else
    EXPECT_GE(visitor.tried, 5 * 2);
}

TYPED_TEST(CheckedDecode, refuses_every_bad_code_counter_and_time) {
  auto message = valid_message<TypeParam>();
  BadCodes<TypeParam> visitor;
  visitor.message = &message;
  visit_fields(message, visitor);
  EXPECT_GE(visitor.tried, 4);
}

TYPED_TEST(CheckedDecode, refuses_every_other_length) {
  auto bytes = encode(valid_message<TypeParam>());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    // A copy of just this length, so that the address sanitizer sees a read beyond it.
    const std::vector<std::uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    ASSERT_FALSE(decode_bytes<TypeParam>(cut)) << size << " of " << bytes.size() << " bytes";
  }
  bytes.push_back(0);
  EXPECT_FALSE(decode_bytes<TypeParam>(bytes)) << "a trailing byte";
  EXPECT_FALSE(checked_decode<TypeParam>(nullptr, bytes.size()));
}

TYPED_TEST(CheckedDecode, refuses_any_other_fingerprint) {
  auto bytes = encode(valid_message<TypeParam>());
  for (std::size_t bit = 0; bit < 64; ++bit) {
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    const auto decoded = decode_bytes<TypeParam>(bytes);
    ASSERT_TRUE(decoded.error);
    EXPECT_EQ(decoded.error->fault, DecodeFault::fingerprint);
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
  }
}

// Whatever the bytes, an accepted message satisfies the checks and encodes to the same bytes: nothing was ignored.
TYPED_TEST(CheckedDecode, random_damage_is_refused_or_harmless) {
  const auto original = encode(valid_message<TypeParam>());
  constexpr unsigned kSeed = 20150928;
  std::mt19937 random(kSeed);
  int refused = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    auto bytes = original;
    const int damages = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < damages; ++i) bytes[8 + random() % (bytes.size() - 8)] = static_cast<std::uint8_t>(random());
    const auto decoded = decode_bytes<TypeParam>(bytes);
    if (!decoded) {
      ++refused;
      continue;
    }
    ASSERT_FALSE(check_fields(*decoded)) << "seed " << kSeed << ", trial " << trial;
    ASSERT_EQ(encode(*decoded), bytes) << "seed " << kSeed << ", trial " << trial;
  }
  EXPECT_GT(refused, 0);
}

TEST(CheckedDecodeText, lengths_that_crash_the_generated_decoder_are_refused) {
  const auto original = encode(valid_message<process_status_t>());
  const std::size_t length_at = 8 + 8 + 8 + 8;  // fingerprint, utime, seq, session; then the length of `process`
  for (const std::uint32_t length : {0U, 0xffffffffU, 0x80000000U, 0x7fffffffU, 0x10000000U, 4097U, 17U, 15U}) {
    auto bytes = original;
    for (std::size_t i = 0; i < 4; ++i) bytes[length_at + i] = static_cast<std::uint8_t>(length >> (24 - 8 * i));
    const auto decoded = decode_bytes<process_status_t>(bytes);
    ASSERT_TRUE(decoded.error) << length;
    EXPECT_EQ(decoded.error->fault, DecodeFault::text) << length;
    EXPECT_STREQ(decoded.error->field, "process");
  }
}

TEST(CheckedDecodeMatrix, an_information_matrix_must_be_one) {
  auto message = valid_message<tip_measurement_t>();
  message.information_per_mm2[8] = 0.0;  // rank two is what a single camera gives
  EXPECT_FALSE(check_fields(message));
  message.information_per_mm2[0] = -1.0;
  EXPECT_EQ(check_fields(message)->fault, DecodeFault::inconsistent);
  message = valid_message<tip_measurement_t>();
  message.information_per_mm2[1] = 5.0;  // and [3] is not
  EXPECT_EQ(check_fields(message)->fault, DecodeFault::inconsistent);
  message.information_per_mm2[3] = 5.0;
  EXPECT_FALSE(check_fields(message));
  message.information_per_mm2[1] = message.information_per_mm2[3] = 101.0;  // correlation above one
  EXPECT_EQ(check_fields(message)->fault, DecodeFault::inconsistent);
}

TEST(CheckedDecodeHeading, it_must_have_unit_length_unless_the_sender_says_that_it_saw_nothing) {
  for (const double length : {0.0, 0.998, 1.002}) {
    auto message = valid_message<tip_heading_t>();
    message.heading[2] = length;
    ASSERT_TRUE(check_fields(message)) << length;
    EXPECT_EQ(check_fields(message)->fault, DecodeFault::inconsistent);
    EXPECT_STREQ(check_fields(message)->field, "heading");
  }
  auto message = valid_message<tip_heading_t>();
  message.heading[2] = 0.9995;
  EXPECT_FALSE(check_fields(message));
  message = {};
  message.utime = 1;
  message.status = 2;
  EXPECT_FALSE(check_fields(message)) << "nothing seen, nothing known";
  message.heading[0] = 0.5;
  EXPECT_TRUE(check_fields(message));
}

// Each pair of rows is a valid matrix, all three are not: correlations of -0.6 give an eigenvalue of -0.2.
TEST(CheckedDecodeMatrix, RefusesAnIndefiniteMatrix) {
  auto tip = valid_message<tip_measurement_t>();
  auto state = valid_message<needle_state_t>();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      tip.information_per_mm2[3 * i + j] = i == j ? 100.0 : -60.0;
      state.covariance[9 * (i + 3) + j + 3] = i == j ? 1e-4 : -0.6e-4;
    }
  ASSERT_TRUE(check_fields(tip));
  EXPECT_STREQ(check_fields(tip)->field, "information_per_mm2");
  ASSERT_TRUE(check_fields(state));
  EXPECT_STREQ(check_fields(state)->field, "covariance");
  for (int i = 0; i < 9; ++i) tip.information_per_mm2[i] = i % 4 == 0 ? 100.0 : -50.0;  // rank two
  EXPECT_FALSE(check_fields(tip));
}

// Entries whose inverse, or whose square, is no number; and an information matrix that no measurement has.
TEST(CheckedDecodeMatrix, RefusesEntriesThatNoMeasurementHas) {
  for (const double tiny : {5e-324, 1e-310, 1e-200}) {
    for (const int entry : {0, 4, 8}) {
      auto tip = valid_message<tip_measurement_t>();
      tip.information_per_mm2[entry] = tiny;
      EXPECT_TRUE(check_fields(tip)) << tiny << " at " << entry;
    }
    auto tip = valid_message<tip_measurement_t>();
    tip.information_per_mm2[1] = tip.information_per_mm2[3] = tiny;
    EXPECT_TRUE(check_fields(tip)) << tiny << " off the diagonal";
    auto state = valid_message<needle_state_t>();
    state.covariance[60] = tiny;
    EXPECT_TRUE(check_fields(state)) << tiny;
    auto heading = valid_message<tip_heading_t>();
    heading.information_per_rad2[0] = tiny;
    EXPECT_TRUE(check_fields(heading)) << tiny;
  }
  auto tip = valid_message<tip_measurement_t>();
  for (int i = 0; i < 3; ++i) tip.information_per_mm2[4 * i] = 1e-8;
  EXPECT_TRUE(check_fields(tip)) << "a standard deviation of 10 m";
  for (int i = 0; i < 3; ++i) tip.information_per_mm2[4 * i] = 1e-3;
  EXPECT_FALSE(check_fields(tip)) << "a standard deviation of 32 mm";
  for (int i = 0; i < 3; ++i) tip.information_per_mm2[4 * i] = 0;
  EXPECT_FALSE(check_fields(tip)) << "nothing is seen";
}

TEST(CheckedDecodeHeading, its_information_is_across_it_alone_and_positive_semidefinite) {
  const Eigen::Vector3d along = Eigen::Vector3d(0.2, -0.4, 1).normalized();
  const Eigen::Vector3d a = along.unitOrthogonal(), b = along.cross(a);
  const auto with = [&along](const Eigen::Matrix3d& information) {
    model::TipHeading heading;
    heading.utime = 1;
    heading.heading = along;
    heading.information_per_rad2 = information;
    return check_fields(to_message(heading));
  };
  const Eigen::Matrix3d across = 900 * a * a.transpose() + 2500 * b * b.transpose();
  EXPECT_FALSE(with(across));
  EXPECT_FALSE(with(2500 * b * b.transpose())) << "one camera";
  EXPECT_FALSE(with(Eigen::Matrix3d::Zero()));
  EXPECT_FALSE(with(across.cast<float>().cast<double>())) << "of a sender in single precision";
  const std::pair<const char*, Eigen::Matrix3d> wrong[] = {
      {"the same to all sides", 2500 * Eigen::Matrix3d::Identity()},
      {"along the heading", across + 100 * along * along.transpose()},
      {"one negative", 900 * a * a.transpose() - 100 * b * b.transpose()},
      {"not symmetric", across + 100 * a * b.transpose()}};
  for (const auto& [name, information] : wrong) {
    ASSERT_TRUE(with(information)) << name;
    EXPECT_EQ(with(information)->fault, DecodeFault::inconsistent) << name;
    EXPECT_STREQ(with(information)->field, "information_per_rad2") << name;
  }
}

TEST(CheckedDecodeMatrix, an_orientation_must_have_unit_length) {
  auto message = valid_message<needle_state_t>();
  message.orientation_wxyz[0] = 0.9;
  EXPECT_STREQ(check_fields(message)->field, "orientation_wxyz");
}

TEST(Samples, conversion_there_and_back_loses_nothing) {
  auto tip = valid_message<tip_measurement_t>();
  for (int i = 0; i < 9; ++i) tip.information_per_mm2[i] = i;  // tells rows from columns
  tip.camera = 2;
  tip.status = 3;
  EXPECT_EQ(encode(to_message(to_sample(tip))), encode(tip));
  EXPECT_DOUBLE_EQ(to_sample(tip).information_per_mm2(0, 2), 2.0);
  auto heading = valid_message<tip_heading_t>();
  for (int i = 0; i < 9; ++i) heading.information_per_rad2[i] = i;
  heading.camera = 1;
  heading.status = 4;
  heading.heading[0] = -0.25;
  EXPECT_EQ(encode(to_message(to_sample(heading))), encode(heading));
  EXPECT_DOUBLE_EQ(to_sample(heading).information_per_rad2(0, 2), 2.0);
  auto actuator = valid_message<actuator_state_t>();
  actuator.axis_status[1] = 4;
  actuator.rotation_rate_rad_s = -1.5;
  EXPECT_EQ(encode(to_message(to_sample(actuator))), encode(actuator));
  auto command = valid_message<motion_command_t>();
  command.rotation_rate_rad_s = 0.25;
  EXPECT_EQ(encode(to_message(to_sample(command))), encode(command));
}

}  // namespace
}  // namespace bevel::io
