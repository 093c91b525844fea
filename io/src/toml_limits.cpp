// SPDX-License-Identifier: MIT
#include "toml_limits.hpp"

#include <algorithm>

namespace bevel::io {
namespace {

/// Position after the string that begins at \p at with a quote.
std::size_t after_string(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const bool has_escapes = quote == '"';
  const std::string_view three = quote == '"' ? "\"\"\"" : "'''";
  const bool is_multi_line = text.substr(at).starts_with(three);
  for (std::size_t i = at + (is_multi_line ? 3 : 1); i < text.size(); ++i) {
    if (text[i] == '\\' && has_escapes) {
      ++i;
    } else if (!is_multi_line) {
      if (text[i] == '\n') return i;  // not closed: the parser reports it
      if (text[i] == quote) return i + 1;
    } else if (text.substr(i).starts_with(three)) {
      i += 3;
      for (int more = 0; more < 2 && i < text.size() && text[i] == quote; ++more) ++i;  // quotes that end the text
      return i;
    }
  }
  return text.size();
}

}  // namespace

std::string toml_limit_exceeded(std::string_view text, const std::string& name) {
  if (text.size() > kLargestToml_bytes)
    return name + ": has " + std::to_string(text.size()) + " bytes; allowed at most " +
           std::to_string(kLargestToml_bytes) + "; is it another kind of file?";
  int line = 1, parts = 1, nesting = 0;
  // The longest key and the deepest nesting, for the message; the line is that of the first excess.
  int most_parts = 1, deepest = 0, line_of_key = 0, line_of_nesting = 0;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '"' || c == '\'') {
      const std::size_t end = after_string(text, i);
      line += static_cast<int>(std::count(text.begin() + static_cast<std::ptrdiff_t>(i),
                                          text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
      i = end;
      continue;
    }
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
      continue;
    }
    if (c == '.') {
      most_parts = std::max(most_parts, ++parts);
      if (parts > kLongestKey_parts && line_of_key == 0) line_of_key = line;
    } else if (c != ' ' && c != '\t' && std::string_view("=,[]{}\n").find(c) != std::string_view::npos) {
      parts = 1;
    }
    if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++nesting);
      if (nesting > kDeepestNesting && line_of_nesting == 0) line_of_nesting = line;
    } else if (c == ']' || c == '}') {
      nesting = std::max(nesting - 1, 0);
    }
    if (c == '\n') ++line;
    ++i;
  }
  if (line_of_key > 0)
    return name + ":" + std::to_string(line_of_key) + ": a key has " + std::to_string(most_parts) +
           " parts; allowed at most " + std::to_string(kLongestKey_parts) + "; correct or remove this key";
  if (line_of_nesting > 0)
    return name + ":" + std::to_string(line_of_nesting) + ": arrays or tables are nested " + std::to_string(deepest) +
           " deep; allowed at most " + std::to_string(kDeepestNesting) + "; correct or remove this value";
  return "";
}

}  // namespace bevel::io
