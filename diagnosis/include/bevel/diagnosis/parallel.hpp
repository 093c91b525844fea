// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Parallel loops with a bounded number of threads. Nested loops use idle threads. Results that are stored by index do
/// not depend on the number of threads.
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

/// Limits the number of threads of parallel_for() during its lifetime. The limit applies to the thread that constructs
/// it and to all threads that its loops start, jointly. Loops outside of any crew run on the calling thread alone.
class Crew {
 public:
  /// Sets the limit for the calling thread.
  /// @param threads largest number of threads, the calling thread included; values below 1 count as 1
  explicit Crew(int threads) : spare_(std::max(threads, 1) - 1), before_(current()) { current() = this; }
  /// Restores the previous limit. Call it on the thread that constructed the crew.
  ~Crew() { current() = before_; }
  Crew(const Crew&) = delete;             ///< not copyable
  Crew& operator=(const Crew&) = delete;  ///< not copyable

 private:
  template <class Work>
  friend void parallel_for(std::size_t count, Work&& work);

  static Crew*& current() {
    thread_local Crew* crew = nullptr;
    return crew;
  }
  // Reserves idle threads, no more than `most`. Returns their number.
  std::size_t hire(std::size_t most) {
    int spare = spare_.load();
    while (spare > 0 && most > 0) {
      const int hired = static_cast<int>(std::min(most, static_cast<std::size_t>(spare)));
      if (spare_.compare_exchange_weak(spare, spare - hired)) return static_cast<std::size_t>(hired);
    }
    return 0;
  }
  void dismiss_one() { ++spare_; }
  // Marks the start of a loop. Returns true if no other loop of the crew is running.
  bool begin() { return !begun_.exchange(true); }
  void end() { begun_ = false; }

  std::atomic<int> spare_;
  std::atomic<bool> begun_ = false;
  Crew* before_;
};

/// Calls work(i) for each i in [0, count), on the calling thread and on idle threads of its crew.
///
/// The first exception that work throws stops further calls. It is thrown again after all threads have ended.
/// @param count number of calls
/// @param work callable with a std::size_t argument; called from several threads at a time
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
  } catch (const std::system_error&) {  // no more threads are available: continue with fewer
    for (std::size_t t = others.size(); t < hired; ++t) crew->dismiss_one();
  }
  run();
  if (outermost) crew->dismiss_one();  // idle until the others have ended
  for (auto& other : others) other.join();
  if (outermost) crew->hire(1), crew->end();  // reserves the calling thread again
  if (failure) std::rethrow_exception(failure);
}

/// Calls work(i) for each i in [0, count) with a new crew.
///
/// Exceptions propagate as in the overload without threads.
/// @param count number of calls
/// @param threads largest number of threads, the calling thread included
/// @param work callable with a std::size_t argument; called from several threads at a time
template <class Work>
void parallel_for(std::size_t count, int threads, Work&& work) {
  Crew crew(threads);
  parallel_for(count, std::forward<Work>(work));
}

}  // namespace bevel
