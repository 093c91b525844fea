// SPDX-License-Identifier: MIT
// The page itself, one file with its style, its script and the charts' library in it: bevel/view/page.hpp/ and
// third_party/uplot, put together by the build.
#pragma once

#include <string>

namespace bevel::view {

const std::string& page_html();

}  // namespace bevel::view
