// SPDX-License-Identifier: MIT
#include <bevel/io/csv_header.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>

#include <bevel/error.hpp>

namespace bevel::io {
namespace {

using Cells = std::vector<std::string>;

constexpr std::string_view kSeparators = "\t;|,";
constexpr std::string_view kCandidates = "\t;|, ";  // with kBlanks

struct Line {
  std::string_view text;
  int number;
};

bool is_number(std::string cell) {
  std::ranges::replace(cell, ',', '.');
  const char* begin = cell.data() + (cell.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(begin, cell.data() + cell.size(), value);
  return begin != end && error == std::errc{} && end == cell.data() + cell.size();
}

bool is_mostly_numbers(const Cells& cells) {
  const auto numbers = std::ranges::count_if(cells, is_number);
  const auto empty = std::ranges::count(cells, "");
  return 2 * numbers > static_cast<std::ptrdiff_t>(cells.size()) - empty;
}

std::optional<char> separator_of_row(std::string_view line, std::string_view candidates) {
  for (const char separator : candidates) {
    const auto cells = split_cells(line, separator);
    if (cells && (cells->size() > 1 || candidates.size() == 1) && is_mostly_numbers(*cells)) return separator;
  }
  const auto alone = split_cells(line, ',');
  if (candidates.size() > 1 && alone && alone->size() == 1 && is_mostly_numbers(*alone)) return ',';
  return std::nullopt;
}

char separator_of_names(std::string_view header) {
  for (const char separator : kSeparators)
    if (const auto cells = split_cells(header, separator); cells && cells->size() > 1) return separator;
  return ',';
}

// `surplus`: the row has empty cells behind its last column.
bool names_columns_of(const Cells& names, const Cells& row, bool surplus) {
  return !is_mostly_numbers(names) && (surplus ? names.size() < row.size() : names.size() == row.size()) &&
         std::all_of(row.begin() + static_cast<std::ptrdiff_t>(names.size()), row.end(),
                     [](const std::string& cell) { return cell.empty(); });
}

std::optional<Cells> names_for(std::string_view line, const Cells& row, char separator, bool surplus) {
  std::string order{separator};
  // "# t, x" over columns that are aligned with blanks: blanks split every header, so they come last.
  if (row.size() > 1) order = (separator == kBlanks ? "" : order) + std::string(kCandidates);
  for (const char c : order)
    if (auto cells = split_cells(line, c); cells && names_columns_of(*cells, row, surplus)) return cells;
  return std::nullopt;
}

std::string_view without_mark(std::string_view comment) {
  comment = trimmed_cell(comment);
  const auto at = comment.find_first_not_of("#%");
  // Only blanks: a tab is the separator behind an empty first name.
  const auto text = at == std::string_view::npos ? std::string_view{} : comment.substr(at);
  return text.substr(std::min(text.find_first_not_of(' '), text.size()));
}

// The separator of a line "sep=;", nothing for any other line.
std::optional<char> separator_hint(const std::string& path, std::string_view line) {
  while (line.ends_with('\r')) line.remove_suffix(1);
  std::string text(line);
  std::erase(text, '"');
  std::string key = text.substr(0, 4);
  std::ranges::transform(key, key.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (key != "sep=") return std::nullopt;
  const std::string value = text.substr(4);
  if (value.empty() || kSeparators.find(value[0]) == std::string_view::npos ||
      value.find_first_not_of(value[0]) != std::string::npos)
    throw ParseError(path + ":1: the separator in '" + text +
                     "' is not known; allowed: sep= with a comma, semicolon, pipe or tab");
  return value[0];
}

}  // namespace

std::string_view trimmed_cell(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

bool CsvLines::next(std::string_view& line) {
  if (at_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
  line = text_.substr(at_, end - at_);
  at_ = end + (text_.substr(end).starts_with("\r\n") ? 2 : 1);
  ++number_;
  return true;
}

std::optional<std::vector<std::string>> split_cells(std::string_view line, char separator) {
  Cells cells;
  std::string cell;  // what stands in quotes, as it is
  std::size_t from = 0;
  bool quoted = false, had_quotes = false;
  if (separator == kBlanks) line = trimmed_cell(line);
  const auto end_cell = [&](std::size_t to) {
    cells.emplace_back(had_quotes ? trimmed_cell(cell) : trimmed_cell(line.substr(from, to - from)));
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
    } else if (!quoted && separator == kBlanks && (c == ' ' || c == '\t')) {
      if (i > from) end_cell(i);
      from = i + 1;
    } else if (c == separator && !quoted) {
      end_cell(i);
    } else {
      cell += c;
    }
  }
  if (quoted) return std::nullopt;
  end_cell(line.size());
  return cells;
}

bool is_comment(std::string_view line) {
  line = trimmed_cell(line);
  return line.starts_with('#') || line.starts_with('%');
}

CsvHeader find_header(const std::string& path, CsvLines& lines) {
  const CsvLines beginning = lines;
  const auto go_behind = [&](int line) {
    std::string_view skipped;
    for (lines = beginning; lines.number() < line;) lines.next(skipped);
  };
  std::string candidates(kCandidates);
  std::vector<Line> names, comments;
  std::optional<Cells> row;
  std::string_view text;
  while (lines.next(text)) {
    if (const auto hint = lines.number() == 1 ? separator_hint(path, text) : std::nullopt) {
      candidates = *hint;
      continue;
    }
    if (trimmed_cell(text).empty()) continue;
    const Line line{text, lines.number()};
    if (is_comment(text)) {
      comments.push_back(line);
      continue;
    }
    if (const auto separator = separator_of_row(text, candidates)) {
      if (candidates.size() > 1) candidates = *separator;
      row = split_cells(text, *separator);
      if (names.empty() && comments.empty()) names.push_back(line);
      break;
    }
    names.push_back(line);
  }

  CsvHeader out;
  if (row) {
    out.separator = candidates[0];
    for (const bool surplus : {false, true})
      for (const Line& line : names) {
        auto found = names_for(line.text, *row, out.separator, surplus);
        if (!found) continue;
        out.names = std::move(*found);
        out.line = line.number;
        go_behind(line.number);
        return out;
      }
    if (names.empty()) {
      for (const bool surplus : {false, true}) {
        for (const Line& line : comments) {
          auto found = names_for(without_mark(line.text), *row, out.separator, surplus);
          if (!found) continue;
          if (out.line != 0)
            throw ParseError(path + ":" + std::to_string(line.number) + ": this comment and that of line " +
                             std::to_string(out.line) + " both have " + std::to_string(row->size()) +
                             " cells, as the first row; remove the # of the one that names the columns");
          out.names = std::move(*found);
          if (out.names.front().empty()) out.names.front() = trimmed_cell(line.text).front();  // "#,x,y"
          out.line = line.number;
        }
        if (out.line == 0) continue;
        out.is_commented = true;
        go_behind(out.line);
        return out;
      }
      names.push_back({text, lines.number()});
    }
  }
  if (names.empty()) throw ParseError(path + (comments.empty() ? ": is empty" : ": has no line but comments"));
  // No line fits the rows: the first one is the header, and reading the rows reports what does not fit.
  const Line& first = names.front();
  out.separator = candidates.size() == 1 && row && candidates[0] != kBlanks ? candidates[0] : ',';
  if (!split_cells(first.text, out.separator) || split_cells(first.text, out.separator)->size() == 1)
    out.separator = separator_of_names(first.text);
  auto cells = split_cells(first.text, out.separator);
  if (!cells)
    throw ParseError(path + ":" + std::to_string(first.number) +
                     ": a quote (\") is opened and not closed in this line");
  out.names = std::move(*cells);
  out.is_numbers = is_mostly_numbers(out.names);
  out.line = first.number;
  go_behind(first.number);
  return out;
}

}  // namespace bevel::io
