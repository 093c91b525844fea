// SPDX-License-Identifier: MIT
// Figures as the page's script reads them (report/src/page/report.js).
#pragma once

#include <map>
#include <string>
#include <vector>

#include <bevel/report/figure.hpp>

namespace bevel::report {

// The numbers of all figures of a page, each list of them once: linked figures have many in common.
class NumberLists {
 public:
  std::size_t place_of(std::string list);  // a JSON array; in json() from now on, if it was not
  std::string json() const;                // an array of arrays

 private:
  std::vector<std::string> lists_;
  std::map<std::string, std::size_t> places_;
};

// One JSON object in one line, in which a list of numbers is its place in `lists`. Values are rounded to a
// hundred-thousandth of what their axis shows; what is not finite is null; text that is not UTF-8 is mended. Not yet
// fit for the inside of a <script>: escape_script. Throws ArgumentError where check() does.
std::string figure_json(const Figure& figure, NumberLists& lists);
std::string space_json(const Space& space, NumberLists& lists);

}  // namespace bevel::report
