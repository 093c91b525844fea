// SPDX-License-Identifier: MIT
#pragma once
// Tools under test, made of a few lines of shell.
#include <filesystem>
#include <fstream>
#include <string>

namespace bevel::proof {

inline std::filesystem::path write_tool(const std::filesystem::path& folder, const std::string& body,
                                        const std::string& name = "tool") {
  const std::filesystem::path path = folder / name;
  std::ofstream(path) << "#!/bin/sh\n" << body << "\n";
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

// Takes --out's value into $out.
inline constexpr const char* kFindOut = "while [ \"$1\" != --out ]; do shift; done; out=$2\n";

}  // namespace bevel::proof
