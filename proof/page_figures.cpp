// SPDX-License-Identifier: MIT
#include "proof/page_figures.hpp"

#include <algorithm>
#include <set>

#include <bevel/report/drawing.hpp>
#include <bevel/report/numbers.hpp>
#include "proof/tally.hpp"

namespace bevel::proof {

using report::Drawing;
namespace ink = report::ink;
using Anchor = report::Lettering::Anchor;

namespace {

// "none" first, "unknown" and what was named in addition last, the rest by the alphabet.
std::vector<std::string> in_order(const std::set<std::string>& names) {
  std::vector<std::string> ordered(names.begin(), names.end());
  const auto rank = [](const std::string& name) {
    return name == "none" ? 0 : name == "unknown" ? 2 : name == kBeyond ? 3 : 1;
  };
  std::ranges::stable_sort(ordered, {}, rank);
  return ordered;
}

}  // namespace

std::string share_figure(const std::vector<ShareLine>& lines) {
  constexpr double kLeft = 265, kWide = 290, kRow = 30;
  const double bottom = 14 + kRow * static_cast<double>(lines.size());
  const auto place = [&](double share) { return kLeft + kWide * share; };
  Drawing drawing(700, bottom + 30);
  for (int percent = 0; percent <= 100; percent += 20) {
    const double x = place(percent / 100.0);
    drawing.line({x, 8}, {x, bottom}, {.colour = ink::kGrid});
    drawing.text({x, bottom + 18}, std::to_string(percent) + " %",
                 {.anchor = Anchor::middle, .size = 11, .colour = ink::kSoft});
  }
  double y = 14 + 0.5 * kRow;
  for (const ShareLine& entry : lines) {
    drawing.text({kLeft - 12, y + 4}, entry.label, {.anchor = Anchor::end, .size = 13});
    std::string counts = "no trials";
    if (entry.share.of > 0) {
      const Interval interval = wilson95(entry.share);
      counts = report::fixed(100 * entry.share.value(), 1) + " %  (" + std::to_string(entry.share.hits) + " of " +
               std::to_string(entry.share.of) + ")";
      drawing.line({place(interval.low), y}, {place(interval.high), y}, {.colour = ink::kBlue, .width = 2});
      if (entry.goal >= 0)
        drawing.line({place(entry.goal), y - 9}, {place(entry.goal), y + 9}, {.colour = ink::kRed, .width = 2});
      drawing.mark({place(entry.share.value()), y}, 5, ink::kBlue, entry.label + ": " + counts);
    }
    drawing.text({kLeft + kWide + 16, y + 4}, counts, {.colour = entry.share.of > 0 ? ink::kText : ink::kSoft});
    y += kRow;
  }
  return drawing.svg();
}

std::string confusion_figure(const std::map<std::string, std::map<std::string, int>>& confusion) {
  std::set<std::string> row_names, column_names;
  for (const auto& [truth, verdicts] : confusion) {
    row_names.insert(truth);
    if (truth != kBeyond) column_names.insert(truth);
    for (const auto& [verdict, count] : verdicts) column_names.insert(verdict);
  }
  const auto rows = in_order(row_names), columns = in_order(column_names);
  const double cell = std::min(30.0, 560.0 / static_cast<double>(std::max<std::size_t>(columns.size(), 1)));
  constexpr double kLeft = 135, kTop = 128;
  const double right = kLeft + cell * static_cast<double>(columns.size());
  const double bottom = kTop + cell * static_cast<double>(rows.size());
  Drawing drawing(std::max(right + 90, 420.0), bottom + 10);
  drawing.text({8, kTop - 8}, "concealed \u2193   named \u2192", {.size = 11, .colour = ink::kSoft});
  for (std::size_t j = 0; j < columns.size(); ++j)
    drawing.text({kLeft + cell * (static_cast<double>(j) + 0.5) + 4, kTop - 7}, columns[j],
                 {.size = 11, .turned_deg = -55});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double y = kTop + cell * static_cast<double>(i);
    drawing.text({kLeft - 6, y + 0.5 * cell + 4}, rows[i], {.anchor = Anchor::end, .size = 11});
    const auto& of_row = confusion.at(rows[i]);
    int total = 0;
    for (const auto& [verdict, count] : of_row) total += count;
    for (std::size_t j = 0; j < columns.size(); ++j) {
      const report::Box box{kLeft + cell * static_cast<double>(j) + 0.5, y + 0.5, cell - 1, cell - 1};
      const auto found = of_row.find(columns[j]);
      const int count = found == of_row.end() ? 0 : found->second;
      const bool right_answer = rows[i] == columns[j];
      const double depth = total > 0 ? static_cast<double>(count) / total : 0.0;
      if (count == 0) {
        drawing.rectangle(box, ink::kGrid, right_answer ? 0.8 : 0.3);
        continue;
      }
      drawing.rectangle(
          box, right_answer ? ink::kBlue : ink::kRed, 0.25 + 0.75 * depth,
          rows[i] + ", named " + columns[j] + ": " + std::to_string(count) + " of " + std::to_string(total));
      drawing.text({box.left + 0.5 * cell, y + 0.5 * cell + 4}, std::to_string(count),
                   {.anchor = Anchor::middle, .size = 11, .colour = depth > 0.4 ? ink::kGround : ink::kText});
    }
  }
  return drawing.svg();
}

}  // namespace bevel::proof
