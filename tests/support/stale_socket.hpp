// SPDX-License-Identifier: MIT
#pragma once
// The socket file that a process leaves behind when it is killed.
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <string>

namespace bevel::test {

inline void leave_stale_socket(const std::string& path, int type) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(static_cast<char*>(address.sun_path), path.c_str(), sizeof address.sun_path - 1);
  const int fd = ::socket(AF_UNIX, type, 0);
  (void)::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  ::close(fd);
}

}  // namespace bevel::test
