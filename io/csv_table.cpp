#include "io/csv_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "io/config.hpp"
#include "io/file_bytes.hpp"

namespace bevel::io {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::size_t kNamesShown = 12;
constexpr std::size_t kTwice = std::string::npos;  // in place of a column's number

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

char separator_of(std::string_view header) {
  bool quoted = false, semicolon = false;
  for (const char c : header) {
    if (c == '"') quoted = !quoted;
    if (!quoted && c == '\t') return '\t';
    if (!quoted && c == ';') semicolon = true;
  }
  return semicolon ? ';' : ',';
}

}  // namespace

CsvTable::CsvTable(const std::string& path) : path_(path), text_(read_text_file(path)) {
  if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF"))
    throw std::runtime_error(path + ": is UTF-16; allowed: UTF-8, in a spreadsheet \"CSV UTF-8\"");
  if (text_.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
  std::string_view header;
  do {
    if (!next_line(header)) throw std::runtime_error(path + ": is empty");
  } while (trimmed(header).empty() || trimmed(header).starts_with('#'));
  separator_ = separator_of(header);
  names_ = split(header);
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (!index_.emplace(names_[i], i).second) index_[names_[i]] = kTwice;
}

bool CsvTable::next_line(std::string_view& line) {
  if (at_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  line = std::string_view(text_).substr(at_, end - at_);
  at_ = end + 1;
  ++line_;
  return true;
}

std::vector<std::string> CsvTable::split(std::string_view line) const {
  std::vector<std::string> cells;
  std::string cell;  // what stands in quotes, as it is
  std::size_t from = 0;
  bool quoted = false, had_quotes = false;
  const auto end_cell = [&](std::size_t to) {
    cells.push_back(had_quotes ? std::string(trimmed(cell)) : std::string(trimmed(line.substr(from, to - from))));
    cell.clear();
    had_quotes = false;
    from = to + 1;
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      cell += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
      had_quotes = true;
    } else if (c == separator_ && !quoted) {
      end_cell(i);
    } else {
      cell += c;
    }
  }
  if (quoted) throw std::runtime_error(place(line_) + "a quote (\") is opened and not closed in this line");
  end_cell(line.size());
  return cells;
}

bool CsvTable::next() {
  std::string_view line;
  while (next_line(line)) {
    if (trimmed(line).empty()) continue;
    cells_ = split(line);
    while (cells_.size() > names_.size() && cells_.back().empty()) cells_.pop_back();
    if (cells_.size() != names_.size())
      throw std::runtime_error(
          place(line_) + "has " + std::to_string(cells_.size()) + " cells, and the header names " +
          std::to_string(names_.size()) +
          (cells_.size() > names_.size() && separator_ == ',' ? "; decimal commas need another separator" : ""));
    return true;
  }
  return false;
}

const std::string& CsvTable::text(const std::string& column) const {
  const auto found = index_.find(column);
  if (found == index_.end()) {
    std::string all;
    for (std::size_t i = 0; i < std::min(names_.size(), kNamesShown); ++i)
      all += (i > 0 ? ", '" : "'") + names_[i] + "'";
    if (names_.size() > kNamesShown) all += ", ...";
    throw std::runtime_error(path_ + ": no column '" + column + "'; the nearest is '" + nearest_name(column, names_) +
                             "'; there are " + all);
  }
  if (found->second == kTwice)
    throw std::runtime_error(path_ + ": column '" + column + "' is there twice; which one is meant?");
  return cells_[found->second];
}

std::optional<double> CsvTable::number(const std::string& column) {
  std::string cell = text(column);
  if (cell.empty() || std::ranges::find(unseen_, cell) != unseen_.end()) return std::nullopt;
  const bool point = cell.find('.') != std::string::npos, comma = cell.find(',') != std::string::npos;
  if (comma && (point || separator_ == ','))
    fail(column,
         "in which the comma may mark thousands; allowed: no thousands marks, and a decimal comma only where "
         "another character separates the cells");
  if (point || comma) {
    const char mark = point ? '.' : ',';
    if (mark_ != 0 && mark_ != mark)
      fail(column, std::string("but numbers above have '") + mark_ + "' for a decimal mark; one of them in a file");
    mark_ = mark;
    std::ranges::replace(cell, ',', '.');
  }
  const char* begin = cell.data() + (cell.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(begin, cell.data() + cell.size(), value);
  if (error != std::errc{} || end != cell.data() + cell.size()) fail(column, "not a number");
  if (!std::isfinite(value))
    fail(column, "not a finite number; where nothing was seen the cell is empty, or its text stands in rows.unseen");
  return value;
}

std::optional<std::int64_t> CsvTable::integer(const std::string& column) const {
  const std::string& cell = text(column);
  if (cell.empty()) return std::nullopt;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc{} || end != cell.data() + cell.size()) fail(column, "not an integer of 64 bits");
  return value;
}

void CsvTable::fail(const std::string& column, const std::string& why) const {
  throw std::runtime_error(place(line_) + "column '" + column + "' is '" + text(column) + "', " + why);
}

std::string CsvTable::format() const {
  const std::string between = separator_ == '\t' ? "tabs" : std::string("'") + separator_ + "'";
  return between + " between cells" + (mark_ == ',' ? ", decimal comma" : "");
}

}  // namespace bevel::io
