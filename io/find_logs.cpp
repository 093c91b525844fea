#include "io/find_logs.hpp"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

namespace bevel::io {

namespace fs = std::filesystem;

namespace {

/// Result files and folders are named after a log: a name of dots alone is that of a folder above them.
void require_name(const std::string& log) {
  const std::string stem = fs::path(log).stem().string();
  if (stem.find_first_not_of('.') == std::string::npos)
    throw std::runtime_error(log + ": its name without the extension is '" + stem +
                             "'; allowed: a name with a character that is no dot. Rename the file");
}

}  // namespace

std::vector<std::string> find_logs(const std::vector<std::string>& paths) {
  std::vector<std::string> logs;
  for (const std::string& path : paths) {
    if (!fs::is_directory(path)) {
      if (!fs::exists(path)) throw std::runtime_error(path + ": no such log");
      logs.push_back(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path))
      if (entry.path().extension() == ".lcm") inside.push_back(entry.path().string());
    if (inside.empty()) throw std::runtime_error(path + ": holds no file that ends in .lcm");
    std::sort(inside.begin(), inside.end());
    logs.insert(logs.end(), inside.begin(), inside.end());
  }
  for (const std::string& log : logs) require_name(log);
  return logs;
}

}  // namespace bevel::io
