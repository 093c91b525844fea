#include "io/find_logs.hpp"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

namespace bevel::io {

namespace fs = std::filesystem;

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
  return logs;
}

}  // namespace bevel::io
