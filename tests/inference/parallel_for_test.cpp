// Work on several threads: every piece once, whatever their number; a failure comes out when all have ended.
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "diagnosis/parallel.hpp"

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

}  // namespace
}  // namespace bevel::diagnosis
