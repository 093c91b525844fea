// SPDX-License-Identifier: MIT
// A page with one figure of each kind, whose values are known: what a browser shows of it is compared with them.
#pragma once

#include <bevel/report/page.hpp>

namespace bevel::report::testing {

Page example_page();

}  // namespace bevel::report::testing
