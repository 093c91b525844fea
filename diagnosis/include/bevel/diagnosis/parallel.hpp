// SPDX-License-Identifier: MIT
#pragma once
// Independent pieces of work on a few threads, and pieces of pieces on those that have nothing to do. Results go where
// their index says: what comes out does not depend on the number of threads.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace bevel {

// How many threads may work at once, for as long as it lives, on behalf of the thread that made it: itself and those
// that it and they hire. Threads without a crew work alone.
class Crew {
 public:
  explicit Crew(int threads) : spare_(std::max(threads, 1) - 1), before_(current()) { current() = this; }
  ~Crew() { current() = before_; }
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

 private:
  template <class Work>
  friend void parallel_for(std::size_t count, Work&& work);

  static Crew*& current() {
    thread_local Crew* crew = nullptr;
    return crew;
  }
  // As many of those with nothing to do as there are, at most so many.
  std::size_t hire(std::size_t most) {
    int spare = spare_.load();
    while (spare > 0 && most > 0) {
      const int hired = static_cast<int>(std::min(most, static_cast<std::size_t>(spare)));
      if (spare_.compare_exchange_weak(spare, spare - hired)) return static_cast<std::size_t>(hired);
    }
    return 0;
  }
  void dismiss_one() { ++spare_; }
  // Whether none of its work was begun before.
  bool begin() { return !begun_.exchange(true); }
  void end() { begun_ = false; }

  std::atomic<int> spare_;
  std::atomic<bool> begun_ = false;
  Crew* before_;
};

// Calls work(i) for i in [0, count) on this thread and on those of its crew that have nothing to do; the first
// exception thrown is thrown again here, once all threads have ended.
template <class Work>
void parallel_for(std::size_t count, Work&& work) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  Crew* const crew = Crew::current();
  const std::size_t hired = crew != nullptr && count > 1 ? crew->hire(count - 1) : 0;
  const bool outermost = hired > 0 && crew->begin();
  std::vector<std::thread> others;
  try {
    while (others.size() < hired)
      others.emplace_back([&] {
        Crew::current() = crew;
        run();
        crew->dismiss_one();
      });
  } catch (const std::system_error&) {  // the system has no more threads: fewer do it
    for (std::size_t t = others.size(); t < hired; ++t) crew->dismiss_one();
  }
  run();
  if (outermost) crew->dismiss_one();  // nothing to do until the others have ended
  for (auto& other : others) other.join();
  if (outermost) crew->hire(1), crew->end();  // itself
  if (failure) std::rethrow_exception(failure);
}

// With a crew of its own.
template <class Work>
void parallel_for(std::size_t count, int threads, Work&& work) {
  Crew crew(threads);
  parallel_for(count, std::forward<Work>(work));
}

}  // namespace bevel
