// SPDX-License-Identifier: MIT
/// \file
/// Reads TOML configuration into typed structures.
///
/// One function per structure lists its keys. This list is the only place that defines the presence and the range of a
/// key:
///
/// \code
///   ConfigFile file = ConfigFile::load("model.toml");
///   Section needle = file.section("needle", required);
///   needle.read("wheelbase_mm", parameters.wheelbase_mm, required, in_range(1.0, 500.0));
///   needle.read("slip", parameters.slip, optional,
///               Choices<SlipDirection>{{"isotropic", SlipDirection::isotropic}, ...});
///   file.finish();  // throws ConfigError with every fault: missing, wrong type, out of range, unknown key
/// \endcode
///
/// An optional key that is absent leaves the variable unchanged: the initialiser of the structure is the default.
/// After a fault the variable keeps its value and reading continues, so that all faults are reported together.
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

/// All faults of a configuration file. what() contains one line for each fault; it starts with "file:line: " and the
/// dotted key.
class ConfigError : public ConfigurationError {
 public:
  /// Joins the messages to what().
  /// @param messages  one for each fault
  explicit ConfigError(std::vector<std::string> messages);
  /// Returns one message for each fault.
  /// @return lines of what()
  const std::vector<std::string>& messages() const { return messages_; }

 private:
  std::vector<std::string> messages_;
};

/// Whether a key must be present.
enum class Presence {
  required,  ///< absence is a fault
  optional   ///< absence leaves the variable unchanged
};
inline constexpr Presence required = Presence::required;  ///< short name of Presence::required
inline constexpr Presence optional = Presence::optional;  ///< short name of Presence::optional

/// Allowed values. The limits are included unless they are open. NaN and infinity are never allowed.
struct Range {
  double lowest = -std::numeric_limits<double>::infinity();  ///< lower limit, in the unit of the value
  double highest = std::numeric_limits<double>::infinity();  ///< upper limit, in the unit of the value
  bool lowest_open = false;                                  ///< true: the lower limit is excluded
  bool highest_open = false;                                 ///< true: the upper limit is excluded
  const char* reason = nullptr;                              ///< static text: consequence of a value outside the range

  /// Returns whether a value is allowed.
  /// @param value  in the unit of the limits
  /// @return false outside the limits and for NaN and infinity
  bool contains(double value) const;
  /// Describes limits and reason.
  /// @return "from 0 to 5", "above 0", "at least 1" or "any finite number" for instance, followed by the reason
  std::string describe() const;
  /// Describes the limits without the reason.
  /// @return "from 0 to 5" for instance
  std::string describe_limits() const;
  /// Returns a copy of the range with a reason.
  /// @param why  static text
  /// @return the same limits
  constexpr Range because(const char* why) const {
    Range range = *this;
    range.reason = why;
    return range;
  }
};
/// Returns a closed range.
/// @param lowest  lower limit
/// @param highest  upper limit
/// @return values from \p lowest to \p highest
constexpr Range in_range(double lowest, double highest) { return {lowest, highest}; }
/// Returns a range without an upper limit.
/// @param lowest  lower limit, included
/// @return values from \p lowest
constexpr Range at_least(double lowest) { return {lowest, std::numeric_limits<double>::infinity()}; }
/// Returns an open range without an upper limit.
/// @param lowest  lower limit, excluded
/// @return values above \p lowest
constexpr Range above(double lowest) { return {lowest, std::numeric_limits<double>::infinity(), true}; }
/// Returns a range without limits.
/// @return all finite numbers
constexpr Range any_finite() { return {}; }

/// Names of enumerators in configuration files.
/// @tparam Enum  enumeration, or a number for units ("mm" is 1, "cm" is 10)
template <class Enum>
using Choices = std::vector<std::pair<std::string, Enum>>;

struct ConfigContents;

/// Handle of one table of a file. It can be copied and is valid as long as its ConfigFile. The ConfigFile may be moved.
///
/// Faults are collected and reported by ConfigFile::finish(). An absent optional section has no keys, and no key of it
/// is required.
class Section {
 public:
  /// Returns whether the file contains the table.
  /// @return false for an absent optional table
  bool present() const { return table_ != nullptr; }
  /// Returns whether the table contains a key.
  /// @param key  name without dots
  /// @return false if the table is absent
  bool has(std::string_view key) const;
  /// Returns the dotted path of the table, "" for the root.
  /// @return "estimator.prior" for instance
  const std::string& path() const { return path_; }
  /// Returns the line of the table in the file, from 1; 0 if the table is absent.
  /// @return line number in the file
  int line() const;

  /// Reads a number.
  /// @param key  name without dots
  /// @param[in,out] value  unchanged if the key is absent or has a fault
  /// @param presence  whether the key is required
  /// @param range  allowed values
  void read(std::string_view key, double& value, Presence presence, Range range = {});
  /// Reads a whole number.
  /// @param key  name without dots
  /// @param[in,out] value  unchanged if the key is absent or has a fault
  /// @param presence  whether the key is required
  /// @param range  allowed values
  void read(std::string_view key, std::int64_t& value, Presence presence, Range range = {});
  /// Reads a whole number of the range of int.
  /// @param key  name without dots
  /// @param[in,out] value  unchanged if the key is absent or has a fault
  /// @param presence  whether the key is required
  /// @param range  allowed values
  void read(std::string_view key, int& value, Presence presence, Range range = {});
  /// Reads true or false.
  /// @param key  name without dots
  /// @param[in,out] value  unchanged if the key is absent or has a fault
  /// @param presence  whether the key is required
  void read(std::string_view key, bool& value, Presence presence);
  /// Reads text.
  /// @param key  name without dots
  /// @param[in,out] value  unchanged if the key is absent or has a fault
  /// @param presence  whether the key is required
  void read(std::string_view key, std::string& value, Presence presence);
  /// Reads an array of numbers.
  /// @param key  name without dots
  /// @param[in,out] values  unchanged if the key is absent or has a fault
  /// @param presence  whether the key is required
  /// @param range  allowed values of each element
  /// @param size  allowed number of elements
  void read(std::string_view key, std::vector<double>& values, Presence presence, Range range = {}, Range size = {});
  /// Reads an array of texts.
  /// @param key  name without dots
  /// @param[in,out] values  unchanged if the key is absent or has a fault
  /// @param presence  whether the key is required
  /// @param size  allowed number of elements
  void read(std::string_view key, std::vector<std::string>& values, Presence presence, Range size = {});

