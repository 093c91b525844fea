// SPDX-License-Identifier: MIT
#include <bevel/cli/limits.hpp>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <bevel/error.hpp>

namespace bevel::cli {
namespace {

// In the demo bevel-rig has 28 files open, the most of all programs; the rest is for further clients of its sockets.
constexpr int kFreeFiles = 48;
// Address space of a node in addition to its code: receive buffers of LCM, the history of the filter, pictures.
constexpr std::size_t kFreeBytes = std::size_t{64} << 20U;

std::string text_of(rlim_t limit) { return limit == RLIM_INFINITY ? "unlimited" : std::to_string(limit); }

rlimit limit_of(int resource) {
  rlimit limit{};
  (void)getrlimit(static_cast<__rlimit_resource>(resource), &limit);
  return limit;
}

// How many files can be opened now, at most `most`.
int free_files(int most) {
  std::vector<int> fds;
  while (static_cast<int>(fds.size()) < most) {
    const int fd = open("/", O_RDONLY | O_CLOEXEC);
    if (fd < 0) break;
    fds.push_back(fd);
  }
  for (const int fd : fds) close(fd);
  return static_cast<int>(fds.size());
}

void require_open_files() {
  int free = free_files(kFreeFiles);
  if (free >= kFreeFiles) return;
  rlimit limit = limit_of(RLIMIT_NOFILE);
  if (limit.rlim_cur < limit.rlim_max) {
    const rlim_t wanted = limit.rlim_cur + static_cast<rlim_t>(kFreeFiles - free);
    limit.rlim_cur = std::min(wanted, limit.rlim_max);
    (void)setrlimit(RLIMIT_NOFILE, &limit);
    free = free_files(kFreeFiles);
  }
  if (free >= kFreeFiles) return;
  throw IoError("only " + std::to_string(free) + " more files can be opened, " + std::to_string(kFreeFiles) +
                " are required; the limit of open files is " + text_of(limit.rlim_cur) + ", raise it: ulimit -n 1024");
}

void require_memory() {
  void* at = mmap(nullptr, kFreeBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (at == MAP_FAILED)
    throw IoError("64 MiB of memory are required and refused (" + std::string(std::strerror(errno)) +
                  "); the limit of address space is " + text_of(limit_of(RLIMIT_AS).rlim_cur) +
                  " bytes, raise it: ulimit -v unlimited");
  munmap(at, kFreeBytes);
}

}  // namespace

void require_threads(int count) {
  std::mutex mutex;
  std::condition_variable changed;
  bool end = false;
  std::string refused;
  {
    std::vector<std::jthread> threads;
    try {
      for (int i = 0; i < count; ++i)
        threads.emplace_back([&] {
          std::unique_lock lock(mutex);
          changed.wait(lock, [&] { return end; });
        });
    } catch (const std::system_error& e) {
      refused = e.code().message();
    }
    {
      const std::lock_guard lock(mutex);
      end = true;
    }
    changed.notify_all();
  }
  if (!refused.empty())
    throw IoError("a thread is refused (" + refused + "), required: " + std::to_string(count) +
                  "; the limit of processes is " + text_of(limit_of(RLIMIT_NPROC).rlim_cur) +
                  ", raise it: ulimit -u 4096; and that of address space: ulimit -v unlimited");
}

void require_limits() {
  require_open_files();
  require_memory();
  require_threads(1);
}

}  // namespace bevel::cli
