// SPDX-License-Identifier: MIT
#include <bevel/io/csv_table.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>

#include <bevel/error.hpp>
#include <bevel/io/config.hpp>
#include <bevel/io/file_bytes.hpp>

namespace bevel::io {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::size_t kNamesShown = 12;
constexpr std::size_t kTwice = std::string::npos;  // in place of a column's number

}  // namespace

CsvTable::CsvTable(const std::string& path) : path_(path), text_(read_text_file(path)), lines_("") {
  if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF"))
    throw ParseError(path + ": is UTF-16; allowed: UTF-8, in a spreadsheet \"CSV UTF-8\"");
  lines_ = CsvLines(std::string_view(text_).substr(text_.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0));
  header_ = find_header(path, lines_);
  for (std::size_t i = 0; i < header_.names.size(); ++i)
    if (!index_.emplace(header_.names[i], i).second) index_[header_.names[i]] = kTwice;
}

bool CsvTable::next() {
  std::string_view line;
  const std::size_t columns = header_.names.size();
  while (lines_.next(line)) {
    if (trimmed_cell(line).empty()) continue;
    auto cells = split_cells(line, header_.separator);
    if (!cells) throw ParseError(place(lines_.number()) + "a quote (\") is opened and not closed in this line");
    cells_ = std::move(*cells);
    if (cells_.size() != columns && is_comment(line)) continue;
    while (cells_.size() > columns && cells_.back().empty()) cells_.pop_back();
    if (cells_.size() != columns)
      throw ParseError(
          place(lines_.number()) + "has " + std::to_string(cells_.size()) + " cells, and the header (line " +
          std::to_string(header_.line) + ") names " + std::to_string(columns) +
          (columns == 1 ? "; if line " + std::to_string(header_.line) + " is a note, put a # before it"
           : cells_.size() > columns && header_.separator == ',' ? "; decimal commas need another separator"
                                                                 : ""));
    return true;
  }
  return false;
}

const std::string& CsvTable::text(const std::string& column) const {
  const auto found = index_.find(column);
  if (found == index_.end()) {
    std::string all;
    for (std::size_t i = 0; i < std::min(header_.names.size(), kNamesShown); ++i)
      all += (i > 0 ? ", '" : "'") + header_.names[i] + "'";
    if (header_.names.size() > kNamesShown) all += ", ...";
    throw ParseError(path_ + ": no column '" + column + "'; the nearest is '" + nearest_name(column, header_.names) +
                     "'; there are " + all +
                     (header_.is_numbers ? "; line " + std::to_string(header_.line) +
                                               " holds numbers: put a line with the names of the columns before it"
                                         : ""));
  }
  if (found->second == kTwice)
    throw ParseError(path_ + ": column '" + column + "' is there twice; which one is meant?");
  return cells_[found->second];
}

std::optional<double> CsvTable::number(const std::string& column) {
  std::string cell = text(column);
  if (cell.empty() || std::ranges::find(unseen_, cell) != unseen_.end()) return std::nullopt;
  const bool point = cell.find('.') != std::string::npos, comma = cell.find(',') != std::string::npos;
  if (comma && (point || header_.separator == ','))
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
  throw ParseError(place(line()) + "column '" + column + "' is '" + text(column) + "', " + why);
}

std::string CsvTable::format() const {
  std::string between = std::string("'") + header_.separator + "'";
  if (header_.separator == '\t') between = "tabs";
  if (header_.separator == kBlanks) between = "blanks";
  return between + " between cells" + (mark_ == ',' ? ", decimal comma" : "") +
         (header_.is_commented ? ", header in the comment of line " + std::to_string(header_.line) : "");
}

}  // namespace bevel::io
