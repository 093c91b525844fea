#include "proof/page_figures.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>

#include "io/html_report.hpp"

namespace bevel::proof {
namespace {

constexpr const char* kInk = "#222";
constexpr const char* kSoft = "#777";
constexpr const char* kBlue = "#1f6fb2";
constexpr const char* kRed = "#b23a2e";

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

std::string text_at(double x, double y, const std::string& anchor, const std::string& colour, double size,
                    const std::string& text, const std::string& more = "") {
  return "<text x='" + number(x) + "' y='" + number(y) + "' text-anchor='" + anchor + "' fill='" + colour +
         "' font-size='" + number(size) + "'" + more + ">" + io::escape_html(text) + "</text>\n";
}

std::string line(double x1, double y1, double x2, double y2, const std::string& colour, double width) {
  return "<line x1='" + number(x1) + "' y1='" + number(y1) + "' x2='" + number(x2) + "' y2='" + number(y2) +
         "' stroke='" + colour + "' stroke-width='" + number(width) + "'/>\n";
}

std::string open_svg(double width, double height) {
  return "<svg viewBox='0 0 " + number(width) + " " + number(height) +
         "' xmlns='http://www.w3.org/2000/svg' font-family='Helvetica,Arial,sans-serif'>\n";
}

// "none" first, "unknown" last, the rest by the alphabet.
std::vector<std::string> in_order(const std::set<std::string>& names) {
  std::vector<std::string> ordered(names.begin(), names.end());
  const auto rank = [](const std::string& name) { return name == "none" ? 0 : name == "unknown" ? 2 : 1; };
  std::ranges::stable_sort(ordered, {}, rank);
  return ordered;
}

}  // namespace

std::string share_figure(const std::vector<ShareLine>& lines) {
  constexpr double kLeft = 265;
  constexpr double kWide = 290;
  constexpr double kRow = 30;
  const double bottom = 14 + kRow * static_cast<double>(lines.size());
  const auto place = [&](double share) { return kLeft + kWide * share; };
  std::string svg = open_svg(700, bottom + 30);
  for (int percent = 0; percent <= 100; percent += 20) {
    svg += line(place(percent / 100.0), 8, place(percent / 100.0), bottom, "#e4e4e4", 1);
    svg += text_at(place(percent / 100.0), bottom + 18, "middle", kSoft, 11, std::to_string(percent) + " %");
  }
  double y = 14 + 0.5 * kRow;
  for (const ShareLine& entry : lines) {
    svg += text_at(kLeft - 12, y + 4, "end", kInk, 13, entry.label);
    if (entry.share.of > 0) {
      const Interval interval = wilson95(entry.share);
      svg += line(place(interval.low), y, place(interval.high), y, kBlue, 2);
      if (entry.goal >= 0) svg += line(place(entry.goal), y - 9, place(entry.goal), y + 9, kRed, 2);
      svg += "<circle cx='" + number(place(entry.share.value())) + "' cy='" + number(y) + "' r='5' fill='" + kBlue +
             "'/>\n";
    }
    const std::string counts = entry.share.of > 0
                                   ? number(100 * entry.share.value()) + " %  (" + std::to_string(entry.share.hits) +
                                         " of " + std::to_string(entry.share.of) + ")"
                                   : "no trials";
    svg += text_at(kLeft + kWide + 16, y + 4, "start", entry.share.of > 0 ? kInk : kSoft, 12, counts);
    y += kRow;
  }
  return svg + "</svg>";
}

std::string confusion_figure(const std::map<std::string, std::map<std::string, int>>& confusion) {
  std::set<std::string> row_names;
  std::set<std::string> column_names;
  for (const auto& [truth, verdicts] : confusion) {
    row_names.insert(truth);
    column_names.insert(truth);
    for (const auto& [verdict, count] : verdicts) column_names.insert(verdict);
  }
  const auto rows = in_order(row_names);
  const auto columns = in_order(column_names);
  const double cell = std::min(30.0, 560.0 / static_cast<double>(std::max<std::size_t>(columns.size(), 1)));
  constexpr double kLeft = 135;
  constexpr double kTop = 128;
  const double right = kLeft + cell * static_cast<double>(columns.size());
  const double bottom = kTop + cell * static_cast<double>(rows.size());
  std::string svg = open_svg(std::max(right + 90, 420.0), bottom + 10);
  svg += text_at(8, kTop - 8, "start", kSoft, 11, "concealed \u2193   named \u2192");
  for (std::size_t j = 0; j < columns.size(); ++j) {
    const double x = kLeft + cell * (static_cast<double>(j) + 0.5) + 4;
    svg += text_at(x, kTop - 7, "start", kInk, 11, columns[j],
                   " transform='rotate(-55 " + number(x) + " " + number(kTop - 7) + ")'");
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double y = kTop + cell * static_cast<double>(i);
    svg += text_at(kLeft - 6, y + 0.5 * cell + 4, "end", kInk, 11, rows[i]);
    const auto& of_row = confusion.at(rows[i]);
    int total = 0;
    for (const auto& [verdict, count] : of_row) total += count;
    for (std::size_t j = 0; j < columns.size(); ++j) {
      const double x = kLeft + cell * static_cast<double>(j);
      const auto found = of_row.find(columns[j]);
      const int count = found == of_row.end() ? 0 : found->second;
      const bool right_answer = rows[i] == columns[j];
      const double depth = total > 0 ? static_cast<double>(count) / total : 0.0;
      std::string fill = right_answer ? "#f0f4f8" : "#fafafa";
      if (count > 0) fill = right_answer ? kBlue : kRed;
      svg += "<rect x='" + number(x) + "' y='" + number(y) + "' width='" + number(cell) + "' height='" + number(cell) +
             "' fill='" + fill + "' fill-opacity='" + number(count > 0 ? 0.25 + 0.75 * depth : 1.0) +
             "' stroke='#fff'/>\n";
      if (count > 0)
        svg += text_at(x + 0.5 * cell, y + 0.5 * cell + 4, "middle", depth > 0.4 ? "#fff" : kInk, 11,
                       std::to_string(count));
    }
  }
  return svg + "</svg>";
}

}  // namespace bevel::proof
