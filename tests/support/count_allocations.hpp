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
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
