// SPDX-License-Identifier: MIT
#include <bevel/report/page.hpp>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include <bevel/error.hpp>
#include <bevel/io/result_file.hpp>
#include <bevel/io/sha256.hpp>
#include <bevel/report/assets.hpp>
#include <bevel/report/figure_svg.hpp>
#include <bevel/report/html_text.hpp>

namespace bevel::report {
namespace {

constexpr double kWide_px = 880;  // of a figure alone in its row

const char* class_of(Tone tone) {
  switch (tone) {
    case Tone::good:
      return " good";
    case Tone::warning:
      return " warning";
    case Tone::bad:
      return " bad";
    case Tone::plain:
      break;
  }
  return "";
}

bool is_number(const std::string& text) {
  if (text.empty()) return false;
  char* end = nullptr;
  const bool bounded = text.starts_with("< ") || text.starts_with("> ");
  const char* begin = text.c_str() + (bounded ? 2 : 0);
  std::strtod(begin, &end);
  if (end == begin) return false;
  return *end == '\0' || std::strcmp(end, " %") == 0;
}

// As a content security policy names a script: the browser runs this one and no other, whatever a text holds.
std::string hash_source(const std::string& script) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::string hex = io::sha256_hex(script);
  std::string base64;
  unsigned held = 0;
  int bits = 0;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    held = (held << 8U) | static_cast<unsigned>(std::stoul(hex.substr(i, 2), nullptr, 16));
    for (bits += 8; bits >= 6; bits -= 6) base64 += kDigits[(held >> static_cast<unsigned>(bits - 6)) & 63U];
    held &= 0xffU;
  }
  if (bits > 0) base64 += kDigits[(held << static_cast<unsigned>(6 - bits)) & 63U];
  while (base64.size() % 4 != 0) base64 += '=';
  return "'sha256-" + base64 + "'";
}

}  // namespace

Page::Page(std::string title) : title_(std::move(title)) {}

Page& Page::heading(std::string_view text) {
  headings_.emplace_back(text);
  body_ += "<h2 id=\"s" + std::to_string(headings_.size()) + "\">" + escape_html(text) + "</h2>\n";
  return *this;
}

Page& Page::subheading(std::string_view text) {
  body_ += "<h3>" + escape_html(text) + "</h3>\n";
  return *this;
}

Page& Page::paragraph(std::string_view text) {
  body_ += "<p>" + escape_html(text) + "</p>\n";
  return *this;
}

Page& Page::list(const std::vector<std::string>& items) {
  body_ += "<ul>\n";
  for (const auto& item : items) body_ += "<li>" + escape_html(item) + "</li>\n";
  body_ += "</ul>\n";
  return *this;
}

Page& Page::code(std::string_view text) {
  body_ += "<pre>" + escape_html(text) + "</pre>\n";
  return *this;
}

Page& Page::verdict(Tone tone, std::string_view headline, std::string_view text, const std::vector<Fact>& all) {
  body_ += std::string("<section class=\"verdict") + class_of(tone) + "\"><strong>" + escape_html(headline) +
           "</strong>" + escape_html(text) + "\n";
  if (!all.empty()) facts(all);
  body_ += "</section>\n";
  return *this;
}

Page& Page::facts(const std::vector<Fact>& facts) {
  body_ += "<div class=\"facts\">\n";
  for (const auto& fact : facts)
    body_ += "<div><span>" + escape_html(fact.label) + "</span><b>" + escape_html(fact.value) + "</b><span>" +
             escape_html(fact.note) + "</span></div>\n";
  body_ += "</div>\n";
  return *this;
}

Page& Page::folded(std::string_view line, const std::function<void(Page&)>& fill) {
  body_ += "<details><summary>" + escape_html(line) + "</summary>\n";
  fill(*this);
  body_ += "</details>\n";
  return *this;
}

