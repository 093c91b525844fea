#include "io/config.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "io/file_bytes.hpp"

namespace bevel::io {

struct ConfigContents {
  std::string name;
  std::string text;
  toml::table root;
  std::map<std::string, std::set<std::string>> known;  // section path -> keys asked for
  std::vector<std::pair<std::string, const toml::table*>> visited;
  std::vector<std::pair<int, std::string>> faults;  // line, text

  void add_fault(int line, const std::string& text_of_fault) {
    const std::string where = line > 0 ? name + ":" + std::to_string(line) : name;
    faults.emplace_back(line, where + ": " + text_of_fault);
  }
  void refuse_unknown_keys();
};

namespace {

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

const toml::node& as_node(const void* node) { return *static_cast<const toml::node*>(node); }

std::string type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::string:
      return "text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    case toml::node_type::array:
      return node.is_array_of_tables() ? "an array of tables" : "an array";
    case toml::node_type::table:
      return "a table";
    default:
      return "a date or time";
  }
}

// The value as the user wrote it, as far as it fits into a message.
std::string value_text(const toml::node& node) {
  if (const auto number = node.value_exact<double>()) return format_number(*number);
  std::ostringstream out;
  node.visit([&out](const auto& value) {
    // Streaming a table pretty-prints it over many lines, which helps nobody.
    if constexpr (toml::is_table<decltype(value)>) {
      out << "{...}";
    } else {
      out << value;
    }
  });
  std::string text = out.str();
  std::replace(text.begin(), text.end(), '\n', ' ');
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace

ConfigError::ConfigError(std::vector<std::string> messages)
    : std::runtime_error([&messages] {
        std::string all;
        for (const auto& message : messages) all += (all.empty() ? "" : "\n") + message;
        return all;
      }()),
      messages_(std::move(messages)) {}

void ConfigContents::refuse_unknown_keys() {
  for (const auto& [path, table] : visited) {
    const auto& asked_for = known[path];
    const std::vector<std::string> candidates(asked_for.begin(), asked_for.end());
    for (const auto& [key, node] : *table) {
      const std::string given(key.str());
      if (asked_for.count(given) != 0) continue;
      const std::string prefix = path.empty() ? "" : path + ".";
      const std::string nearest = nearest_name(given, candidates);
      add_fault(line_of(node),
                "unknown key " + prefix + given +
                    (nearest.empty() ? "; no key is known here" : "; the nearest known key is " + prefix + nearest));
    }
  }
}

Section::Section(ConfigContents* file, const void* table, std::string path)
    : file_(file), table_(table), path_(std::move(path)) {
  if (table_ != nullptr) file_->visited.emplace_back(path_, as_node(table_).as_table());
}

int Section::line() const { return table_ == nullptr ? 0 : line_of(as_node(table_)); }

std::string Section::dotted(std::string_view key) const {
  if (path_.empty()) return std::string(key);
  return key.empty() ? path_ : path_ + "." + std::string(key);
}

bool Section::has(std::string_view key) const {
  return table_ != nullptr && as_node(table_).as_table()->get(key) != nullptr;
}

const void* Section::find(std::string_view key, Presence presence) {
  if (table_ == nullptr) return nullptr;
  file_->known[path_].emplace(key);
  const toml::node* node = as_node(table_).as_table()->get(key);
  if (node == nullptr && presence == required) file_->add_fault(line(), dotted(key) + " is missing and is required");
  return node;
}

void Section::fail(std::string_view key, const std::string& message) {
  const toml::node* node = has(key) ? as_node(table_).as_table()->get(key) : nullptr;
  const std::string name = dotted(key);
  file_->add_fault(node == nullptr ? line() : line_of(*node), (name.empty() ? "" : name + ": ") + message);
}

void Section::fail_unknown(std::string_view key, std::string_view what, const std::string& given,
                           const std::vector<std::string>& allowed) {
  fail(key, "unknown " + std::string(what) + " \"" + given + "\"; the nearest known is \"" +
                nearest_name(given, allowed) + "\" (known: " + join(allowed) + ")");
}

void Section::fail_type(std::string_view key, const void* node, std::string_view wanted) {
  file_->add_fault(line_of(as_node(node)), dotted(key) + " = " + value_text(as_node(node)) + " is " +
                                               type_name(as_node(node)) + "; " + std::string(wanted) + " is wanted");
}

void Section::read(std::string_view key, double& value, Presence presence, Range range) {
  const void* node = find(key, presence);
  if (node == nullptr) return;
  const auto number = as_node(node).is_number() ? as_node(node).value<double>() : std::nullopt;
  if (!number) return fail_type(key, node, "a number");
  if (!range.contains(*number)) {
    file_->add_fault(line_of(as_node(node)),
                     dotted(key) + " = " + format_number(*number) + " is not allowed; allowed: " + range.describe());
    return;
  }
  value = *number;
}

void Section::read(std::string_view key, std::int64_t& value, Presence presence, Range range) {
  const void* node = find(key, presence);
  if (node == nullptr) return;
  const auto number = as_node(node).value_exact<std::int64_t>();
  if (!number) return fail_type(key, node, "a whole number");
  if (!range.contains(static_cast<double>(*number))) {
    file_->add_fault(line_of(as_node(node)),
                     dotted(key) + " = " + std::to_string(*number) + " is not allowed; allowed: " + range.describe());
    return;
  }
  value = *number;
}

void Section::read(std::string_view key, int& value, Presence presence, Range range) {
  range.lowest = std::max<double>(range.lowest, std::numeric_limits<int>::min());
  range.highest = std::min<double>(range.highest, std::numeric_limits<int>::max());
  std::int64_t wide = value;
  read(key, wide, presence, range);
  value = static_cast<int>(wide);
}

void Section::read(std::string_view key, bool& value, Presence presence) {
  const void* node = find(key, presence);
  if (node == nullptr) return;
  const auto truth = as_node(node).value_exact<bool>();
  if (!truth) return fail_type(key, node, "true or false");
  value = *truth;
}

void Section::read(std::string_view key, std::string& value, Presence presence) {
  const void* node = find(key, presence);
  if (node == nullptr) return;
  auto text = as_node(node).value_exact<std::string>();
  if (!text) return fail_type(key, node, "text");
  value = std::move(*text);
}

void Section::read(std::string_view key, std::vector<double>& values, Presence presence, Range range, Range size) {
  const void* node = find(key, presence);
  if (node == nullptr) return;
  const toml::array* array = as_node(node).as_array();
  if (array == nullptr) return fail_type(key, node, "an array of numbers");
  std::vector<double> read_values;
  for (const auto& element : *array) {
    const auto number = element.is_number() ? element.value<double>() : std::nullopt;
    if (!number) return fail_type(key, node, "an array of numbers");
    if (!range.contains(*number)) {
      return fail(key, "element " + std::to_string(read_values.size()) + " = " + format_number(*number) +
                           " is not allowed; allowed: " + range.describe());
    }
    read_values.push_back(*number);
  }
  if (!size.contains(static_cast<double>(read_values.size()))) {
    return fail(key, "has " + std::to_string(read_values.size()) + " elements; allowed: " + size.describe());
  }
  values = std::move(read_values);
}

void Section::read(std::string_view key, std::vector<std::string>& values, Presence presence, Range size) {
  const void* node = find(key, presence);
  if (node == nullptr) return;
  const toml::array* array = as_node(node).as_array();
  if (array == nullptr) return fail_type(key, node, "an array of texts");
  std::vector<std::string> read_values;
  for (const auto& element : *array) {
    auto text = element.value_exact<std::string>();
    if (!text) return fail_type(key, node, "an array of texts");
    read_values.push_back(std::move(*text));
  }
  if (!size.contains(static_cast<double>(read_values.size()))) {
    return fail(key, "has " + std::to_string(read_values.size()) + " elements; allowed: " + size.describe());
  }
  values = std::move(read_values);
}

int Section::read_choice(std::string_view key, Presence presence, const std::vector<std::string>& names) {
  const void* node = find(key, presence);
  if (node == nullptr) return -1;
  const auto text = as_node(node).value_exact<std::string>();
  if (!text) {
    fail_type(key, node, "one of " + join(names));
    return -1;
  }
  const auto match = std::find(names.begin(), names.end(), *text);
  if (match == names.end()) {
    file_->add_fault(line_of(as_node(node)), dotted(key) + " = \"" + *text + "\" is not allowed; allowed: " +
                                                 join(names) + "; the nearest is " + nearest_name(*text, names));
    return -1;
  }
  return static_cast<int>(match - names.begin());
}

std::map<std::string, double> Section::read_remaining_numbers() {
  std::map<std::string, double> numbers;
  if (table_ == nullptr) return numbers;
  std::vector<std::string> remaining;
  for (const auto& [key, node] : *as_node(table_).as_table()) {
    if (file_->known[path_].count(std::string(key.str())) == 0) remaining.emplace_back(key.str());
  }
  for (const auto& key : remaining) {
    double value = std::numeric_limits<double>::quiet_NaN();
    read(key, value, required);
    if (std::isfinite(value)) numbers[key] = value;
  }
  return numbers;
}

Section Section::section(std::string_view key, Presence presence) {
  const void* node = table_ == nullptr ? nullptr : find(key, optional);
  if (node == nullptr && table_ != nullptr && presence == required) {
    file_->add_fault(line(), "section [" + dotted(key) + "] is missing and is required");
  }
  if (node != nullptr && !as_node(node).is_table()) {
    fail_type(key, node, "a section [" + dotted(key) + "]");
    node = nullptr;
  }
  return {file_, node, dotted(key)};
}

std::vector<Section> Section::sections(std::string_view key, Presence presence) {
  std::vector<Section> tables;
  const void* node = table_ == nullptr ? nullptr : find(key, optional);
  if (node == nullptr) {
    if (table_ != nullptr && presence == required) {
      file_->add_fault(line(), "at least one section [[" + dotted(key) + "]] is required");
    }
    return tables;
  }
  if (!as_node(node).is_array_of_tables()) {
    fail_type(key, node, "an array of tables [[" + dotted(key) + "]]");
    return tables;
  }
  for (const auto& element : *as_node(node).as_array()) {
    // Each table has its own path, since what is known in one (by its name, say) may be unknown in the next.
    tables.push_back(
        {file_, static_cast<const void*>(&element), dotted(key) + "[" + std::to_string(tables.size()) + "]"});
  }
  return tables;
}

std::vector<Section> Section::children() {
  std::vector<Section> tables;
  if (table_ == nullptr) return tables;
  for (const auto& [key, node] : *as_node(table_).as_table()) {
    if (node.is_table()) tables.push_back(section(key.str(), optional));
  }
  std::stable_sort(tables.begin(), tables.end(),
                   [](const Section& a, const Section& b) { return a.line() < b.line(); });
  return tables;
}

ConfigFile::ConfigFile(std::unique_ptr<ConfigContents> contents) : contents_(std::move(contents)) {}
ConfigFile::ConfigFile(ConfigFile&&) noexcept = default;
ConfigFile::~ConfigFile() = default;

ConfigFile ConfigFile::load(const std::string& path) {
  std::string text;
  try {
    text = read_text_file(path);
  } catch (const std::runtime_error& unreadable) {
    throw ConfigError({unreadable.what()});
  }
  return parse(text, path);
}

ConfigFile ConfigFile::parse(std::string_view text, const std::string& name) {
  auto contents = std::make_unique<ConfigContents>();
  contents->name = name;
  contents->text = text;
  try {
    contents->root = toml::parse(contents->text, name);
  } catch (const toml::parse_error& error) {
    throw ConfigError(
        {name + ":" + std::to_string(error.source().begin.line) + ": not TOML: " + std::string(error.description())});
  }
  return ConfigFile(std::move(contents));
}

Section ConfigFile::root() { return {contents_.get(), static_cast<const toml::node*>(&contents_->root), ""}; }
const std::string& ConfigFile::name() const { return contents_->name; }
const std::string& ConfigFile::text() const { return contents_->text; }

void ConfigFile::finish() {
  std::set<const toml::table*> seen;
  auto& visited = contents_->visited;
  visited.erase(std::remove_if(visited.begin(), visited.end(),
                               [&seen](const auto& entry) { return !seen.insert(entry.second).second; }),
                visited.end());
  root();  // keys at the top count even where nothing was read from it
  if (seen.count(&contents_->root) != 0) visited.pop_back();
  contents_->refuse_unknown_keys();
  if (contents_->faults.empty()) return;
  std::stable_sort(contents_->faults.begin(), contents_->faults.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> messages;
  for (auto& fault : contents_->faults) messages.push_back(std::move(fault.second));
  throw ConfigError(std::move(messages));
}

}  // namespace bevel::io
