// Plots and the page. That they look right is for eyes; here: complete, escaped, self-contained.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <regex>
#include <set>

#include "io/html_report.hpp"

namespace bevel::io {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Plot example() {
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> low;
  std::vector<double> high;
  for (int i = 0; i <= 130; ++i) {
    x.push_back(i);
    y.push_back(-0.0022 * i * i + 0.4 * std::sin(0.3 * i));
    low.push_back(-0.0022 * i * i - 0.01 * i);
    high.push_back(-0.0022 * i * i + 0.01 * i);
  }
  Plot plot;
  plot.title = "Deflection, it's measured & \"modelled\" at <5 mm/s>";
  plot.x_label = "depth (mm)";
  plot.y_label = "deflection (mm)";
  plot.band("99 % band", x, low, high, 0).points("measured", x, y, 1).line("extended model", x, low, 0);
  plot.references.push_back({ReferenceLine::Axis::vertical, 60.0, "layer"});
  return plot;
}

TEST(Plot, becomes_inline_svg_with_unique_ids) {
  const std::string svg = render_svg(example());
  EXPECT_EQ(svg.rfind("<svg", 0), 0U);
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  EXPECT_THAT(svg, HasSubstr("deflection (mm)"));
  EXPECT_THAT(svg, ::testing::ContainsRegex("it(&apos;|&#39;|.)s"));
  EXPECT_THAT(svg, HasSubstr("&amp; \"modelled\" at &lt;5 mm/s"));
  EXPECT_THAT(svg, Not(HasSubstr("<title>")));
  Plot other = example();
  other.title = "another";
  const std::string both = svg + render_svg(other);
  const std::regex id("id=[\"']([^\"']+)[\"']");
  std::set<std::string> first;
  for (std::sregex_iterator it(svg.begin(), svg.end(), id), end; it != end; ++it) first.insert((*it)[1]);
  ASSERT_FALSE(first.empty());
  const std::string second = both.substr(svg.size());
  for (std::sregex_iterator it(second.begin(), second.end(), id), end; it != end; ++it) {
    EXPECT_EQ(first.count((*it)[1]), 0U) << (*it)[1];
  }
}

TEST(Plot, every_kind_and_option_is_understood_by_gnuplot) {
  Plot plot;
  plot.x_label = "frequency (Hz)";
  plot.equal_aspect = false;
  plot.log_x = plot.log_y = true;
  plot.step("steps", {1, 10, 100}, {1, 2, 3}).dashed("dashed", {1, 10, 100}, {3, std::nan(""), 1});
  plot.references.push_back({ReferenceLine::Axis::horizontal, 2.0, "limit"});
  for (const auto legend :
       {Plot::Legend::top_left, Plot::Legend::bottom_left, Plot::Legend::bottom_right, Plot::Legend::none}) {
    plot.legend = legend;
    EXPECT_THAT(render_svg(plot), HasSubstr("frequency (Hz)"));
  }
  plot.log_x = plot.log_y = false;
  plot.equal_aspect = true;
  plot.x_range = {0.0, 200.0};
  plot.y_range = {-5.0, 5.0};
  EXPECT_NO_THROW(render_svg(plot));
  // gnuplot warns of an empty range; its words must not land in the drawing.
  EXPECT_THAT(render_svg(Plot{}.line("flat", {1.0, 1.0}, {2.0, 2.0})), Not(HasSubstr("arning")));
}

TEST(Plot, nothing_to_show_and_unequal_lengths_are_refused) {
  EXPECT_THROW(render_svg(Plot{}), std::invalid_argument);
  EXPECT_THROW(render_svg(Plot{}.line("", {1, 2}, {1})), std::invalid_argument);
  EXPECT_THROW(render_svg(Plot{}.line("", {1}, {std::nan("")})), std::invalid_argument);
}

TEST(HtmlReport, is_self_contained_and_escapes_its_text) {
  HtmlReport report("Needle <1> & tissue");
  report.callout(Tone::warning, "One effect found", "torsional_windup, 0.6 rad at 100 mm")
      .heading("Evidence")
      .paragraph("<script>alert('x')</script>")
      .table({"effect", "size"}, {{"torsional_windup", "0.6"}, {"layer", "nothing above 0.1"}}, "Sizes")
      .table({"trial", "rms (mm)"}, {{"a", "0.31"}, {"b", "0.28"}}, "Errors")
      .list({"first", "second"})
      .code("[needle]\nwheelbase_mm = 20.0")
      .facts({{"held-out error", "1.21 < 3", "rms & largest"}, {"readings", "2912", ""}})
      .folded("the rest & more", [](HtmlReport& inside) { inside.paragraph("behind the fold"); })
      .figure(example(), "Deflection over depth.");
  const std::string html = report.html();
  EXPECT_THAT(html, HasSubstr("<title>Needle &lt;1&gt; &amp; tissue</title>"));
  EXPECT_THAT(html, Not(HasSubstr("<script>")));
  EXPECT_THAT(html, HasSubstr("<td class=\"number\">0.31</td>"));
  EXPECT_THAT(html, HasSubstr("<span>held-out error</span><b>1.21 &lt; 3</b><span>rms &amp; largest</span>"));
  EXPECT_THAT(html, HasSubstr("<summary>the rest &amp; more</summary>\n<p>behind the fold</p>\n</details>"));
  EXPECT_THAT(html, HasSubstr("<td>0.6</td>"));  // not a column of numbers only
  EXPECT_THAT(html, HasSubstr("Figure 1. Deflection over depth."));
  // Nothing is fetched: the only addresses are the names of XML name spaces.
  const std::regex fetched("(src|href)=[\"'](https?:)?//|url\\(http|@import");
  EXPECT_FALSE(std::regex_search(html, fetched));
  EXPECT_THROW(report.table({"a", "b"}, {{"1"}}), std::invalid_argument);
  const auto path = std::filesystem::path(BEVEL_BINARY_DIR) / "test-report.html";
  report.save(path.string());
  EXPECT_EQ(std::filesystem::file_size(path), html.size());
  EXPECT_THROW(report.save("/nonexistent/report.html"), std::runtime_error);
}

TEST(HtmlReport, significant_digits) {
  EXPECT_EQ(format_significant(12.3456, 4), "12.35");
  EXPECT_EQ(format_significant(0.0), "0");
}

}  // namespace
}  // namespace bevel::io
