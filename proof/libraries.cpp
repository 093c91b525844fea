// SPDX-License-Identifier: MIT
#include "proof/libraries.hpp"

#include <elf.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace bevel::proof {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 5> kSystem{"/usr", "/bin", "/sbin", "/lib", "/lib64"};
constexpr std::size_t kMostEntries = 4096;        // of the dynamic section; a large program has about 100
constexpr std::size_t kLargestName_bytes = 4096;  // PATH_MAX
constexpr std::size_t kMostLibraries = 256;

struct Dynamic {
  std::vector<std::string> needed;
  std::vector<fs::path> folders;
};

/// Reads fixed-size records and names from a file; every read is checked against its end.
class ElfFile {
 public:
  explicit ElfFile(const fs::path& path) {
    std::error_code error;
    if (fs::is_regular_file(path, error)) file_.open(path, std::ios::binary);
  }
  template <class Record>
  bool read(std::uint64_t at, Record& record) {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(at));
    file_.read(reinterpret_cast<char*>(&record), sizeof record);
    return static_cast<bool>(file_);
  }
  std::string name(std::uint64_t at) {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(at));
    std::string text;
    for (char c = 0; text.size() < kLargestName_bytes && file_.get(c) && c != 0;) text += c;
    return text;
  }

 private:
  std::ifstream file_;
};

/// Replaces $ORIGIN by the folder of the file.
std::vector<fs::path> folders_in(const std::string& text, const fs::path& file) {
  std::vector<fs::path> folders;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(':', at), text.size());
    std::string folder = text.substr(at, end - at);
    at = end + 1;
    for (const std::string origin : {"$ORIGIN", "${ORIGIN}"})
      if (const auto found = folder.find(origin); found != std::string::npos)
        folder.replace(found, origin.size(), file.parent_path().string());
    if (folder.starts_with('/')) folders.emplace_back(folder);
  }
  return folders;
}

std::optional<Dynamic> dynamic_section(const fs::path& path) {
  ElfFile file(path);
  Elf64_Ehdr header{};
  if (!file.read(0, header) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 ||
      header.e_ident[EI_CLASS] != ELFCLASS64 || header.e_phentsize != sizeof(Elf64_Phdr))
    return std::nullopt;
  std::vector<Elf64_Phdr> segments(header.e_phnum);
  for (std::size_t i = 0; i < segments.size(); ++i)
    if (!file.read(header.e_phoff + i * sizeof(Elf64_Phdr), segments[i])) return std::nullopt;
  const auto dynamic = std::ranges::find(segments, Elf64_Word{PT_DYNAMIC}, &Elf64_Phdr::p_type);
  if (dynamic == segments.end()) return Dynamic{};
  std::vector<std::pair<Elf64_Sxword, std::uint64_t>> names;  // tag, offset into the string table
  std::uint64_t table = 0;
  const std::size_t count = std::min<std::size_t>(dynamic->p_filesz / sizeof(Elf64_Dyn), kMostEntries);
  for (std::size_t i = 0; i < count; ++i) {
    Elf64_Dyn entry{};
    if (!file.read(dynamic->p_offset + i * sizeof entry, entry) || entry.d_tag == DT_NULL) break;
    if (entry.d_tag == DT_STRTAB) table = entry.d_un.d_ptr;
    if (entry.d_tag == DT_NEEDED || entry.d_tag == DT_RPATH || entry.d_tag == DT_RUNPATH)
      names.emplace_back(entry.d_tag, entry.d_un.d_val);
  }
  const auto segment = std::ranges::find_if(segments, [table](const Elf64_Phdr& s) {
    return s.p_type == PT_LOAD && table >= s.p_vaddr && table - s.p_vaddr < s.p_filesz;
  });
  if (segment == segments.end()) return Dynamic{};
  const std::uint64_t offset = table - segment->p_vaddr + segment->p_offset;
  Dynamic all;
  for (const auto& [tag, at] : names) {
    const std::string name = file.name(offset + at);
    if (tag == DT_NEEDED) {
      all.needed.push_back(name);
    } else {
      const auto folders = folders_in(name, path);
      all.folders.insert(all.folders.end(), folders.begin(), folders.end());
    }
  }
  return all;
}

void add_libraries(const fs::path& path, std::vector<fs::path> inherited, std::set<fs::path>& found) {
  const auto dynamic = dynamic_section(path);
  if (!dynamic) return;
  inherited.insert(inherited.begin(), dynamic->folders.begin(), dynamic->folders.end());
  for (const std::string& name : dynamic->needed) {
    if (name.empty() || name.find('/') != std::string::npos || found.size() >= kMostLibraries) continue;
    for (const fs::path& folder : inherited) {
      const fs::path library = (folder / name).lexically_normal();
      if (is_system_path(library) || !dynamic_section(library)) continue;
      if (found.insert(library).second) add_libraries(library, inherited, found);
      break;
    }
  }
}

}  // namespace

bool is_system_path(const fs::path& path) {
  return std::ranges::any_of(kSystem, [&](const char* folder) {
    const fs::path relative = path.lexically_relative(folder);
    return !relative.empty() && *relative.begin() != "..";
  });
}

std::vector<fs::path> libraries_of(const fs::path& program) {
  std::set<fs::path> found;
  add_libraries(program, {}, found);
  return {found.begin(), found.end()};
}

}  // namespace bevel::proof
