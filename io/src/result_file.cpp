// SPDX-License-Identifier: MIT
#include <bevel/io/result_file.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include <bevel/error.hpp>

namespace bevel::io {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& path, const std::string& what, int error) {
  throw IoError(path + ": " + what + ": " + std::strerror(error));
}

/// Returns 0, or the error number.
int write_all(int descriptor, std::string_view contents) {
  while (!contents.empty()) {
    const ssize_t size = ::write(descriptor, contents.data(), contents.size());
    if (size < 0 && errno != EINTR) return errno;
    if (size > 0) contents.remove_prefix(static_cast<std::size_t>(size));
  }
  return 0;
}

/// Destination of the rename: the file to which a symbolic link points.
std::string resolved(const std::string& path) {
  std::error_code none;
  if (!fs::is_symlink(path, none)) return path;
  const fs::path target = fs::weakly_canonical(path, none);
  return none ? path : target.string();
}

mode_t mode_of_new_files() {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666 & ~mask;
}

/// Mode of the file that is replaced, and otherwise that of new files: mkstemp() grants access to the owner alone.
mode_t mode_for(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_mode & 07777 : mode_of_new_files();
}

/// A device or FIFO, /dev/stdout included: written to directly, since a rename would replace it.
/// @throws IoError for a directory
bool is_device(const std::string& path) {
  if (path.starts_with("/dev/") || path.starts_with("/proc/")) return true;
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return false;
  if (S_ISDIR(status.st_mode)) fail(path, "cannot be written", EISDIR);
  return !S_ISREG(status.st_mode);
}

}  // namespace

PendingFile::PendingFile(const std::string& path, std::string_view contents) : place_(resolved(path)) {
  const fs::path place(place_);
  std::string pattern = (place.parent_path() / ("." + place.filename().string() + ".XXXXXX")).string();
  const int descriptor = ::mkstemp(pattern.data());
  if (descriptor < 0) fail(path, "no file can be made in its folder", errno);
  path_ = pattern;
  int error = write_all(descriptor, contents);
  if (error == 0 && (::fchmod(descriptor, mode_for(place_)) != 0 || ::fsync(descriptor) != 0)) error = errno;
  if (::close(descriptor) != 0 && error == 0) error = errno;
  if (error == 0) return;
  ::unlink(path_.c_str());  // a constructor that throws has no destructor
  fail(path, "cannot be written", error);
}

PendingFile::~PendingFile() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

PendingFile::PendingFile(PendingFile&& other) noexcept
    : place_(std::move(other.place_)), path_(std::exchange(other.path_, {})) {}

void PendingFile::take_place() {
  if (::rename(path_.c_str(), place_.c_str()) != 0) fail(place_, "cannot be put in place", errno);
  path_.clear();
}

void require_writable(const std::string& path) {
  if (!is_device(path)) const PendingFile trial(path, "");
}

void write_result_file(const std::string& path, std::string_view contents) {
  if (!is_device(path)) {
    PendingFile(path, contents).take_place();
    return;
  }
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);  // NOLINT(*-vararg)
  if (descriptor < 0) fail(path, "cannot be written", errno);
  int error = write_all(descriptor, contents);
  if (::close(descriptor) != 0 && error == 0) error = errno;
  if (error != 0) fail(path, "cannot be written", error);
}

}  // namespace bevel::io
