// SPDX-License-Identifier: MIT
#pragma once
// Files that come with the programs: config/demo.toml, for instance.
#include <string>

namespace bevel::cli {

// `relative` to the folder of the sources: the nearest folder above this program that has it, whatever the current one
// is (build/bin is in it), and else the current one. `relative` itself where there is none: whoever opens it says so.
std::string shipped_file(const std::string& relative);

}  // namespace bevel::cli