Page& Page::table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows,
                  std::string_view caption) {
  std::vector<bool> numeric(header.size(), !rows.empty());
  for (const auto& row : rows) {
    if (row.size() != header.size()) {
      throw ArgumentError("table \"" + std::string(caption) + "\": a row of " + std::to_string(row.size()) +
                          " cells under a header of " + std::to_string(header.size()));
    }
    for (std::size_t i = 0; i < row.size(); ++i) numeric[i] = numeric[i] && is_number(row[i]);
  }
  const auto add_row = [&](const std::vector<std::string>& cells, const std::string& tag) {
    body_ += "<tr>";
    for (std::size_t i = 0; i < cells.size(); ++i) {
      body_ += "<" + tag + (numeric[i] ? " class=\"number\">" : ">") + escape_html(cells[i]) + "</" + tag + ">";
    }
    body_ += "</tr>\n";
  };
  body_ += "<div class=\"table\"><table>\n";
  if (!caption.empty()) body_ += "<caption>" + escape_html(caption) + "</caption>\n";
  body_ += "<thead>";
  add_row(header, "th");
  body_ += "</thead>\n<tbody>\n";
  for (const auto& row : rows) add_row(row, "td");
  body_ += "</tbody></table></div>\n";
  return *this;
}

void Page::add_live(const std::string& json, const std::string& svg) {
  data_ += (live_ == 0 ? "" : ",\n") + json;
  body_ += "<div class=\"panel\" data-figure=\"" + std::to_string(live_++) + "\"><div class=\"still\">\n" + svg +
           "\n</div></div>\n";
}

void Page::begin_figure() {
  ++figures_;
  body_ += "<figure>\n";
}

void Page::end_figure(std::string_view caption) {
  body_ += "<figcaption>Figure " + std::to_string(figures_) + (caption.empty() ? "" : ". ") + escape_html(caption) +
           "</figcaption></figure>\n";
}

Page& Page::figure(const Figure& figure, std::string_view caption) { return figures({figure}, 1, caption); }

Page& Page::figures(const std::vector<Figure>& panels, int columns, std::string_view caption) {
  const int beside = std::clamp(columns, 1, 4);
  begin_figure();
  body_ += "<div class=\"panels of-" + std::to_string(beside) + "\">\n";
  for (const Figure& panel : panels) add_live(figure_json(panel, lists_), figure_svg(panel, kWide_px / beside));
  body_ += "</div>\n";
  end_figure(caption);
  return *this;
}

Page& Page::space(const Space& space, std::string_view caption) {
  begin_figure();
  add_live(space_json(space, lists_), space_svg(space, kWide_px));
  end_figure(caption);
  return *this;
}

Page& Page::picture(std::string_view svg, std::string_view caption) {
  begin_figure();
  body_ += std::string(svg) + "\n";
  end_figure(caption);
  return *this;
}

std::string Page::html() const {
  static const std::string policy =
      "default-src 'none'; style-src 'unsafe-inline'; script-src " + hash_source(page_js());
  std::string contents;
  if (headings_.size() >= 3) {
    contents = "<nav><b>Contents</b><ol>\n";
    for (std::size_t i = 0; i < headings_.size(); ++i)
      contents += "<li><a href=\"#s" + std::to_string(i + 1) + "\">" + escape_html(headings_[i]) + "</a></li>\n";
    contents += "</ol></nav>\n";
  }
  std::string scripts;
  if (live_ > 0)
    scripts = "<script type=\"application/json\" id=\"figures\">{\"lists\":" + escape_script(lists_.json()) +
              ",\n\"figures\":[" + escape_script(data_) + "]}</script>\n<script>" + page_js() + "</script>\n";
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"" +
         policy + "\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         escape_html(title_) + "</title>\n<style>" + page_css() + "</style></head>\n<body>\n" + contents +
         "<main>\n<h1>" + escape_html(title_) + "</h1>\n" + body_ + "</main>\n" + scripts + "</body></html>\n";
}

void Page::save(const std::string& path) const { io::write_result_file(path, html()); }

}  // namespace bevel::report
