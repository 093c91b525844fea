// SPDX-License-Identifier: MIT
#include <bevel/cli/shipped_file.hpp>

#include <filesystem>

namespace bevel::cli {

namespace fs = std::filesystem;

std::string shipped_file(const std::string& relative) {
  std::error_code none;
  fs::path folder = fs::read_symlink("/proc/self/exe", none).parent_path();
  for (; !none && folder.has_relative_path(); folder = folder.parent_path())
    for (const fs::path& file : {folder / relative, folder / "share/bevel" / relative})
      if (fs::exists(file, none)) return file.string();
  return relative;
}

}  // namespace bevel::cli
