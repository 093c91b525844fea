// SPDX-License-Identifier: MIT
#include <bevel/report/numbers.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace bevel::report {

std::string fixed(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  char text[400];  // the largest double has 309 digits before the point
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  // "-0.00" says nothing that "0.00" does not.
  if (text[0] == '-' && std::string_view(text).find_first_not_of("-0.") == std::string_view::npos) return text + 1;
  return text;
}

int decimals_for(double size, int digits) {
  if (!(std::abs(size) > 0)) return 0;
  const auto above = [&](double of) { return static_cast<int>(std::floor(std::log10(std::abs(of)) + 1e-9)); };
  const double unit = std::pow(10.0, above(size) - digits + 1);
  const double rounded = std::round(size / unit) * unit;  // 0.9998 is 1.00, not 1.000
  return std::clamp(digits - 1 - above(rounded), 0, 9);
}

std::string number(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  if (value == 0) return "0";
  std::string text = fixed(value, decimals_for(value, digits));
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.ends_with('.')) text.pop_back();
  }
  return text;
}

std::string measured(double value, int digits) {
  return std::isfinite(value) ? fixed(value, decimals_for(value, digits)) : "-";
}

std::string in_deviations(double difference, double sd) {
  if (!(sd > 0) || !std::isfinite(difference / sd)) return "-";
  const std::string text = fixed(difference / sd, 1);
  return text.starts_with('-') ? text : "+" + text;
}

std::string format_significant(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*g", digits, value);
  return buffer;
}

}  // namespace bevel::report
