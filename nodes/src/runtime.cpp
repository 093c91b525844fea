// SPDX-License-Identifier: MIT
#include <bevel/nodes/runtime.hpp>

#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <exception>

namespace bevel::nodes {
namespace {

std::atomic<bool> stop_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

void on_signal(int) { stop_flag = true; }

constexpr int kMaxMessagesAtOnce = 256;
// So often in a period: a descriptor that is readable for ever must not keep this thread, whose priority is high, busy.
constexpr int kMostOtherWakings = 64;
constexpr std::int64_t kTogether_ns = 1'000'000;  // two readings that belong together

thread_local LoopTimes loop_times;

}  // namespace

Now now() {
  using namespace std::chrono;
  const auto steady_ns = [] { return duration_cast<nanoseconds>(steady_clock::now().time_since_epoch()).count(); };
  // A process that was put aside between two readings must not take that for a step of the wall clock.
  Now at;
  for (int tries = 0; tries < 5; ++tries) {
    const std::int64_t before_ns = steady_ns();
    at.utime = duration_cast<microseconds>(system_clock::now().time_since_epoch()).count();
    at.ns = steady_ns();
    if (at.ns - before_ns < kTogether_ns) break;
  }
  return at;
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;  // no SA_RESTART: a waiting poll returns at once
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a log at the limit of file sizes is a write error, as on a full disk
}

bool stop_requested() { return stop_flag; }

void end_with(int parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) stop_flag = true;
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

namespace {

template <class GoOn>
void run_loop(lcm::LCM& lcm, const Loop& loop, const GoOn& go_on) {
  const auto period_ns = std::llround(loop.period_s * 1e9);
  std::int64_t due_ns = now().ns;
  loop_times = {};
  const auto note_run = [period_ns](std::int64_t run_ns) {
    loop_times.run_max_s = std::max(loop_times.run_max_s, static_cast<double>(run_ns) * 1e-9);
    if (run_ns > period_ns) ++loop_times.overruns;
  };
  const auto tell = [&loop](const Now& at) {
    if (loop.tell) loop.tell(at);
  };
  int other_wakings = 0;
  while (go_on()) {
    const Now waking = now();
    const std::int64_t wait_ns = due_ns - waking.ns;
    if (wait_ns > 0) {
      const bool hear_other = loop.other_fd && other_wakings < kMostOtherWakings;
      std::array<pollfd, 2> fds{{{lcm.getFileno(), POLLIN, 0}, {hear_other ? loop.other_fd() : -1, POLLIN, 0}}};
      const timespec timeout{wait_ns / 1'000'000'000, wait_ns % 1'000'000'000};
      if (ppoll(fds.data(), fds.size(), &timeout, nullptr) <= 0) continue;
      const Now begun = now();
      if (fds[0].revents != 0) {
        tell(begun);
        lcm.handleTimeout(0);
      }
      if (fds[1].revents != 0) {
        ++other_wakings;
        loop.on_other(begun);
      }
      note_run(now().ns - begun.ns);
      continue;
    }
    other_wakings = 0;
    tell(waking);
    pump(lcm);
    const Now at = now();
    const double late_s = static_cast<double>(at.ns - due_ns) * 1e-9;
    loop_times.late_max_s = std::max(loop_times.late_max_s, late_s);
    const bool more = loop.step(at, late_s);
    const std::int64_t done_ns = now().ns;
    note_run(done_ns - waking.ns);
    if (!more) return;
    due_ns += period_ns;
    if (done_ns - due_ns > period_ns) due_ns = done_ns;
  }
}

}  // namespace

void run_periodic(lcm::LCM& lcm, const Loop& loop) {
  run_loop(lcm, loop, [] { return !stop_requested(); });
}

void run_to_end(lcm::LCM& lcm, const Loop& loop, double longest_s) {
  const std::int64_t end_ns = now().ns + std::llround(longest_s * 1e9);
  run_loop(lcm, loop, [end_ns] { return now().ns < end_ns; });
}

void run_with_end(lcm::LCM& lcm, const Loop& loop, const std::function<void()>& before_end, const Loop& end,
                  double longest_s) {
  std::exception_ptr failure;
  try {
    run_periodic(lcm, loop);
  } catch (...) {
    failure = std::current_exception();
  }
  before_end();
  run_to_end(lcm, end, longest_s);
  if (failure) std::rethrow_exception(failure);
}

}  // namespace bevel::nodes
