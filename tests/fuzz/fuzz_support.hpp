// SPDX-License-Identifier: MIT
// What the fuzz targets share: an assertion that no build switches off, numbers out of the input, a file without a
// disk.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

// libFuzzer's entry point; each target defines it, and libFuzzer or run_corpus.cpp calls it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace bevel::fuzz {

[[noreturn]] inline void broken(const char* file, int line, const char* condition, const std::string& detail) {
  std::fprintf(stderr, "%s:%d: broken: %s %s\n", file, line, condition, detail.c_str());
  std::abort();
}

// Takes an input apart from its front. Past the end everything is zero.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : bytes_(data, size) {}
  bool empty() const { return bytes_.empty(); }
  std::size_t left() const { return bytes_.size(); }

  template <class Number>
  Number take() {
    Number value{};
    const std::size_t size = std::min(sizeof value, bytes_.size());
    if (size > 0) std::memcpy(&value, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
    return value;
  }
  std::uint8_t byte() { return take<std::uint8_t>(); }

 private:
  std::span<const std::uint8_t> bytes_;
};

inline std::string_view as_text(const std::uint8_t* data, std::size_t size) {
  return size == 0 ? std::string_view{} : std::string_view(reinterpret_cast<const char*>(data), size);
}

// A regular file in memory, for what reads only files. One of them serves all inputs.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : fd_(::memfd_create(name, MFD_CLOEXEC)) {
    if (fd_ < 0) throw std::runtime_error("memfd_create failed");
  }
  ~MemoryFile() { ::close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::string& hold(std::string_view text) {
    const auto size = static_cast<ssize_t>(text.size());
    if (::ftruncate(fd_, 0) != 0 || ::pwrite(fd_, text.data(), text.size(), 0) != size)
      throw std::runtime_error("memory file cannot be written");
    return path_;
  }
  const std::string& path() const { return path_; }

 private:
  int fd_;
  std::string path_ = "/proc/self/fd/" + std::to_string(fd_);
};

}  // namespace bevel::fuzz

// Aborts with the place and the condition: what libFuzzer takes for a finding. The detail is evaluated only then.
#define BEVEL_MUST(condition) \
  if (!(condition)) bevel::fuzz::broken(__FILE__, __LINE__, #condition, "")
#define BEVEL_MUST_SAYING(condition, detail) \
  if (!(condition)) bevel::fuzz::broken(__FILE__, __LINE__, #condition, (detail))
