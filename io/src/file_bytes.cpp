// SPDX-License-Identifier: MIT
#include <bevel/io/file_bytes.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include <bevel/error.hpp>

namespace bevel::io {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw IoError(path + ": cannot be read: " + reason);
}

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  if (S_ISSOCK(mode)) return "a socket";
  return "something else";
}

void require_regular(const std::string& path, const struct stat& status) {
  if (!S_ISREG(status.st_mode))
    fail(path, std::string("it is ") + kind_of(status.st_mode) + "; allowed: a regular file");
}

class OpenFile {
 public:
  // Looked at before it is opened, since opening a device may already move something; O_NONBLOCK for the FIFO that took
  // the file's place in between.
  explicit OpenFile(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) fail(path, std::strerror(errno));
    require_regular(path, status);
    file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);  // NOLINT(*-vararg)
    if (file_ < 0) fail(path, std::strerror(errno));
  }
  ~OpenFile() { ::close(file_); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  struct stat status(const std::string& path) const {
    struct stat now {};
    if (::fstat(file_, &now) != 0) fail(path, std::strerror(errno));
    require_regular(path, now);
    return now;
  }
  // As much as there is, up to `size`.
  std::size_t read(const std::string& path, std::uint8_t* to, std::size_t size) const {
    std::size_t got = 0;
    while (got < size) {
      const ssize_t count = ::read(file_, to + got, size - got);
      if (count == 0) break;
      if (count < 0 && errno != EINTR) fail(path, std::strerror(errno));
      if (count > 0) got += static_cast<std::size_t>(count);
    }
    return got;
  }

 private:
  int file_ = -1;
};

}  // namespace

FileBytes::FileBytes(const std::string& path, std::uint64_t largest_bytes) {
  const OpenFile file(path);
  const auto size = static_cast<std::uint64_t>(file.status(path).st_size);
  if (size > largest_bytes)
    fail(path, std::to_string(size) + " bytes; at most " + std::to_string(largest_bytes) + " are allowed");
  bytes_.resize(size);
  bytes_.resize(file.read(path, bytes_.data(), bytes_.size()));
  const auto size_after = static_cast<std::uint64_t>(file.status(path).st_size);
  if (bytes_.size() != size || size_after != size)
    change_ = "the file changed while it was read, from " + std::to_string(size) + " to " + std::to_string(size_after) +
              " bytes; " + std::to_string(bytes_.size()) + " were read";
}

std::string read_text_file(const std::string& path) {
  const FileBytes file(path, kLargestText_bytes);
  if (!file.change().empty()) throw IoError(path + ": " + file.change() + "; try again");
  return {file.bytes().begin(), file.bytes().end()};
}

}  // namespace bevel::io
