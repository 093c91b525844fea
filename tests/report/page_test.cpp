// SPDX-License-Identifier: MIT
// Pages as text: complete, escaped, self-contained, the same bytes each time, and with nothing lost where no script
// runs. What a browser makes of them: browser_test.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <regex>

#include <bevel/error.hpp>
#include <bevel/report/assets.hpp>
#include <bevel/report/figure_svg.hpp>
#include <bevel/report/html_text.hpp>
#include <bevel/report/label_place.hpp>
#include <bevel/report/page.hpp>
#include "tests/report/example_page.hpp"

namespace bevel::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// What the page's script is given.
nlohmann::json data_of(const std::string& html) {
  const std::string open = R"(<script type="application/json" id="figures">)";
  const std::size_t from = html.find(open) + open.size();
  return nlohmann::json::parse(html.substr(from, html.find("</script>", from) - from));
}

Figure deflection() {
  std::vector<double> x, y, low, high;
  for (int i = 0; i <= 130; ++i) {
    x.push_back(i);
    y.push_back(-0.0022 * i * i + 0.4 * std::sin(0.3 * i));
    low.push_back(-0.0022 * i * i - 0.01 * i);
    high.push_back(-0.0022 * i * i + 0.01 * i);
  }
  Figure figure;
  figure.title = "Deflection, it's measured & \"modelled\" at <5 mm/s>";
  figure.x_label = "depth (mm)";
  figure.y_label = "deflection (mm)";
  figure.band("99 % band", x, low, high, Colour::blue).points("measured", x, y, Colour::orange).line("model", x, low);
  figure.references.push_back({Reference::Axis::vertical, 60.0, "layer"});
  return figure;
}

TEST(ReportPage, is_self_contained_and_escapes_its_text) {
  Page page("Needle <1> & tissue");
  page.verdict(Tone::warning, "One effect found", "torsional_windup, 0.6 rad at 100 mm",
               {{"held-out error", "1.21 < 3", "rms & largest"}, {"readings", "2912", ""}})
      .heading("Evidence")
      .paragraph("<script>alert('x')</script>")
      .table({"effect", "size"}, {{"torsional_windup", "0.6"}, {"layer", "nothing above 0.1"}}, "Sizes")
      .table({"trial", "rms (mm)"}, {{"a", "0.31"}, {"b", "0.28"}}, "Errors")
      .list({"first", "second"})
      .code("[needle]\nwheelbase_mm = 20.0")
      .folded("the rest & more", [](Page& inside) { inside.paragraph("behind the fold"); })
      .figure(deflection(), "Deflection over depth.");
  const std::string html = page.html();
  EXPECT_THAT(html, HasSubstr("<title>Needle &lt;1&gt; &amp; tissue</title>"));
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, HasSubstr("<td class=\"number\">0.31</td>"));
  EXPECT_THAT(html, HasSubstr("<span>held-out error</span><b>1.21 &lt; 3</b><span>rms &amp; largest</span>"));
  EXPECT_THAT(html, HasSubstr("<summary>the rest &amp; more</summary>\n<p>behind the fold</p>\n</details>"));
  EXPECT_THAT(html, HasSubstr("<td>0.6</td>"));  // not a column of numbers only
  EXPECT_THAT(html, HasSubstr("Figure 1. Deflection over depth."));
  // Nothing is fetched: the only addresses are the names of XML name spaces, and uPlot's home in a comment.
  const std::regex fetched("(src|href)=[\"'](https?:)?//|url\\(http|@import");
  EXPECT_FALSE(std::regex_search(html, fetched));
  EXPECT_THAT(html, HasSubstr("default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-"));
  EXPECT_THROW(page.table({"a", "b"}, {{"1"}}), bevel::ArgumentError);
  const auto path = std::filesystem::path(BEVEL_BINARY_DIR) / "test-report.html";
  page.save(path.string());
  EXPECT_EQ(std::filesystem::file_size(path), html.size());
  EXPECT_THROW(page.save("/nonexistent/report.html"), std::runtime_error);
}

