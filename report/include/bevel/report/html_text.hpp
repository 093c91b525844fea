// SPDX-License-Identifier: MIT
// Text inside a page.
#pragma once

#include <string>
#include <string_view>

namespace bevel::report {

// As text or as the value of an attribute: nothing in it is taken for a tag.
std::string escape_html(std::string_view text);

// For the inside of a <script>: JSON in which nothing ends the script ("<" becomes "\u003c").
std::string escape_script(std::string_view json);

}  // namespace bevel::report
