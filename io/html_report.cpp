#include "io/html_report.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace bevel::io {
namespace {

constexpr const char* kStyle = R"(
:root { --ink: #222; --soft: #666; --line: #ddd; }
body { font: 16px/1.5 system-ui, "Helvetica Neue", Helvetica, Arial, sans-serif; color: var(--ink);
       max-width: 52rem; margin: 2.5rem auto; padding: 0 1.2rem; background: #fff; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 1.2rem; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem; padding-bottom: .25rem; border-bottom: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.5rem 0 .4rem; }
figure { margin: 1.2rem 0; } figure svg { width: 100%; height: auto; }
figcaption, caption { color: var(--soft); font-size: .88rem; text-align: left; }
caption { caption-side: bottom; padding-top: .4rem; }
table { border-collapse: collapse; margin: 1rem 0; font-size: .92rem; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .8rem; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
th { border-bottom: 2px solid #999; font-weight: 600; } .number { text-align: right; }
pre { background: #f6f6f6; padding: .8rem 1rem; overflow-x: auto; font-size: .85rem; line-height: 1.4; }
.callout { border-left: 5px solid #1f6fb2; background: #f0f5fa; padding: .7rem 1rem; margin: 1rem 0; }
.callout strong { display: block; } .callout.good { border-color: #2a8c6b; background: #eef7f3; }
.callout.warning { border-color: #b8912a; background: #fbf6e8; } .callout.bad { border-color: #b23a2e; background: #fbeeec; }
.facts { display: flex; flex-wrap: wrap; gap: .7rem; margin: 1.1rem 0; }
.facts div { flex: 1 1 6.5rem; border: 1px solid var(--line); border-radius: 6px; padding: .55rem .8rem; }
.facts span { display: block; color: var(--soft); font-size: .82rem; line-height: 1.35; }
.facts b { display: block; font-size: 1.12rem; font-weight: 600; line-height: 1.5; white-space: nowrap; }
details { margin: .8rem 0; } summary { cursor: pointer; color: #1f5f99; }
@media print { body { margin: 0; max-width: none; } figure, table { break-inside: avoid; } }
)";

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
  std::strtod(text.c_str() + (bounded ? 2 : 0), &end);
  return *end == '\0' || std::strcmp(end, " %") == 0;
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string format_significant(double value, int digits) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*g", digits, value);
  return buffer;
}

HtmlReport::HtmlReport(std::string title) : title_(std::move(title)) {}

HtmlReport& HtmlReport::heading(std::string_view text) {
  body_ += "<h2>" + escape_html(text) + "</h2>\n";
  return *this;
}

HtmlReport& HtmlReport::subheading(std::string_view text) {
  body_ += "<h3>" + escape_html(text) + "</h3>\n";
  return *this;
}

HtmlReport& HtmlReport::paragraph(std::string_view text) {
  body_ += "<p>" + escape_html(text) + "</p>\n";
  return *this;
}

HtmlReport& HtmlReport::list(const std::vector<std::string>& items) {
  body_ += "<ul>\n";
  for (const auto& item : items) body_ += "<li>" + escape_html(item) + "</li>\n";
  body_ += "</ul>\n";
  return *this;
}

HtmlReport& HtmlReport::code(std::string_view text) {
  body_ += "<pre>" + escape_html(text) + "</pre>\n";
  return *this;
}

HtmlReport& HtmlReport::callout(Tone tone, std::string_view headline, std::string_view text) {
  body_ += std::string("<div class=\"callout") + class_of(tone) + "\"><strong>" + escape_html(headline) + "</strong>" +
           escape_html(text) + "</div>\n";
  return *this;
}

HtmlReport& HtmlReport::facts(const std::vector<Fact>& facts) {
  body_ += "<div class=\"facts\">\n";
  for (const auto& fact : facts)
    body_ += "<div><span>" + escape_html(fact.label) + "</span><b>" + escape_html(fact.value) + "</b><span>" +
             escape_html(fact.note) + "</span></div>\n";
  body_ += "</div>\n";
  return *this;
}

HtmlReport& HtmlReport::folded(std::string_view line, const std::function<void(HtmlReport&)>& fill) {
  body_ += "<details><summary>" + escape_html(line) + "</summary>\n";
  fill(*this);
  body_ += "</details>\n";
  return *this;
}

HtmlReport& HtmlReport::table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows,
                              std::string_view caption) {
  std::vector<bool> numeric(header.size(), !rows.empty());
  for (const auto& row : rows) {
    if (row.size() != header.size()) {
      throw std::invalid_argument("table \"" + std::string(caption) + "\": a row of " + std::to_string(row.size()) +
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
  body_ += "<table>\n";
  if (!caption.empty()) body_ += "<caption>" + escape_html(caption) + "</caption>\n";
  body_ += "<thead>";
  add_row(header, "th");
  body_ += "</thead>\n<tbody>\n";
  for (const auto& row : rows) add_row(row, "td");
  body_ += "</tbody></table>\n";
  return *this;
}

HtmlReport& HtmlReport::figure(const Plot& plot, std::string_view caption) {
  return figure_svg(render_svg(plot), caption);
}

HtmlReport& HtmlReport::figure_svg(std::string_view svg, std::string_view caption) {
  ++figures_;
  body_ += "<figure>\n" + std::string(svg) + "\n<figcaption>Figure " + std::to_string(figures_) + ". " +
           escape_html(caption) + "</figcaption></figure>\n";
  return *this;
}

std::string HtmlReport::html() const {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         escape_html(title_) + "</title>\n<style>" + kStyle + "</style></head>\n<body>\n<h1>" + escape_html(title_) +
         "</h1>\n" + body_ + "</body></html>\n";
}

void HtmlReport::save(const std::string& path) const {
  std::ofstream file(path, std::ios::binary);
  file << html();
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written: " + std::strerror(errno));
}

}  // namespace bevel::io
