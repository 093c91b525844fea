// SPDX-License-Identifier: MIT
// One self-contained page: text, tables and figures, no network. All text given is escaped here. Where no script runs,
// and on paper, every figure is a picture; elsewhere it can be zoomed and read off. The same input gives the same
// bytes.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <bevel/report/figure.hpp>
#include <bevel/report/figure_json.hpp>

namespace bevel::report {

enum class Tone { plain, good, warning, bad };

// One number that matters, large, between what it is and a remark on it.
struct Fact {
  std::string label, value, note;
};

class Page {
 public:
  explicit Page(std::string title);

  Page& heading(std::string_view text);  // a section; three or more of them make a list of contents
  Page& subheading(std::string_view text);
  Page& paragraph(std::string_view text);
  Page& list(const std::vector<std::string>& items);
  Page& code(std::string_view text);  // kept as it is, line by line
  // What there is to know, at a glance: in one box the finding, a sentence on it and its numbers.
  Page& verdict(Tone tone, std::string_view headline, std::string_view text, const std::vector<Fact>& facts = {});
  Page& facts(const std::vector<Fact>& facts);  // side by side
  // What `fill` adds stands behind a line that unfolds it.
  Page& folded(std::string_view line, const std::function<void(Page&)>& fill);
  // A column whose cells are all numbers is set flush right. Throws ArgumentError on a row of another length.
  Page& table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows,
              std::string_view caption = "");
  // These throw ArgumentError where check() of figure.hpp does.
  Page& figure(const Figure& figure, std::string_view caption);
  // Panels of one figure, so many beside each other (1 to 4) where the page is wide enough.
  Page& figures(const std::vector<Figure>& panels, int columns, std::string_view caption);
  Page& space(const Space& space, std::string_view caption);
  Page& picture(std::string_view svg, std::string_view caption);  // svg is trusted, not escaped: of report::Drawing

  std::string html() const;
  void save(const std::string& path) const;  // throws IoError naming the file and the reason

 private:
  void add_live(const std::string& json, const std::string& svg);
  void begin_figure();
  void end_figure(std::string_view caption);

  std::string title_;
  std::string body_;
  std::string data_;  // of the figures, in their order: JSON objects between commas
  NumberLists lists_;
  std::vector<std::string> headings_;
  int figures_ = 0;  // numbered ones
  int live_ = 0;     // those that a script draws
};

}  // namespace bevel::report
