// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/pictures.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)
using namespace bevel::report;     // NOLINT(google-build-using-namespace)

namespace {

constexpr std::size_t kInARow = 3;
constexpr double kRow = 20, kNameSize = 12.5;
constexpr double kAbove = 26, kBelow = 52;  // of one panel: its title; ticks and label

double sd_of(const Findings& findings, const std::string& group) {
  for (const auto& v : findings.variation)
    if (v.name == group) return v.sd;
  return 0;
}

// One quantity of all insertions, one below the other.
void draw_quantity(Drawing& drawing, const Box& box, const Findings& findings, std::size_t quantity, bool names) {
  const auto& insertions = findings.insertions;
  const InsertionValue& first = insertions.front().values[quantity];
  const bool relative = first.name.ends_with("_relative");
  const double scale = relative ? 100 : 1, band = scale * sd_of(findings, first.group);
  std::vector<double> ends{-band, band};
  for (const auto& one : insertions)
    for (const double end : one.values[quantity].ci95) ends.push_back(scale * end);
  const std::string name = first.name.substr(0, first.name.find("_relative"));
  Axis upward{0, 1, ""};
  upward.ruled = false;
  const Panel panel(drawing, box, axis_around(ends, relative ? in_words(name) + " (%)" : in_words(name)), upward);
  const auto x_of = [&](double value) { return panel.at(value, 0).x; };
  if (band > 0) drawing.rectangle({x_of(-band), box.top, x_of(band) - x_of(-band), box.height}, ink::kSpan, 0.55);
  drawing.line({x_of(0), box.top}, {x_of(0), box.bottom()}, {.colour = ink::kSoft, .width = 1, .dashes = "3,3"});
  for (std::size_t i = 0; i < insertions.size(); ++i) {
    const double y = box.top + (static_cast<double>(i) + 0.5) * kRow;
    const InsertionValue& v = insertions[i].values[quantity];
    drawing.line({x_of(scale * v.ci95[0]), y}, {x_of(scale * v.ci95[1]), y},
                 {.colour = kAfterInk, .width = 3, .opacity = 0.55});
    drawing.mark({x_of(scale * v.value), y}, 4, kAfterInk, insertions[i].log + ": " + number(scale * v.value));
    if (names)
      drawing.text({box.left - 10, y + 4}, insertions[i].log, {.anchor = Lettering::Anchor::end, .size = kNameSize});
  }
}

}  // namespace

std::string insertion_picture(const Findings& findings) {
  const auto& insertions = findings.insertions;
  if (insertions.empty() || insertions.front().values.empty()) return "";
  const std::size_t quantities = insertions.front().values.size();
  double names = 60;
  for (const auto& one : insertions) names = std::max(names, width_of(one.log, kNameSize) + 16);
  names = std::min(names, 240.0);
  const double height = kRow * static_cast<double>(insertions.size());
  const double width = (832 - names - 20) / kInARow;
  const std::size_t rows = (quantities + kInARow - 1) / kInARow;
  Drawing drawing(832, static_cast<double>(rows) * (kAbove + height + kBelow));
  for (std::size_t q = 0; q < quantities; ++q) {
    const std::size_t in_row = q % kInARow, of_rows = q / kInARow;
    const auto column = static_cast<double>(in_row), row = static_cast<double>(of_rows);
    draw_quantity(drawing, {names + column * width, kAbove + row * (kAbove + height + kBelow), width - 24, height},
                  findings, q, q % kInARow == 0);
  }
  draw_keys(drawing, {names, 12},
            {{kAfterInk, "its value, with 95 %"}, {ink::kSpan, "one standard deviation between insertions"}});
  return drawing.svg();
}

}  // namespace bevel::analysis
