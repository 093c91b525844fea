// SPDX-License-Identifier: MIT
// TOML configuration read into typed structures.
//
// One function per structure lists its keys, and that list is the only place where a key's presence and range stand:
//
//   ConfigFile file = ConfigFile::load("model.toml");
//   Section needle = file.section("needle", required);
//   needle.read("wheelbase_mm", parameters.wheelbase_mm, required, in_range(1.0, 500.0));
//   needle.read("slip", parameters.slip, optional, Choices<SlipDirection>{{"isotropic", SlipDirection::isotropic},
//   ...}); file.finish();  // throws ConfigError with every fault found: missing, mistyped, out of range, unknown
//
// An optional key that is absent leaves the variable as it is: the structure's own initialiser is the default.
// After a fault a variable keeps its value, so reading goes on and all faults are reported together.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <bevel/error.hpp>

namespace bevel::io {

// what() is all messages, one a line; each begins with "file:line: " and the full dotted key.
class ConfigError : public ConfigurationError {
 public:
  explicit ConfigError(std::vector<std::string> messages);
  const std::vector<std::string>& messages() const { return messages_; }

 private:
  std::vector<std::string> messages_;
};

enum class Presence { required, optional };
inline constexpr Presence required = Presence::required;
inline constexpr Presence optional = Presence::optional;

// Allowed values, ends included unless open. NaN and infinities are never allowed, whatever the range.
struct Range {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
  bool lowest_open = false;
  bool highest_open = false;
  const char* reason = nullptr;  // static text: what a value outside would break

  bool contains(double value) const;
  std::string describe() const;         // "from 0 to 5", "above 0", "at least 1", "any finite number"; then the reason
  std::string describe_limits() const;  // without the reason
  constexpr Range because(const char* why) const {
    Range range = *this;
    range.reason = why;
    return range;
  }
};
constexpr Range in_range(double lowest, double highest) { return {lowest, highest}; }
constexpr Range at_least(double lowest) { return {lowest, std::numeric_limits<double>::infinity()}; }
constexpr Range above(double lowest) { return {lowest, std::numeric_limits<double>::infinity(), true}; }
constexpr Range any_finite() { return {}; }

template <class Enum>
using Choices = std::vector<std::pair<std::string, Enum>>;

struct ConfigContents;

// One table of a file. A handle: copyable, valid as long as its ConfigFile (which may be moved).
class Section {
 public:
  bool present() const { return table_ != nullptr; }
  bool has(std::string_view key) const;
  const std::string& path() const { return path_; }  // dotted, "" for the whole file
  int line() const;

  void read(std::string_view key, double& value, Presence presence, Range range = {});
  void read(std::string_view key, std::int64_t& value, Presence presence, Range range = {});
  void read(std::string_view key, int& value, Presence presence, Range range = {});
  void read(std::string_view key, bool& value, Presence presence);
  void read(std::string_view key, std::string& value, Presence presence);
  // Every element in range; the number of elements within `size`.
  void read(std::string_view key, std::vector<double>& values, Presence presence, Range range = {}, Range size = {});
  void read(std::string_view key, std::vector<std::string>& values, Presence presence, Range size = {});

  template <std::size_t N>
  void read(std::string_view key, std::array<double, N>& values, Presence presence, Range range = {}) {
    std::vector<double> read_values(values.begin(), values.end());
    read(key, read_values, presence, range, in_range(N, N));
    for (std::size_t i = 0; i < N; ++i) values.at(i) = read_values.at(i);
  }

  template <class Enum>
  void read(std::string_view key, Enum& value, Presence presence, const Choices<Enum>& choices) {
    std::vector<std::string> names;
    for (const auto& choice : choices) names.push_back(choice.first);
    const int index = read_choice(key, presence, names);
    if (index >= 0) value = choices[static_cast<std::size_t>(index)].second;
  }

  // Every key not read so far, which must be a finite number: for tables whose keys something else decides.
  std::map<std::string, double> read_remaining_numbers();

  Section section(std::string_view key, Presence presence);
  std::vector<Section> sections(std::string_view key, Presence presence);  // an array of tables, [[key]]
  std::vector<Section> children();                                         // every sub-table, in the file's order

  // The fault is reported by finish() with file, line and full key; `key` may be empty for the section itself.
  void fail(std::string_view key, const std::string& message);
  // As fail(), naming the allowed name nearest to `given`.
  void fail_unknown(std::string_view key, std::string_view what, const std::string& given,
                    const std::vector<std::string>& allowed);

 private:
  friend class ConfigFile;
  Section(ConfigContents* file, const void* table, std::string path);
  const void* find(std::string_view key, Presence presence);
  int read_choice(std::string_view key, Presence presence, const std::vector<std::string>& names);
  void fail_type(std::string_view key, const void* node, std::string_view wanted);
  std::string dotted(std::string_view key) const;

  ConfigContents* file_;
  const void* table_;  // toml::table, or null for an absent optional section
  std::string path_;
};

class ConfigFile {
 public:
  // Throws ConfigError if the file cannot be read or is not TOML.
  static ConfigFile load(const std::string& path);
  static ConfigFile parse(std::string_view text, const std::string& name);
  ConfigFile(ConfigFile&&) noexcept;
  ConfigFile& operator=(ConfigFile&&) = delete;
  ~ConfigFile();

  Section root();
  Section section(std::string_view key, Presence presence) { return root().section(key, presence); }
  std::vector<Section> sections(std::string_view key, Presence presence) { return root().sections(key, presence); }
  const std::string& name() const;
  const std::string& text() const;  // as read, for the CONFIG channel

  // Refuses every key that nobody asked for, then throws ConfigError if there was any fault.
  void finish();

 private:
  explicit ConfigFile(std::unique_ptr<ConfigContents> contents);
  std::unique_ptr<ConfigContents> contents_;
};

// Letters put in, left out, changed, or swapped with a neighbour, from the one to the other.
std::size_t edit_distance(std::string_view given, std::string_view candidate);
// Nearest of `candidates` by that; empty if there are none.
std::string nearest_name(std::string_view given, const std::vector<std::string>& candidates);

// Shortest text that reads back as the same number.
std::string format_number(double value);

}  // namespace bevel::io