TEST(ReportPage, text_from_a_log_stays_text_in_markup_drawing_and_data) {
  const std::string evil = "</script><img src=x onerror=alert(1)>'\"&\xff";
  Figure figure = Figure{}.line(evil, {0, 1}, {0, 1});
  figure.title = figure.x_label = figure.y_label = figure.link = evil;
  figure.references.push_back({Reference::Axis::horizontal, 0.5, evil});
  Space space{.paths = {{.label = evil, .points_mm = {{0, 0, 0}, {0, 1, 9}}}}};
  for (int i = 0; i < 3; ++i) space.paths.push_back(space.paths.front());
  Page page(evil);
  page.verdict(Tone::bad, evil, evil, {{evil, evil, evil}}).heading(evil).subheading(evil).paragraph(evil);
  page.list({evil}).code(evil).folded(evil, [](Page&) {}).table({evil}, {{evil}}, evil);
  page.figure(figure, evil).space(space, evil);
  const std::string html = page.html();
  EXPECT_THAT(html, Not(HasSubstr("<img")));
  EXPECT_THAT(html, Not(HasSubstr(evil)));
  EXPECT_EQ(html.find('\0'), std::string::npos);
  for (std::size_t at = html.find("stroke=\""); at != std::string::npos; at = html.find("stroke=\"", at + 1))
    EXPECT_TRUE(html.compare(at + 8, 4, "var(") == 0 || html.compare(at + 8, 4, "none") == 0) << html.substr(at, 40);
  // Two scripts and no more: the data, in which nothing ends it early, and the page's own.
  std::size_t ends = 0;
  for (std::size_t at = html.find("</script"); at != std::string::npos; at = html.find("</script", at + 1)) ++ends;
  EXPECT_EQ(ends, 2U);
  // The script gets what was given, but for the byte that is no UTF-8.
  EXPECT_EQ(data_of(html)["figures"][0]["series"][0]["label"], "</script><img src=x onerror=alert(1)>'\"&\xEF\xBF\xBD");
}

TEST(ReportPage, the_policy_names_the_script_that_the_page_carries) {
  // Base64 and SHA-256 by another hand: printf 'TEXT' | openssl dgst -sha256 -binary | base64.
  const std::string html = Page("p").figure(deflection(), "").html();
  const std::size_t from = html.rfind("<script>") + 8;
  const std::string script = html.substr(from, html.rfind("</script>") - from);
  EXPECT_EQ(script, page_js());
  const auto file = std::filesystem::path(BEVEL_BINARY_DIR) / "test-report-script.js";
  std::ofstream(file, std::ios::binary) << script;
  const std::string command = "openssl dgst -sha256 -binary '" + file.string() + "' | base64";
  std::FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  char line[128] = "";
  const char* read = std::fgets(line, sizeof line, pipe);
  if (pclose(pipe) != 0 || read == nullptr || std::string(line).size() < 40) GTEST_SKIP() << "no openssl program here";
  EXPECT_THAT(html, HasSubstr("script-src 'sha256-" + std::string(line, 44) + "'\""));
}

TEST(ReportPage, the_same_input_gives_the_same_bytes) {
  EXPECT_EQ(testing::example_page().html(), testing::example_page().html());
}

TEST(ReportPage, a_list_of_contents_leads_to_every_section) {
  Page page("p");
  page.heading("One").heading("Two");
  EXPECT_THAT(page.html(), Not(HasSubstr("<nav>")));
  page.heading("Th<ree");
  EXPECT_THAT(page.html(), HasSubstr("<a href=\"#s3\">Th&lt;ree</a>"));
  EXPECT_THAT(page.html(), HasSubstr("<h2 id=\"s3\">Th&lt;ree</h2>"));
}

TEST(ReportPage, without_figures_carries_no_script) {
  EXPECT_THAT(Page("p").paragraph("text").html(), Not(HasSubstr("<script")));
}

TEST(ReportFigure, still_picture_holds_every_kind) {
  Figure figure;
  figure.x_label = "frequency (Hz)";
  figure.log_x = figure.log_y = true;
  figure.step("steps", {1, 10, 100}, {1, 2, 3}).dashed("dashed", {1, 10, 100}, {3, std::nan(""), 1});
  figure.bars("bars", {1, 10}, {1, 2}, {2, 3}).points("dots", {1, 0, 100}, {1, 2, -1});
  figure.references.push_back({Reference::Axis::horizontal, 2.0, "limit"});
  figure.spans.push_back({2, 3});
  const std::string svg = figure_svg(figure);
  EXPECT_EQ(svg.rfind("<svg", 0), 0U);
  for (const char* part : {"frequency (Hz)", ">steps<", ">dashed<", ">bars<", ">dots<", ">limit<", "var(--span)"})
    EXPECT_THAT(svg, HasSubstr(part));
  EXPECT_FALSE(std::regex_search(svg, std::regex("nan|inf")));
}

// A curve through where the name would stand, on both sides of the line: it stands lower down. The svg says where.
TEST(ReportFigure, a_name_on_a_line_keeps_clear_of_the_curves) {
  const auto place = [](const std::vector<double>& y) {
    Figure figure = Figure{}.line("curve", {0, 48, 52, 100}, y);
    figure.x_range = {0, 100}, figure.y_range = {0, 1};
    figure.references.push_back({Reference::Axis::vertical, 50.0, "from here"});
    const std::string svg = figure_svg(figure, 832);
    std::smatch at;
    if (!std::regex_search(svg, at, std::regex("x=\"([0-9.]+)\" y=\"([0-9.]+)\"[^>]*>from here<"))) return Point{};
    return Point{std::stod(at[1]), std::stod(at[2])};
  };
  const Point free = place({0.1, 0.1, 0.1, 0.1}), lower = place({0.97, 0.97, 0.97, 0.97}),
              left = place({0, 0, 0.97, 0.97});
  EXPECT_GT(free.y, 0);
  EXPECT_GE(lower.y, free.y + 13);
  EXPECT_EQ(lower.x, free.x);
  EXPECT_LT(left.x, free.x) << "on the other side, where it is as high";
  EXPECT_EQ(left.y, free.y);
}

