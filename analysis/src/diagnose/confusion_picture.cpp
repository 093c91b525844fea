// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/pictures.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)
using namespace bevel::report;     // NOLINT(google-build-using-namespace)

namespace {

constexpr double kNames = 172;
constexpr double kLeaning = 78;  // how far the last column's name leans to the right
constexpr double kWorthANumber = 0.5;

// The least absorbed of an effect's parameters: that by which it can be seen. NaN if nothing is known of it.
double absorbed_share(const Findings& findings, const std::string& name) {
  double least = std::numeric_limits<double>::quiet_NaN();
  for (const auto& d : findings.detectable)
    if (is_kind_of(name, d.effect, d.parameter) && !(d.absorbed >= least)) least = d.absorbed;
  return least;
}

void draw_cell(Drawing& drawing, const Box& cell, double value, const std::string& hint) {
  if (!std::isfinite(value)) {
    drawing.text({cell.left + cell.width / 2, cell.top + cell.height / 2 + 4}, "-",
                 {.anchor = Lettering::Anchor::middle, .colour = ink::kFaint});
    return;
  }
  const double share = std::clamp(value, 0.0, 1.0);
  drawing.rectangle({cell.left + 0.5, cell.top + 0.5, cell.width - 1, cell.height - 1}, kAfterInk,
                    0.04 + 0.96 * share * share, hint);
  if (value < kWorthANumber) return;
  const int hundredths = static_cast<int>(std::lround(100 * value));  // ".97": the zero would not fit
  const std::string text = hundredths >= 100 ? "1" : "." + std::to_string(hundredths);
  drawing.text({cell.left + cell.width / 2, cell.top + cell.height / 2 + 4}, text,
               {.anchor = Lettering::Anchor::middle, .size = 10, .colour = value > 0.65 ? ink::kGround : ink::kText});
}

}  // namespace

// Upper triangle, names along the diagonal's rows and above the columns; in front, what the needle absorbs.
std::string confusion_picture(const Findings& findings) {
  const auto count = static_cast<Eigen::Index>(findings.confusion_names.size());
  if (count < 2 || findings.confusion.rows() != count || findings.confusion.cols() != count) return "";
  const double left = kNames + 50;
  const double cell = std::min((832 - left - kLeaning) / static_cast<double>(count), 34.0);
  const double height = std::min(cell, 24.0);
  const double top = 142;
  Drawing drawing(832, top + height * static_cast<double>(count) + 12);
  drawing.text({kNames + 24, top - 8}, "absorbed", {.size = 11, .colour = ink::kSoft, .turned_deg = -50});
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::string& name = findings.confusion_names[static_cast<std::size_t>(i)];
    const bool found = std::any_of(findings.effects.begin(), findings.effects.end(),
                                   [&](const auto& e) { return is_kind_of(name, e); });
    const double y = top + static_cast<double>(i) * height;
    drawing.text({kNames - 8, y + height / 2 + 4}, name, {.anchor = Lettering::Anchor::end, .bold = found});
    if (const double share = absorbed_share(findings, name); std::isfinite(share))
      draw_cell(drawing, {kNames, y, 38, height}, share,
                name + ": " + percent(share) + " absorbed by k, lambda1, lambda2");
    if (i > 0)
      drawing.text({left + (static_cast<double>(i) + 0.5) * cell, top - 8}, name,
                   {.size = 11, .bold = found, .turned_deg = -50});
    for (Eigen::Index j = i + 1; j < count; ++j)
      draw_cell(drawing, {left + static_cast<double>(j) * cell, y, cell, height}, findings.confusion(i, j),
                name + " and " + findings.confusion_names[static_cast<std::size_t>(j)] + ": " +
                    number(findings.confusion(i, j), 2));
  }
  return drawing.svg();
}

}  // namespace bevel::analysis
