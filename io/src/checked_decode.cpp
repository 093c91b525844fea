// SPDX-License-Identifier: MIT
#include <bevel/io/checked_decode.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace bevel::io {
namespace {

constexpr std::size_t kFingerprintSize = 8;
constexpr std::size_t kLongestText = 4096;
// Of a heading's length, and of what its information matrix leaves along it, against its trace: a sender that computes
// in single precision, or rounds for a file, is well within.
constexpr double kHeadingTolerance = 1e-3;

std::uint64_t read_big_endian(const std::uint8_t* bytes, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = (value << 8U) | bytes[i];
  return value;
}

// Encoded size of a message with these strings empty; each adds its length.
template <class Message>
std::size_t fixed_size() {
  static const auto size = static_cast<std::size_t>(Message{}.getEncodedSize());
  return size;
}

// Walks the fields without decoding, to find whether the strings' lengths fit the bytes exactly.
class TextWalk {
 public:
  TextWalk(const std::uint8_t* bytes, std::size_t size) : bytes_(bytes), size_(size) {}
  void time(const char*, const std::int64_t&) { skip(8); }
  void count(const char*, const std::int64_t&) { skip(8); }
  void code(const char*, const std::int32_t&, std::int32_t, std::int32_t) { skip(4); }
  void number(const char*, const double*, std::size_t values, double) { skip(8 * values); }
  void text(const char* name, const std::string&) {
    if (error_ || !skip(4)) return;
    const std::uint64_t length = read_big_endian(bytes_ + at_ - 4, 4);  // with the closing zero
    if (length < 1 || length > kLongestText || length > size_ - at_ ||
        std::find(bytes_ + at_, bytes_ + at_ + length, 0) != bytes_ + at_ + length - 1) {
      error_ = DecodeError{DecodeFault::text, name};
      return;
    }
    at_ += length;
  }
  std::optional<DecodeError> finish() const {
    if (!error_ && at_ != size_) return DecodeError{DecodeFault::size, ""};
    return error_;
  }

 private:
  bool skip(std::size_t count) {
    if (error_) return false;
    if (count > size_ - at_) {
      error_ = DecodeError{DecodeFault::size, ""};
      return false;
    }
    at_ += count;
    return true;
  }
  const std::uint8_t* bytes_;
  std::size_t size_;
  std::size_t at_ = kFingerprintSize;
  std::optional<DecodeError> error_;
};

// First fault among the fields.
class FieldCheck {
 public:
  void time(const char* name, std::int64_t utime) {
    if (utime <= 0) fail(DecodeFault::time, name);
  }
  void count(const char* name, std::int64_t value) {
    if (value < 0) fail(DecodeFault::out_of_range, name);
  }
  void code(const char* name, std::int32_t value, std::int32_t lowest, std::int32_t highest) {
    if (value < lowest || value > highest) fail(DecodeFault::out_of_range, name);
  }
  void number(const char* name, const double* values, std::size_t size, double largest) {
    for (std::size_t i = 0; i < size; ++i) {
      if (!std::isfinite(values[i])) return fail(DecodeFault::not_finite, name);
      if (std::abs(values[i]) > largest) return fail(DecodeFault::out_of_range, name);
    }
  }
  void text(const char* name, const std::string& value) {
    if (value.size() >= kLongestText) fail(DecodeFault::text, name);
  }
  void fail(DecodeFault fault, const char* field) {
    if (!error_) error_ = DecodeError{fault, field};
  }
  const std::optional<DecodeError>& error() const { return error_; }

