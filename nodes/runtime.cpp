#include "nodes/runtime.hpp"

#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <stdexcept>

namespace bevel::nodes {
namespace {

std::atomic<bool> stop_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

void on_signal(int) { stop_flag = true; }

constexpr int kMaxMessagesAtOnce = 256;

thread_local LoopTimes loop_times;

}  // namespace

Now now() {
  using namespace std::chrono;
  return {duration_cast<nanoseconds>(steady_clock::now().time_since_epoch()).count(),
          duration_cast<microseconds>(system_clock::now().time_since_epoch()).count()};
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;  // no SA_RESTART: a waiting poll returns at once
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

bool stop_requested() { return stop_flag; }

void claim_name(const std::string& name) {
  // An abstract socket lives in the network namespace and goes with the process, even after kill -9.
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) throw std::runtime_error(std::string("cannot make a socket: ") + std::strerror(errno));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = "bevel/" + name;
  std::memcpy(address.sun_path + 1, path.data(), std::min(path.size(), sizeof address.sun_path - 1));
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + path.size());
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), size) != 0)
    throw std::runtime_error("another " + name + " is running here; two would fight over the needle");
  // Not closed: held for the life of the process.
}

std::string try_realtime(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  if (sched_setscheduler(0, SCHED_FIFO, &parameters) != 0) return std::string("no SCHED_FIFO: ") + std::strerror(errno);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) return std::string("memory not locked: ") + std::strerror(errno);
  return "";
}

void pump(lcm::LCM& lcm) {
  for (int i = 0; i < kMaxMessagesAtOnce && lcm.handleTimeout(0) > 0; ++i) {
  }
}

LoopTimes take_loop_times() {
  const LoopTimes taken = loop_times;
  loop_times = {0, 0, taken.overruns};
  return taken;
}

void run_periodic(lcm::LCM& lcm, double period_s, const std::function<bool(const Now&, double late_s)>& step) {
  const auto period_ns = std::llround(period_s * 1e9);
  std::int64_t due_ns = now().ns;
  loop_times = {};
  const auto note_run = [period_ns](std::int64_t run_ns) {
    loop_times.run_max_s = std::max(loop_times.run_max_s, static_cast<double>(run_ns) * 1e-9);
    if (run_ns > period_ns) ++loop_times.overruns;
  };
  while (!stop_requested()) {
    const std::int64_t wait_ns = due_ns - now().ns;
    if (wait_ns > 0) {
      pollfd fd{lcm.getFileno(), POLLIN, 0};
      const timespec timeout{wait_ns / 1'000'000'000, wait_ns % 1'000'000'000};
      if (ppoll(&fd, 1, &timeout, nullptr) <= 0) continue;
      const std::int64_t begun_ns = now().ns;
      lcm.handleTimeout(0);
      note_run(now().ns - begun_ns);
      continue;
    }
    const std::int64_t begun_ns = now().ns;
    pump(lcm);
    const Now at = now();
    const double late_s = static_cast<double>(at.ns - due_ns) * 1e-9;
    loop_times.late_max_s = std::max(loop_times.late_max_s, late_s);
    const bool go_on = step(at, late_s);
    const std::int64_t done_ns = now().ns;
    note_run(done_ns - begun_ns);
    if (!go_on) return;
    due_ns += period_ns;
    if (done_ns - due_ns > period_ns) due_ns = done_ns;
  }
}

}  // namespace bevel::nodes
