// SPDX-License-Identifier: MIT
/// \file
/// Reads a CSV file row by row, as spreadsheets and scripts write it.
///
/// Cells are separated by comma, semicolon, pipe, tab or blanks. Numbers have a point or a comma. Quotes and a byte
/// order mark are optional. Lines end with LF, CR LF or CR. csv_header.hpp describes which line is the header. Comments
/// (# or
/// %) and empty lines are skipped, but a comment below the header with as many cells as a row is read as a row.
///
/// A comma is a decimal mark if it does not separate cells. A file with both decimal marks is rejected, since one of
/// them may mark thousands. All errors contain file, line and column.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bevel/io/csv_header.hpp>

namespace bevel::io {

/// Rows of one CSV file.
class CsvTable {
 public:
  /// Reads the file and its header.
  /// @param path  a regular file of at most kLargestText_bytes, UTF-8
  /// @throws ParseError if it has no header or is UTF-16
  /// @throws IoError if it cannot be read
  explicit CsvTable(const std::string& path);
  CsvTable(const CsvTable&) = delete;  // lines_ refers to text_
  CsvTable& operator=(const CsvTable&) = delete;

  /// Sets the texts of cells that mean the same as an empty cell: no measurement.
  /// @param unseen  texts as they are in the file: "nan", "-9999"
  void set_unseen(std::vector<std::string> unseen) { unseen_ = std::move(unseen); }
  /// Reads the next row.
  /// @return false after the last row
  /// @throws ParseError for a row with more or fewer cells than the header, or with a quote that is not closed
  bool next();

  /// Returns whether the header names a column.
  /// @param column  name of the column
  /// @return true also if the header names it twice
  bool has(const std::string& column) const { return index_.contains(column); }
  /// Returns the text of a cell of the row.
  /// @param column  name of the column
  /// @return "" if the cell is empty
  /// @throws ParseError with the nearest name if the column does not exist; or if the header names it twice
  const std::string& text(const std::string& column) const;
  /// Returns the number in a cell of the row.
  /// @param column  name of the column
  /// @return a finite number; nothing for a cell that is empty or means the same
  /// @throws ParseError as text(), and if the cell is not a finite number or has another decimal mark than those above
  std::optional<double> number(const std::string& column);
  /// Returns the integer in a cell of the row.
  /// @param column  name of the column
  /// @return nothing for an empty cell
  /// @throws ParseError as text(), and if the cell is not an integer of 64 bits
  std::optional<std::int64_t> integer(const std::string& column) const;

  /// Reports a cell of the row.
  /// @param column  name of the column
  /// @param why  end of the sentence "column 'x' is '1', ..."
  /// @throws ParseError with the file, the line and the cell
  [[noreturn]] void fail(const std::string& column, const std::string& why) const;
  /// Returns the start of an error message, "path:line: ".
  /// @param line  number of a line, from 1
  /// @return path and line
  std::string place(int line) const { return path_ + ":" + std::to_string(line) + ": "; }
  /// Returns the path of the file.
  /// @return argument of the constructor
  const std::string& path() const { return path_; }
  /// Returns the number of the row's line, from 1.
  /// @return line number in the file
  int line() const { return lines_.number(); }
  /// Describes the format that was detected: "';' between cells, decimal comma".
  /// @return text without a line end
  std::string format() const;

 private:
  std::string path_, text_;
  CsvLines lines_;
  CsvHeader header_;
  char mark_ = 0;  // decimal mark; 0 until a number with one is read
  std::vector<std::string> unseen_;
  std::map<std::string, std::size_t> index_;
  std::vector<std::string> cells_;
};

}  // namespace bevel::io
