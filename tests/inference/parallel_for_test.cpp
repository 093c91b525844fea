// SPDX-License-Identifier: MIT
// Work on several threads: every piece once, whatever their number; a failure comes out when all have ended.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include <bevel/diagnosis/parallel.hpp>

namespace bevel::diagnosis {
namespace {

TEST(ParallelFor, DoesEveryPieceOnceWhateverTheThreads) {
  for (const int threads : {-1, 0, 1, 2, 3, 16}) {
    std::vector<int> done(1000, 0);
    parallel_for(done.size(), threads, [&](std::size_t i) { ++done[i]; });
    EXPECT_EQ(done, std::vector<int>(1000, 1)) << threads;
  }
  parallel_for(0, 4, [](std::size_t) { FAIL(); });
}

TEST(ParallelFor, ThrowsTheFirstFailureOnceNobodyWorksAnyMore) {
  std::atomic<int> at_work{0};
  std::atomic<int> begun{0};
  const auto work = [&](std::size_t i) {
    ++begun;
    ++at_work;
    if (i == 10) {
      --at_work;
      throw std::runtime_error("piece 10");
    }
    --at_work;
  };
  EXPECT_THROW(parallel_for(100'000, 4, work), std::runtime_error);
  EXPECT_EQ(at_work, 0);
  EXPECT_GE(begun, 11);
}

TEST(ParallelFor, PiecesOfPiecesAreDoneOnceByNoMoreThanTheCrew) {
  for (const int threads : {1, 2, 3, 5}) {
    SCOPED_TRACE(threads);
    Crew crew(threads);
    constexpr std::size_t kPieces = 7, kParts = 11;
    std::vector<std::vector<int>> done(kPieces, std::vector<int>(kParts, 0));
    std::atomic<int> at_work{0}, most{0};
    parallel_for(kPieces, [&](std::size_t i) {
      parallel_for(kParts, [&](std::size_t k) {
        const int now = ++at_work;
        for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
        }
        std::this_thread::sleep_for(std::chrono::microseconds(100));
        ++done[i][k];
        --at_work;
      });
    });
    EXPECT_EQ(done, std::vector<std::vector<int>>(kPieces, std::vector<int>(kParts, 1)));
    EXPECT_LE(most, threads);
  }
}

// The last piece is long: its parts are done by those that have nothing to do any more.
TEST(ParallelFor, WhoIsDoneHelpsTheOthers) {
  constexpr int kThreads = 3;
  Crew crew(kThreads);
  std::set<std::thread::id> seen;
  std::mutex mutex;
  parallel_for(kThreads, [&](std::size_t i) {
    if (i > 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    parallel_for(40, [&](std::size_t) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      const std::scoped_lock lock(mutex);
      seen.insert(std::this_thread::get_id());
    });
  });
  EXPECT_EQ(seen.size(), kThreads);
}

TEST(ParallelFor, WithoutACrewAThreadWorksAlone) {
  std::set<std::thread::id> seen;
  parallel_for(100, [&](std::size_t) { seen.insert(std::this_thread::get_id()); });
  EXPECT_EQ(seen, std::set{std::this_thread::get_id()});
}

}  // namespace
}  // namespace bevel::diagnosis
