/// Memory that runs out when a test says so. For one file of a program, outside of unity builds.
#pragma once

#include <cstdlib>
#include <new>

namespace dtsdf {

/// How many more allocations of this thread come before one that fails; -1: none does.
thread_local int allocations_left = -1;

}  // namespace dtsdf

// Inline they would seem not to fit each other.
[[gnu::noinline]] void* operator new(size_t bytes) {
  const bool fails = dtsdf::allocations_left == 0;
  if (dtsdf::allocations_left >= 0) --dtsdf::allocations_left;
  void* const memory = fails ? nullptr : std::malloc(bytes > 0 ? bytes : 1);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
/// A sanitizer's own would not come here.
[[gnu::noinline]] void* operator new[](size_t bytes) { return operator new(bytes); }
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, size_t) noexcept { std::free(memory); }
