// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Lines and cells of a CSV file, and the search for its header: the line that names the columns.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bevel::io {

/// Removes blanks, tabs and carriage returns at both ends.
std::string_view trimmed_cell(std::string_view text);

/// Iterates over the lines of a text. A line ends with LF, CR LF or a CR alone; a file may mix them.
class CsvLines {
 public:
  explicit CsvLines(std::string_view text) : text_(text) {}
  /// Returns false after the last line.
  bool next(std::string_view& line);
  int number() const { return number_; }  ///< of the last line that next() returned, from 1

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  int number_ = 0;
};

/// Separator value for columns that are aligned with blanks: any number of blanks and tabs separates two cells.
inline constexpr char kBlanks = ' ';

/// Splits a line into cells without their quotes.
/// @return nothing if a quote is opened and not closed
std::optional<std::vector<std::string>> split_cells(std::string_view line, char separator);

/// Returns true for a line that starts with # or %.
bool is_comment(std::string_view line);

struct CsvHeader {
  std::vector<std::string> names;
  char separator = ',';
  bool is_commented = false;  ///< the header is behind # or %
  bool is_numbers = false;    ///< most names are numbers, and no other line can be the header
  int line = 0;               ///< from 1
};

/// Finds the header and leaves \p lines after it.
///
/// The first line whose cells are mostly numbers is the first row. The header is the first line above it that has as
/// many cells. If there is no other line above the row than comments, the header is the one comment with as many cells,
/// as numpy.savetxt writes it. A first line `sep=X` sets the separator, as in Excel. Without it the separator is the
/// first of tab, semicolon, pipe, comma and blanks that splits the first row into numbers.
/// @throws ParseError naming the file and the line: no line, an unknown `sep=`, two comments with as many cells
CsvHeader find_header(const std::string& path, CsvLines& lines);

}  // namespace bevel::io