  /// Reads an array of exactly N numbers.
  /// @tparam N  number of elements
  /// @param key  name without dots
  /// @param[in,out] values  unchanged if the key is absent or has a fault
  /// @param presence  whether the key is required
  /// @param range  allowed values of each element
  template <std::size_t N>
  void read(std::string_view key, std::array<double, N>& values, Presence presence, Range range = {}) {
    std::vector<double> read_values(values.begin(), values.end());
    read(key, read_values, presence, range, in_range(N, N));
    for (std::size_t i = 0; i < N; ++i) values.at(i) = read_values.at(i);
  }

  /// Reads the name of an enumerator.
  /// @tparam Enum  type of the value
  /// @param key  name without dots
  /// @param[in,out] value  unchanged if the key is absent or has a fault
  /// @param presence  whether the key is required
  /// @param choices  allowed names and their values
  template <class Enum>
  void read(std::string_view key, Enum& value, Presence presence, const Choices<Enum>& choices) {
    std::vector<std::string> names;
    for (const auto& choice : choices) names.push_back(choice.first);
    const int index = read_choice(key, presence, names);
    if (index >= 0) value = choices[static_cast<std::size_t>(index)].second;
  }

  /// Reads all keys that have not been read, for tables whose keys are not known in advance. A value that is not a
  /// finite number is a fault.
  /// @return the values by key
  std::map<std::string, double> read_remaining_numbers();

  /// Returns a table of this table, [key].
  /// @param key  name without dots
  /// @param presence  whether the table is required
  /// @return an absent section if the file does not contain it
  Section section(std::string_view key, Presence presence);
  /// Returns an array of tables, [[key]].
  /// @param key  name without dots
  /// @param presence  required: at least one table
  /// @return the tables in the order of the file
  std::vector<Section> sections(std::string_view key, Presence presence);
  /// Returns all tables of this table in the order of the file.
  /// @return one section for each table; empty if this table is absent
  std::vector<Section> children();

  /// Records a fault, which ConfigFile::finish() reports with file, line and dotted key.
  /// @param key  name without dots; empty for the section itself
  /// @param message  value found, values allowed and remedy
  void fail(std::string_view key, const std::string& message);
  /// Records an unknown name. The message contains the allowed name that is nearest to it.
  /// @param key  name without dots
  /// @param what  kind of the name, "effect" for instance
  /// @param given  name in the file
  /// @param allowed  all allowed names
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

/// A TOML file that is being read.
class ConfigFile {
 public:
  /// Parses a file.
  /// @param path  TOML file of at most kLargestText_bytes
  /// @return the file; keys are not checked
  /// @throws ConfigError if the file cannot be read or is not TOML
  static ConfigFile load(const std::string& path);
  /// Parses text.
  /// @param text  TOML text
  /// @param name  file name for error messages
  /// @return the file; keys are not checked
  /// @throws ConfigError if the text is not TOML
  static ConfigFile parse(std::string_view text, const std::string& name);
  /// Moves the contents. Sections remain valid.
  ConfigFile(ConfigFile&&) noexcept;
  ConfigFile& operator=(ConfigFile&&) = delete;
  ~ConfigFile();

  /// Returns the table of the whole file.
  /// @return section with an empty path
  Section root();
  /// Returns a table of the root, as Section::section().
  /// @param key  name without dots
  /// @param presence  whether the table is required
  /// @return an absent section if the file does not contain it
  Section section(std::string_view key, Presence presence) { return root().section(key, presence); }
  /// Returns an array of tables of the root, as Section::sections().
  /// @param key  name without dots
  /// @param presence  required: at least one table
  /// @return the tables in the order of the file
  std::vector<Section> sections(std::string_view key, Presence presence) { return root().sections(key, presence); }
  /// Returns the path, or the name given to parse().
  /// @return file name for error messages
  const std::string& name() const;
  /// Returns the text as read, for the CONFIG channel.
  /// @return TOML text
  const std::string& text() const;

  /// Checks that all keys of the sections that were opened have been read, and reports all faults.
  /// @throws ConfigError with all faults in the order of their lines, if there is any
  void finish();

 private:
  explicit ConfigFile(std::unique_ptr<ConfigContents> contents);
  std::unique_ptr<ConfigContents> contents_;
};

/// Computes the optimal string alignment distance: the number of letters inserted, deleted, replaced or swapped with
/// their neighbour.
/// @param given  first name
/// @param candidate  second name
/// @return 0 for equal names
std::size_t edit_distance(std::string_view given, std::string_view candidate);
/// Finds the candidate with the smallest edit_distance().
/// @param given  name that was found
/// @param candidates  allowed names
/// @return the first of the nearest candidates; "" if there are none
std::string nearest_name(std::string_view given, const std::vector<std::string>& candidates);

/// Formats a number with as few digits as are needed to read the same number back.
/// @param value  any number
/// @return decimal text
std::string format_number(double value);

}  // namespace bevel::io
