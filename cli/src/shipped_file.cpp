#include <bevel/cli/shipped_file.hpp>

#include <filesystem>

namespace bevel::cli {

namespace fs = std::filesystem;

std::string shipped_file(const std::string& relative) {
  std::error_code none;
  fs::path folder = fs::read_symlink("/proc/self/exe", none).parent_path();
  for (; !none && folder.has_relative_path(); folder = folder.parent_path())
    if (fs::exists(folder / relative, none)) return (folder / relative).string();
  return relative;
}

}  // namespace bevel::cli
