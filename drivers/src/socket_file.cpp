// SPDX-License-Identifier: MIT
#include <bevel/drivers/socket_file.hpp>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include <bevel/error.hpp>

namespace bevel {
namespace {

const sockaddr* generic(const sockaddr_un& address) { return reinterpret_cast<const sockaddr*>(&address); }

int type_of(int socket) {
  int type = 0;
  socklen_t size = sizeof type;
  return ::getsockopt(socket, SOL_SOCKET, SO_TYPE, &type, &size) == 0 ? type : SOCK_STREAM;
}

/// Error of a connection to the address, 0 if it is accepted.
int error_of_connection(const sockaddr_un& address, int type) {
  const int fd = ::socket(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return errno;
  const int error = ::connect(fd, generic(address), sizeof address) == 0 ? 0 : errno;
  ::close(fd);
  return error;
}

const char* kind_of(mode_t mode) {
  if (S_ISREG(mode)) return "a regular file";
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISLNK(mode)) return "a symbolic link";
  return "a device or FIFO";
}

void remove_stale(const sockaddr_un& address, int type, const std::string& name) {
  struct stat status {};
  const char* path = static_cast<const char*>(address.sun_path);
  if (::lstat(path, &status) != 0) return;  // bind() reports what prevents it
  if (!S_ISSOCK(status.st_mode))
    throw IoError(name + ": the path is " + kind_of(status.st_mode) +
                  "; allowed: a path that does not exist yet, or a socket whose process has ended. Choose "
                  "another path, or remove it");
  switch (const int error = error_of_connection(address, type)) {
    case ECONNREFUSED:  // nobody listens: its process has ended
      if (::unlink(path) != 0) throw IoError(name + ": cannot be removed: " + std::strerror(errno));
      return;
    case ENOENT:
      return;
    case 0:
    case EAGAIN:      // its queue of connections is full
    case EPROTOTYPE:  // a process listens with another type of socket
      throw IoError(name + ": another process serves it already; end that process or choose another path");
    default:
      throw IoError(name +
                    ": is a socket, and whether a process serves it cannot be found out: " + std::strerror(error));
  }
}

}  // namespace

SocketFile::SocketFile(int socket, const sockaddr_un& address, const std::string& name)
    : path_(static_cast<const char*>(address.sun_path)) {
  remove_stale(address, type_of(socket), name);
  struct stat status {};
  if (::bind(socket, generic(address), sizeof address) != 0 || ::lstat(path_.c_str(), &status) != 0)
    throw IoError(name + ": cannot be served: " + std::strerror(errno));
  device_ = status.st_dev;
  inode_ = status.st_ino;
}

SocketFile::~SocketFile() {
  struct stat status {};
  if (::lstat(path_.c_str(), &status) != 0) return;
  if (status.st_dev == device_ && status.st_ino == inode_) (void)::unlink(path_.c_str());
}

}  // namespace bevel
