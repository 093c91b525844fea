# SPDX-License-Identifier: MIT
# cmake -DOUT=FILE -DSOURCE=DIR -P make_page.cmake: the page's parts as one C++ text.
set(page ${SOURCE}/view/src/page)
set(uplot ${SOURCE}/third_party/uplot)
file(READ ${page}/view.html html)
foreach(part "UPLOT_CSS ${uplot}/uPlot.min.css" "VIEW_CSS ${page}/view.css" "UPLOT_JS ${uplot}/uPlot.iife.min.js"
        "VIEW_JS ${page}/view.js")
  separate_arguments(part UNIX_COMMAND "${part}")
  list(GET part 0 name)
  list(GET part 1 file)
  file(READ ${file} text)
  string(REPLACE "@${name}@" "${text}" html "${html}")
endforeach()
# A literal may not be longer than 64 KiB: in pieces, which the compiler does not join but std::string does.
set(code "#include <bevel/view/page.hpp>\n\nnamespace bevel::view {\n\nconst std::string& page_html() {\n  static const std::string text =\n      std::string()")
string(LENGTH "${html}" length)
set(at 0)
while(at LESS length)
  string(SUBSTRING "${html}" ${at} 8000 piece)
  string(APPEND code " +\n      R\"page(${piece})page\"")
  math(EXPR at "${at} + 8000")
endwhile()
string(APPEND code ";\n  return text;\n}\n\n}  // namespace bevel::view\n")
file(WRITE ${OUT} "${code}")
