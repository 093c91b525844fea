// SPDX-License-Identifier: MIT
#pragma once
// Counts every operator new of the program that includes this, once. For tests that a step does not allocate.
#include <atomic>
#include <cstdlib>
#include <new>

namespace bevel::testing {
inline std::atomic<long> allocations{0};
}  // namespace bevel::testing

void* operator new(std::size_t size) {
  ++bevel::testing::allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
// Of std::stable_sort's buffer. In its own words too, as the sanitizers have theirs for each form of new that is not
// here.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++bevel::testing::allocations;
  return std::malloc(size);
}
// GCC inlines these into callers whose operator new it does not see, and takes the two for strangers.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
