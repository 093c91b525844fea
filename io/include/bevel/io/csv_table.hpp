// SPDX-License-Identifier: MIT
// One CSV file, read row by row, as spreadsheets and scripts write them: separated by comma, semicolon, pipe, tab or
// blanks, numbers with a point or a comma, with or without quotes and a byte order mark, lines ended by LF, CR LF or
// CR. csv_header.hpp describes which line is the header. Comments (# or %) and empty lines are skipped, but a comment
// below the header with as many cells as a row is read as a row. Every error names file, line and column.
//
// A comma is a decimal mark where it does not separate cells; a file that uses both marks is refused, since one of them
// may mark thousands.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bevel/io/csv_header.hpp>

namespace bevel::io {

class CsvTable {
 public:
  // Reads the file whole, and its header. Throws ParseError as all of these do.
  explicit CsvTable(const std::string& path);
  CsvTable(const CsvTable&) = delete;  // lines_ refers to text_
  CsvTable& operator=(const CsvTable&) = delete;

  // Cells that mean what an empty one does: nothing was seen. As they stand in the file: "nan", "-9999".
  void set_unseen(std::vector<std::string> unseen) { unseen_ = std::move(unseen); }
  // False after the last row. A row with more or fewer cells than the header is refused.
  bool next();

  bool has(const std::string& column) const { return index_.contains(column); }
  // "" if it is empty. Throws, naming the nearest column, for one that the file does not have or has twice.
  const std::string& text(const std::string& column) const;
  // Nothing for an empty cell. Never NaN or infinite: these are refused.
  std::optional<double> number(const std::string& column);
  std::optional<std::int64_t> integer(const std::string& column) const;

  [[noreturn]] void fail(const std::string& column, const std::string& why) const;
  std::string place(int line) const { return path_ + ":" + std::to_string(line) + ": "; }
  const std::string& path() const { return path_; }
  int line() const { return lines_.number(); }  // of the row, from 1
  std::string format() const;                   // "cells between ';', decimal comma"

 private:
  std::string path_, text_;
  CsvLines lines_;
  CsvHeader header_;
  char mark_ = 0;  // of decimals; 0 until one was seen
  std::vector<std::string> unseen_;
  std::map<std::string, std::size_t> index_;
  std::vector<std::string> cells_;
};

}  // namespace bevel::io
