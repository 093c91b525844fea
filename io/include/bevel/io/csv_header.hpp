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
/// @param text  text of a cell or a line
/// @return view into \p text
std::string_view trimmed_cell(std::string_view text);

/// Iterates over the lines of a text. A line ends with LF, CR LF or a CR alone; a file may mix them.
class CsvLines {
 public:
  /// Starts at the first line.
  /// @param text  must outlive the iterator
  explicit CsvLines(std::string_view text) : text_(text) {}
  /// Reads the next line.
  /// @param[out] line  view into the text, without the line end
  /// @return false after the last line
  bool next(std::string_view& line);
  /// Returns the number of the last line that next() returned, from 1.
  /// @return 0 before the first line
  int number() const { return number_; }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  int number_ = 0;
};

/// Separator value for columns that are aligned with blanks: any number of blanks and tabs separates two cells.
inline constexpr char kBlanks = ' ';

/// Splits a line into cells without their quotes.
/// @param line  one line of the file
/// @param separator  character between cells, or kBlanks
/// @return nothing if a quote is opened and not closed
std::optional<std::vector<std::string>> split_cells(std::string_view line, char separator);

/// Returns whether a line is a comment.
/// @param line  one line of the file
/// @return true if it starts with # or %
bool is_comment(std::string_view line);

/// Header of a CSV file.
struct CsvHeader {
  std::vector<std::string> names;  ///< names of the columns
  char separator = ',';            ///< character between cells, or kBlanks
  bool is_commented = false;       ///< the header is behind # or %
  bool is_numbers = false;         ///< most names are numbers, and no other line can be the header
  int line = 0;                    ///< number of the header's line, from 1
};

/// Finds the header and leaves \p lines after it.
///
/// The first line whose cells are mostly numbers is the first row. The header is the first line above it that has as
/// many cells. If there is no other line above the row than comments, the header is the one comment with as many cells,
/// as numpy.savetxt writes it. A first line `sep=X` sets the separator, as in Excel. Without it the separator is the
/// first of tab, semicolon, pipe, comma and blanks that splits the first row into numbers.
/// @param path  name of the file for error messages
/// @param[in,out] lines  lines of the file, at its beginning; after the call at the first row
/// @return names, separator and line of the header
/// @throws ParseError with the file and the line: no line, an unknown `sep=`, two comments with as many cells
CsvHeader find_header(const std::string& path, CsvLines& lines);

}  // namespace bevel::io
