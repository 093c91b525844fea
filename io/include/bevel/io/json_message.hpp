// SPDX-License-Identifier: MIT
/// \file
/// Messages as flat JSON objects with the columns of bevel/io/csv_columns.hpp as names, in the order of the columns.
///
/// Numbers have as many digits as are needed to read the same number back. JSON has no NaN: a value that was not seen
/// is absent, and the schema does not require it. `null`, which older files contain, is read too. A number that a
/// message holds along an axis without information has a name with the prefix `unseen_`, so that the message is
/// restored completely; +0 is not written.
#pragma once

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <bevel/error.hpp>
#include <bevel/io/csv_columns.hpp>

namespace bevel::io {

/// One field of a JSON object.
struct JsonColumn {
  /// Types of fields.
  enum class Kind : std::uint8_t {
    whole,   ///< integer
    number,  ///< double
    seen     ///< double that may be absent
  };
  std::string name;         ///< name of the field
  Kind kind = Kind::whole;  ///< type of the field
  std::string key,          ///< text before the value: `{"utime":` or `,"seq":`
      unseen_key;           ///< text before the value of a field that was not seen: `,"unseen_x_mm":`
};

/// Fields of a message type. It is a visitor of visit_columns().
class JsonLayout {
 public:
  /// Returns the layout of a message type.
  /// @tparam Message  LCM type
  /// @param numbers_arrivals  true: the last field is the position in the order of arrival
  /// @return fields in the order of the columns
  template <class Message>
  static JsonLayout of(bool numbers_arrivals) {
    JsonLayout layout;
    const Message message{};
    visit_columns(message, layout);
    if (numbers_arrivals) layout.whole(exported::kArrival, 0);
    layout.numbers_arrivals_ = numbers_arrivals;
    return layout;
  }
  /// Returns the fields in their order.
  /// @return one entry for each column
  const std::vector<JsonColumn>& columns() const { return columns_; }
  /// Returns whether the last field is the position in the order of arrival.
  /// @return true if of() was called with numbers_arrivals
  bool numbers_arrivals() const { return numbers_arrivals_; }
  /// Returns the largest number of bytes of a message as JSON.
  /// @return upper bound in bytes
  std::size_t largest_size() const { return largest_size_; }
  /// Returns the JSON Schema. Each field has one type: Foxglove does not read schemas in which a field has two, such as
  /// ["number", "null"].
  /// @return text of the schema
  std::string schema() const;

  /// Adds an integer field.
  /// @param name  name of the field
  template <class Integer>
  void whole(const char* name, Integer) {
    add(name, JsonColumn::Kind::whole);
  }
  /// Adds a double field.
  /// @param name  name of the field
  void number(const char* name, double) { add(name, JsonColumn::Kind::number); }
  /// Adds a double field that may be absent.
  /// @param name  name of the field
  template <class IsSeen>
  void seen(const char* name, double, IsSeen&&) {
    add(name, JsonColumn::Kind::seen);
  }

 private:
  void add(const char* name, JsonColumn::Kind kind);
  std::vector<JsonColumn> columns_;
  bool numbers_arrivals_ = false;
  std::size_t largest_size_ = 2;
};

/// Formats one message. It is a visitor of visit_columns().
class JsonWriter {
 public:
  /// Starts an object.
  /// @param layout  fields of the message; must outlive the writer
  /// @param to  output with JsonLayout::largest_size() bytes
  JsonWriter(const JsonLayout& layout, char* to) : column_(layout.columns().data()), at_(to) {}
  /// Writes the next field, an integer.
  /// @param value  value of the field
  template <class Integer>
  void whole(const char*, Integer value) {
    key(column_++->key);
    at_ = std::to_chars(at_, at_ + kLongestNumber, value).ptr;
  }
  /// Writes the next field, a double.
  /// @param value  value of the field
  /// @throws ParseError if the value is not finite
  void number(const char*, double value) {
    key(column_++->key);
    digits(value);
  }
  /// Writes the next field, a double that may be absent.
  /// @param value  value of the field
  /// @param is_seen  returns false if the value was not seen; it is then written with the prefix unless it is +0
  /// @throws ParseError if the value is not finite
  template <class IsSeen>
  void seen(const char*, double value, IsSeen&& is_seen) {
    const JsonColumn& column = *column_++;
    const bool seen = is_seen();
    if (!seen && std::bit_cast<std::uint64_t>(value) == 0) return;
    key(seen ? column.key : column.unseen_key);
    digits(value);
  }
  /// Ends the object.
  /// @return end of the output
  char* end() {
    *at_++ = '}';
    return at_;
  }

  static constexpr std::size_t kLongestNumber = 24;  ///< characters of the longest number: -2.2250738585072014e-308

 private:
  void key(const std::string& text) {
    std::memcpy(at_, text.data(), text.size());
    at_ += text.size();
  }
  void digits(double value) {
    if (!std::isfinite(value)) throw ParseError("a number that is not finite, which JSON has not");
    at_ = std::to_chars(at_, at_ + kLongestNumber, value).ptr;
    // A parser that reads "-0" as an integer loses the sign.
    if (value == 0 && std::signbit(value)) *at_++ = '.', *at_++ = '0';
  }
  const JsonColumn* column_;
  char* at_;
};

/// Parses one message in the exact form that JsonWriter writes. It is a visitor of visit_columns(). is_whole() returns
/// false for all other texts, which may be valid JSON.
class JsonReader {
 public:
  /// Starts at the first field.
  /// @param layout  fields of the message; must outlive the reader
  /// @param json  text of the object; must outlive the reader
  JsonReader(const JsonLayout& layout, std::string_view json)
      : column_(layout.columns().data()), at_(json.data()), end_(json.data() + json.size()) {}
  /// Reads the next field.
  /// @param[out] value  value of the field; unchanged after a fault
  template <class Number>
  void whole(const char*, Number& value) {
    take(column_++->key) ? digits(value) : fail();
  }
  /// Reads the next field, a double.
  /// @param[out] value  value of the field; unchanged after a fault
  void number(const char*, double& value) { whole("", value); }
  /// Reads the next field, a double that may be absent.
  /// @param[in,out] value  value of the field; unchanged if the field is absent or null
  template <class IsSeen>
  void seen(const char*, double& value, IsSeen&&) {
    const JsonColumn& column = *column_++;
    if (take(column.key) || take(column.unseen_key)) take("null") ? void() : digits(value);
  }
  /// Reads the position in the order of arrival.
  /// @param[out] value  position, from 0
  /// @return false if the field is absent
  bool arrival(std::int64_t& value) {
    if (!take(column_->key)) return false;
    digits(value);
    return true;
  }
  /// Reads the end of the object.
  /// @return true if all required fields and nothing else have been read
  bool is_whole() { return take("}") && at_ == end_ && is_whole_; }

 private:
  bool take(std::string_view text) {
    if (static_cast<std::size_t>(end_ - at_) < text.size() || std::memcmp(at_, text.data(), text.size()) != 0)
      return false;
    at_ += text.size();
    return true;
  }
  template <class Number>
  void digits(Number& value) {
    const auto [end, error] = std::from_chars(at_, end_, value);
    if (error != std::errc()) return fail();
    at_ = end;
  }
  void fail() { is_whole_ = false, at_ = end_; }
  const JsonColumn* column_;
  const char* at_;
  const char* end_;
  bool is_whole_ = true;
};

}  // namespace bevel::io