TEST(ReportFigure, an_edge_crosses_a_box_if_any_of_it_is_inside) {
  const Box box{10, 10, 20, 10};
  EXPECT_TRUE(crosses(box, {{0, 15}, {40, 15}}));
  EXPECT_TRUE(crosses(box, {{15, 15}, {16, 16}}));
  EXPECT_TRUE(crosses(box, {{15, 15}, {15, 15}}));
  EXPECT_TRUE(crosses(box, {{0, 0}, {40, 30}}));
  EXPECT_FALSE(crosses(box, {{0, 0}, {40, 5}}));
  EXPECT_FALSE(crosses(box, {{0, 15}, {9, 15}}));
  EXPECT_FALSE(crosses(box, {{0, 21}, {5, 40}}));
  EXPECT_FALSE(crosses(box, {{35, 15}, {35, 15}}));
}

TEST(ReportFigure, a_gap_breaks_a_line_and_a_band_and_a_lone_sample_is_a_bar) {
  const double gap = std::nan("");
  const std::string line = figure_svg(Figure{}.line("", {0, 1, 2, 3, 4}, {0, 1, gap, 1, 0}));
  EXPECT_TRUE(std::regex_search(line, std::regex("d=\"M[^M\"]+L[^M\"]+M[^M\"]+L[^M\"]+\" stroke=\"var\\(--blue\\)")));
  const Figure band = Figure{}.band("", {0, 1, 2, 3}, {0, 1, gap, 1}, {1, 2, gap, 2});
  const std::string svg = figure_svg(band);
  EXPECT_THAT(svg, HasSubstr("fill-opacity=\"0.22\""));
  EXPECT_THAT(svg, HasSubstr("stroke-width=\"5\""));
}

TEST(ReportFigure, nothing_to_show_and_unequal_lengths_are_refused) {
  EXPECT_THROW(check(Figure{}), bevel::ArgumentError);
  EXPECT_THROW(check(Figure{}.line("", {1, 2}, {1})), bevel::ArgumentError);
  EXPECT_THROW(check(Figure{}.line("", {1}, {std::nan("")})), bevel::ArgumentError);
  EXPECT_THROW(check(Figure{}.band("", {1, 2}, {1, 2}, {1})), bevel::ArgumentError);
  Figure keyed = Figure{}.line("k", {1, 2}, {1, 2});
  keyed.series[0].key = {1};
  EXPECT_THROW(Page("p").figure(keyed, ""), bevel::ArgumentError);
  EXPECT_THROW(Page("p").space(Space{}, ""), bevel::ArgumentError);
}

TEST(ReportFigure, data_hold_the_values_once_and_no_digit_too_many) {
  const std::vector<double> x{0, 0.123456789, 1}, y{-0.0, std::numeric_limits<double>::infinity(), 2.0 / 3};
  Figure one = Figure{}.line("a", x, y), other = Figure{}.points("b", x, y);
  other.log_y = true;
  const nlohmann::json data = data_of(Page("p").figures({one, other}, 2, "").html());
  const auto& lists = data["lists"];
  const auto& of_one = data["figures"][0]["series"][0];
  EXPECT_EQ(of_one["x"], data["figures"][1]["series"][0]["x"]);
  EXPECT_EQ(lists[of_one["x"].get<int>()].dump(), "[0.0,0.12346,1.0]");
  EXPECT_EQ(lists[of_one["y"].get<int>()].dump(), "[0.0,null,0.666667]");
}

// Values over fifteen decades: what is shown differs from what was given by no more than a pixel could.
TEST(ReportFigure, rounding_is_finer_than_a_pixel_at_every_scale) {
  for (int power = -12; power <= 6; power += 3) {
    const double unit = std::pow(10.0, power);
    std::vector<double> x, y;
    for (int i = 0; i < 50; ++i) {
      x.push_back(i);
      y.push_back(unit * (3 + std::sin(1.7 * i)));
    }
    const nlohmann::json data = data_of(Page("p").figure(Figure{}.line("", x, y), "").html());
    const auto& list = data["lists"][data["figures"][0]["series"][0]["y"].get<std::size_t>()];
    for (std::size_t i = 0; i < y.size(); ++i)
      EXPECT_NEAR(list[i].get<double>(), y[i], 2e-5 * 2 * unit) << "10^" << power;
  }
}

}  // namespace
}  // namespace bevel::report