 private:
  std::optional<DecodeError> error_;
};

// Rounding of a sender that computes in single precision, relative to the standard deviations of row and column.
constexpr double kMatrixTolerance = 1e-6;
// The product of two smaller numbers underflows, so that no arithmetic with them is safe. It is far below what rounding
// leaves of a rotated matrix, the square of 1e-16 of its entries.
constexpr double kSmallestEntry = 1e-150;

// Checks that a matrix is symmetric and positive semi-definite to rounding, and that each entry is zero or large enough
// to compute with. `unit2`: the square of the unit by which row and column i are scaled.
template <std::size_t kRows>
bool could_be_covariance(const double* matrix, const std::array<double, kRows>& unit2) {
  std::array<std::array<double, kRows>, kRows> L{};  // first the matrix in those units, then its Cholesky factor
  for (std::size_t i = 0; i < kRows; ++i) {
    if (matrix[i * kRows + i] < 0.0) return false;
    for (std::size_t j = 0; j <= i; ++j) {
      const double above = matrix[j * kRows + i], below = matrix[i * kRows + j];
      for (const double entry : {above, below})
        if (entry != 0.0 && std::abs(entry) < kSmallestEntry) return false;
      const double scale = std::sqrt(matrix[i * kRows + i]) * std::sqrt(matrix[j * kRows + j]);
      if (std::abs(above - below) > kMatrixTolerance * scale + 1e-12) return false;
      if (std::abs(above) > (1.0 + kMatrixTolerance) * scale + 1e-12) return false;  // a correlation beyond one
      const double unit = std::sqrt(unit2[i]) * std::sqrt(unit2[j]);
      L[i][j] = unit > 0.0 ? 0.5 * (above + below) / unit : 0.0;
    }
    L[i][i] += kRows * kMatrixTolerance;  // a matrix that is singular to rounding passes
  }
  for (std::size_t j = 0; j < kRows; ++j)
    for (std::size_t i = j; i < kRows; ++i) {
      double left = L[i][j];
      for (std::size_t k = 0; k < j; ++k) left -= L[i][k] * L[j][k];
      if (i > j) {
        L[i][j] = left / L[j][j];
      } else if (left > 0.0) {
        L[j][j] = std::sqrt(left);
      } else {
        return false;
      }
    }
  return true;
}

// Checks the information of a measurement: none at all, or that of a standard deviation that a measurement can have.
// Along an axis that is hardly observed an entry is rounding of the others, so all are scaled by the trace.
bool could_be_information(const double* matrix, double smallest) {
  const double trace = matrix[0] + matrix[4] + matrix[8];
  return could_be_covariance<3>(matrix, {trace, trace, trace}) && (trace == 0.0 || trace >= smallest);
}

// Checks the covariance of an estimate. Its rows have different units, so each is scaled by its standard deviation.
bool could_be_state_covariance(const double* matrix) {
  std::array<double, 9> variance{};
  for (std::size_t i = 0; i < variance.size(); ++i) variance[i] = matrix[10 * i];
  return could_be_covariance<9>(matrix, variance);
}

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// What a field alone cannot tell.
template <class Message>
const char* find_inconsistency(const Message&) {
  return nullptr;
}
template <>
const char* find_inconsistency(const tip_measurement_t& m) {
  return could_be_information(m.information_per_mm2, kSmallestInformation_per_mm2) ? nullptr : "information_per_mm2";
}
// A camera that says it sees nothing has no heading to give, and may leave it zero.
template <>
const char* find_inconsistency(const tip_heading_t& m) {
  const double length = std::sqrt(dot(m.heading, m.heading));
  if (std::abs(length - 1.0) > kHeadingTolerance && !(m.status != 0 && length == 0.0)) return "heading";
  if (!could_be_information(m.information_per_rad2, kSmallestInformation_per_rad2)) return "information_per_rad2";
  const double* W = m.information_per_rad2;
  const double largest = W[0] + W[4] + W[8];
  for (std::size_t row = 0; row < 3; ++row)
    if (std::abs(dot(W + 3 * row, m.heading)) > kHeadingTolerance * largest) return "information_per_rad2";
  return nullptr;
}
template <>
const char* find_inconsistency(const needle_state_t& m) {
  double squared = 0.0;
  for (const double q : m.orientation_wxyz) squared += q * q;
  if (std::abs(squared - 1.0) > 1e-3) return "orientation_wxyz";
  return could_be_state_covariance(m.covariance) ? nullptr : "covariance";
}
template <>
const char* find_inconsistency(const needle_shaft_t& m) {
  if (!(m.bending_mm > 0.0)) return "bending_mm";
  if (!(m.bending_sd_mm >= 0.0)) return "bending_sd_mm";
  return m.guide_mm >= 0.0 ? nullptr : "guide_mm";
}
template <>
const char* find_inconsistency(const steering_target_t& m) {
  return m.tolerance_mm >= 0.0 ? nullptr : "tolerance_mm";
}
// A run that did not draw a session cannot be distinguished from another one.
template <>
const char* find_inconsistency(const operator_heartbeat_t& m) {
  return m.session > 0 ? nullptr : "session";
}

}  // namespace

