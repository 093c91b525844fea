// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// File of a UNIX domain socket: removed if it is stale, and never another file that has its path.
#include <sys/types.h>
#include <sys/un.h>

#include <string>

namespace bevel {

/// Binds a socket to a path and removes the file again.
class SocketFile {
 public:
  /// Binds \p socket to \p address. A socket file there whose process has ended is removed first.
  /// @param socket  file descriptor of the socket
  /// @param address address of family AF_UNIX
  /// @param name    start of each message: "local bus '/run/bevel.bus'"
  /// @throws IoError if the path names a file that is no socket, if a process listens there, or if the
  ///   socket cannot be bound
  SocketFile(int socket, const sockaddr_un& address, const std::string& name);
  /// Removes the file, unless another file has taken its place.
  ~SocketFile();
  SocketFile(const SocketFile&) = delete;
  SocketFile& operator=(const SocketFile&) = delete;

 private:
  std::string path_;
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

}  // namespace bevel
