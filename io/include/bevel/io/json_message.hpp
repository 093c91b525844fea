// SPDX-License-Identifier: MIT
// A message as a JSON object with the columns of bevel/io/csv_columns.hpp for names, flat, and in their order. Numbers
// have as many digits as it takes to read the same one back. JSON has no NaN: what was not seen is not there, and the
// schema does not require it (`null`, as files of before have it, is read too). A number that a message holds along an
// axis without information has the name unseen_..., so that the message is restored completely; +0 is not written.
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

struct JsonColumn {
  enum class Kind : std::uint8_t { whole, number, seen };
  std::string name;
  Kind kind = Kind::whole;
  std::string key, unseen_key;  // as they stand before the value: {"utime": or ,"seq":
};

class JsonLayout {
 public:
  // `numbers_arrivals`: a last field has the number of arrival.
  template <class Message>
  static JsonLayout of(bool numbers_arrivals) {
    JsonLayout layout;
    const Message message{};
    visit_columns(message, layout);
    if (numbers_arrivals) layout.whole(exported::kArrival, 0);
    layout.numbers_arrivals_ = numbers_arrivals;
    return layout;
  }
  const std::vector<JsonColumn>& columns() const { return columns_; }
  bool numbers_arrivals() const { return numbers_arrivals_; }
  std::size_t largest_size() const { return largest_size_; }
  // With one type a field: Foxglove reads no schema in which a field has two, ["number", "null"] for instance.
  std::string schema() const;

  // For visit_columns.
  template <class Integer>
  void whole(const char* name, Integer) {
    add(name, JsonColumn::Kind::whole);
  }
  void number(const char* name, double) { add(name, JsonColumn::Kind::number); }
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

// Appends one message, for visit_columns. `to` has room for the layout's largest_size().
class JsonWriter {
 public:
  JsonWriter(const JsonLayout& layout, char* to) : column_(layout.columns().data()), at_(to) {}
  template <class Integer>
  void whole(const char*, Integer value) {
    key(column_++->key);
    at_ = std::to_chars(at_, at_ + kLongestNumber, value).ptr;
  }
  void number(const char*, double value) {
    key(column_++->key);
    digits(value);
  }
  template <class IsSeen>
  void seen(const char*, double value, IsSeen&& is_seen) {
    const JsonColumn& column = *column_++;
    const bool seen = is_seen();
    if (!seen && std::bit_cast<std::uint64_t>(value) == 0) return;
    key(seen ? column.key : column.unseen_key);
    digits(value);
  }
  char* end() {
    *at_++ = '}';
    return at_;
  }

  static constexpr std::size_t kLongestNumber = 24;  // -2.2250738585072014e-308

 private:
  void key(const std::string& text) {
    std::memcpy(at_, text.data(), text.size());
    at_ += text.size();
  }
  void digits(double value) {
    if (!std::isfinite(value)) throw ParseError("a number that is not finite, which JSON has not");
    at_ = std::to_chars(at_, at_ + kLongestNumber, value).ptr;
    // Whoever takes "-0" for a whole number loses its sign.
    if (value == 0 && std::signbit(value)) *at_++ = '.', *at_++ = '0';
  }
  const JsonColumn* column_;
  char* at_;
};

// Takes one message that stands as JsonWriter writes it, for visit_columns; is_whole() is false for any other, which
// may still be good JSON.
class JsonReader {
 public:
  JsonReader(const JsonLayout& layout, std::string_view json)
      : column_(layout.columns().data()), at_(json.data()), end_(json.data() + json.size()) {}
  template <class Number>
  void whole(const char*, Number& value) {
    take(column_++->key) ? digits(value) : fail();
  }
  void number(const char*, double& value) { whole("", value); }
  template <class IsSeen>
  void seen(const char*, double& value, IsSeen&&) {
    const JsonColumn& column = *column_++;
    if (take(column.key) || take(column.unseen_key)) take("null") ? void() : digits(value);
  }
  // The last field, if it is there.
  bool arrival(std::int64_t& value) {
    if (!take(column_->key)) return false;
    digits(value);
    return true;
  }
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