const char* name_of(DecodeFault fault) {
  switch (fault) {
    case DecodeFault::size:
      return "size";
    case DecodeFault::fingerprint:
      return "fingerprint";
    case DecodeFault::text:
      return "text";
    case DecodeFault::not_finite:
      return "not finite";
    case DecodeFault::out_of_range:
      return "out of range";
    case DecodeFault::inconsistent:
      return "inconsistent";
    case DecodeFault::time:
      return "time";
  }
  return "unknown";
}

std::string describe(const DecodeError& error) {
  return std::string(name_of(error.fault)) + (*error.field == '\0' ? "" : std::string(": ") + error.field);
}

template <class Message>
std::optional<DecodeError> check_fields(const Message& message) noexcept {
  FieldCheck check;
  visit_fields(message, check);
  if (check.error()) return check.error();
  if (const char* field = find_inconsistency(message)) return DecodeError{DecodeFault::inconsistent, field};
  return std::nullopt;
}

template <class Message>
Decoded<Message> checked_decode(const void* data, std::size_t size) noexcept {
  Decoded<Message> decoded;
  constexpr bool has_text = std::is_same_v<Message, process_status_t>;
  const bool size_possible = has_text ? size >= fixed_size<Message>() : size == fixed_size<Message>();
  if (data == nullptr || !size_possible) {
    decoded.error = DecodeError{DecodeFault::size, ""};
    return decoded;
  }
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  if (read_big_endian(bytes, kFingerprintSize) != static_cast<std::uint64_t>(Message::getHash())) {
    decoded.error = DecodeError{DecodeFault::fingerprint, ""};
    return decoded;
  }
  if constexpr (has_text) {
    TextWalk walk(bytes, size);
    visit_fields(std::as_const(decoded.message), walk);
    decoded.error = walk.finish();
    if (decoded.error) return decoded;
  }
  // Size and lengths are proven; the generated decoder cannot fail or allocate beyond the message any more.
  if (decoded.message.decode(data, 0, static_cast<int>(size)) != static_cast<int>(size)) {
    decoded.error = DecodeError{DecodeFault::size, ""};
  } else {
    decoded.error = check_fields(decoded.message);
  }
  if (decoded.error) decoded.message = Message{};
  return decoded;
}

template Decoded<tip_measurement_t> checked_decode(const void*, std::size_t) noexcept;
template Decoded<tip_heading_t> checked_decode(const void*, std::size_t) noexcept;
template Decoded<actuator_state_t> checked_decode(const void*, std::size_t) noexcept;
template Decoded<motion_command_t> checked_decode(const void*, std::size_t) noexcept;
template Decoded<needle_state_t> checked_decode(const void*, std::size_t) noexcept;
template Decoded<needle_shaft_t> checked_decode(const void*, std::size_t) noexcept;
template Decoded<steering_target_t> checked_decode(const void*, std::size_t) noexcept;
template Decoded<operator_heartbeat_t> checked_decode(const void*, std::size_t) noexcept;
template Decoded<process_status_t> checked_decode(const void*, std::size_t) noexcept;
template std::optional<DecodeError> check_fields(const tip_measurement_t&) noexcept;
template std::optional<DecodeError> check_fields(const tip_heading_t&) noexcept;
template std::optional<DecodeError> check_fields(const actuator_state_t&) noexcept;
template std::optional<DecodeError> check_fields(const motion_command_t&) noexcept;
template std::optional<DecodeError> check_fields(const needle_state_t&) noexcept;
template std::optional<DecodeError> check_fields(const needle_shaft_t&) noexcept;
template std::optional<DecodeError> check_fields(const steering_target_t&) noexcept;
template std::optional<DecodeError> check_fields(const operator_heartbeat_t&) noexcept;
template std::optional<DecodeError> check_fields(const process_status_t&) noexcept;

}  // namespace bevel::io
