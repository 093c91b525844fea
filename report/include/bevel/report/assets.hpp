// SPDX-License-Identifier: MIT
// What every page carries inside: style sheets, uPlot, and the script that draws figures with it. Made of the files of
// report/src/page and third_party/uplot when the project is built.
#pragma once

#include <string>

namespace bevel::report {

const std::string& page_css();
const std::string& page_js();

}  // namespace bevel::report
