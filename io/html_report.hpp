// One self-contained page: text, tables and plots, no network, no script. All text given is escaped here.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "io/plot.hpp"

namespace bevel::io {

enum class Tone { plain, good, warning, bad };

// One figure that matters, large, between what it is and a remark on it.
struct Fact {
  std::string label, value, note;
};

class HtmlReport {
 public:
  explicit HtmlReport(std::string title);

  HtmlReport& heading(std::string_view text);  // a section
  HtmlReport& subheading(std::string_view text);
  HtmlReport& paragraph(std::string_view text);
  HtmlReport& list(const std::vector<std::string>& items);
  HtmlReport& code(std::string_view text);                                           // kept as it is, line by line
  HtmlReport& callout(Tone tone, std::string_view headline, std::string_view text);  // the verdict, at a glance
  HtmlReport& facts(const std::vector<Fact>& facts);                                 // side by side
  // What `fill` adds stands behind a line that unfolds it.
  HtmlReport& folded(std::string_view line, const std::function<void(HtmlReport&)>& fill);
  // A column whose cells are all numbers is set flush right. Throws std::invalid_argument on a row of another length.
  HtmlReport& table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows,
                    std::string_view caption = "");
  HtmlReport& figure(const Plot& plot, std::string_view caption);
  HtmlReport& figure_svg(std::string_view svg, std::string_view caption);  // svg is trusted, not escaped

  std::string html() const;
  void save(const std::string& path) const;  // throws std::runtime_error naming the file and the reason

 private:
  std::string title_;
  std::string body_;
  int figures_ = 0;
};

std::string escape_html(std::string_view text);

// "12.35" for (12.3456, 4): so many significant digits, never an exponent where none is needed.
std::string format_significant(double value, int digits = 3);

}  // namespace bevel::io
