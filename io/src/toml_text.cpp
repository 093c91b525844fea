// SPDX-License-Identifier: MIT
#include "toml_text.hpp"

#include <bevel/io/config.hpp>

namespace bevel::io {

std::string toml_number(double value) {
  const std::string text = format_number(value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string toml_array(const std::vector<double>& values) {
  std::string text = "[";
  for (const double value : values) text += (text.size() > 1 ? ", " : "") + toml_number(value);
  return text + "]";
}

std::string toml_text(std::string_view plain) {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string text = "\"";
  for (const char c : plain) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      text += '\\';
      text += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      text += "\\u00";
      text += kHex[byte >> 4U];
      text += kHex[byte & 15U];
    } else {
      text += c;
    }
  }
  return text + '"';
}

}  // namespace bevel::io
