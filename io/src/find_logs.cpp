// SPDX-License-Identifier: MIT
#include <bevel/io/find_logs.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include <bevel/error.hpp>

namespace bevel::io {

namespace fs = std::filesystem;

namespace {

/// Result files and folders are named after a log: a name of dots alone is that of a folder above them.
void require_name(const std::string& log) {
  const std::string stem = fs::path(log).stem().string();
  if (stem.find_first_not_of('.') == std::string::npos)
    throw IoError(log + ": its name without the extension is '" + stem +
                  "'; allowed: a name with a character that is no dot. Rename the file");
}

bool is_number(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool starts_as_a_log(const fs::path& path) {
  std::array<char, 4> bytes{};
  std::ifstream file(path, std::ios::binary);
  return file.read(bytes.data(), bytes.size()) && bytes == std::array{'\xED', '\xA1', '\xDA', '\x01'};
}

// A FIFO that has a log's name is refused later, with its reason; it is not opened here.
bool is_log(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string(), extension = entry.path().extension().string();
  if (entry.is_directory() || name.starts_with('.')) return false;
  if (is_log_name(name)) return true;
  return (extension.empty() || is_number(extension.substr(1))) && entry.is_regular_file() &&
         starts_as_a_log(entry.path());
}

// "rec.lcm.2" before "rec.lcm.10".
bool is_before(const std::string& a, const std::string& b) {
  const auto digits_from = [](const std::string& text, std::size_t at) {
    std::size_t end = at;
    while (end < text.size() && std::isdigit(static_cast<unsigned char>(text[end])) != 0) ++end;
    return std::string_view(text).substr(at, end - at);
  };
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    std::string_view x = digits_from(a, i), y = digits_from(b, j);
    if (x.empty() || y.empty()) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    i += x.size(), j += y.size();
    x.remove_prefix(std::min(x.find_first_not_of('0'), x.size()));
    y.remove_prefix(std::min(y.find_first_not_of('0'), y.size()));
    if (x != y) return x.size() != y.size() ? x.size() < y.size() : x < y;
  }
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

// Number of a rotated log, not the kind of file: lcmlog-2026-03-02.00.
bool is_numbered(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension.size() > 1 && std::isdigit(static_cast<unsigned char>(extension[1])) != 0;
}

// The last folders of a path and its name: "monday_rec01" for 1 folder.
std::string name_with_folders(const fs::path& path, std::size_t folders, bool whole) {
  whole = whole || is_numbered(path) || fs::is_directory(path);
  std::string name = (whole ? path.filename() : path.stem()).string();
  for (fs::path rest = path.parent_path(); folders > 0 && rest.has_filename(); rest = rest.parent_path(), --folders)
    name = rest.filename().string() + "_" + name;
  return name;
}

}  // namespace

bool is_log_name(const std::string& file_name) {
  const fs::path path(file_name);
  const std::string extension = path.extension().string();
  const bool has_number = !extension.empty() && is_number(extension.substr(1));
  if ((has_number ? path.stem() : path).extension() == ".lcm") return true;
  // lcm-logger's own name is lcmlog-%Y-%m-%d, with a number behind it.
  return file_name.starts_with("lcmlog-") && (has_number || extension.empty());
}

std::vector<std::string> find_logs(const std::vector<std::string>& paths) {
  std::vector<std::string> logs;
  std::set<fs::path> known;
  const auto add = [&](const std::string& log) {
    if (!known.insert(fs::weakly_canonical(log)).second) throw IoError(log + ": given twice; give each log once");
    logs.push_back(log);
  };
  for (const std::string& path : paths) {
    if (!fs::is_directory(path)) {
      if (!fs::exists(path)) throw IoError(path + ": no such log");
      add(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path))
      if (is_log(entry)) inside.push_back(entry.path().string());
    if (inside.empty())
      throw IoError(path + ": holds no log; expected are files named *.lcm, or as lcm-logger names them " +
                    "(lcmlog-2026-03-02.00, *.lcm.00)");
    std::ranges::sort(inside, is_before);
    std::ranges::for_each(inside, add);
  }
  for (const std::string& log : logs) require_name(log);
  return logs;
}

std::vector<std::string> result_names(const std::vector<std::string>& logs) {
  struct Named {
    fs::path path;
    std::string name;
    std::size_t folders = 0;
    bool whole = false;
  };
  std::vector<Named> all;
  for (const std::string& log : logs) {
    const fs::path path = fs::absolute(log).lexically_normal();
    all.push_back({path.has_filename() ? path : path.parent_path(), ""});  // "csv/rec01/"
  }
  std::size_t deepest = 0;
  for (Named& one : all) {
    one.name = name_with_folders(one.path, 0, false);
    deepest = std::max<std::size_t>(deepest, static_cast<std::size_t>(std::distance(one.path.begin(), one.path.end())));
  }
  // Each round lengthens the names that are not unique: the whole name of the file first, then a folder more.
  for (std::size_t round = 0; round <= deepest; ++round) {
    std::map<std::string, std::vector<Named*>> groups;
    for (Named& one : all) groups[one.name].push_back(&one);
    if (groups.size() == all.size()) break;
    for (auto& [name, group] : groups) {
      if (group.size() == 1) continue;
      std::set<std::string> files;
      for (const Named* one : group) files.insert(one->path.filename().string());
      for (Named* one : group) {
        if (files.size() > 1) one->whole = true;
        if (round > 0 || files.size() == 1) ++one->folders;
        one->name = name_with_folders(one->path, one->folders, one->whole);
      }
    }
  }
  // Folders joined by "_" can be equal for different paths; a number tells the rest apart.
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const Named& one : all) {
    std::string name = one.name;
    for (int number = 2; !taken.insert(name).second; ++number) name = one.name + "-" + std::to_string(number);
    names.push_back(name);
  }
  return names;
}

}  // namespace bevel::io
