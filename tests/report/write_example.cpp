// SPDX-License-Identifier: MIT
// write_example PAGE.html: the example page as a file, for a browser.
#include <cstdio>

#include "tests/report/example_page.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: write_example PAGE.html\n");
    return 2;
  }
  bevel::report::testing::example_page().save(argv[1]);
  return 0;
}
