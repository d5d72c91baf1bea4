/// Replaces `new` with a version that fails on demand. Only one source file of a program may
/// include this header, and that file must not be part of a unity build.
#pragma once

#include <cstdlib>
#include <new>

namespace dtsdf {

/// Number of allocations on this thread that succeed before one fails, or -1 if none fails.
thread_local int allocations_left = -1;

}  // namespace dtsdf

// If these operators were inlined, the compiler would report mismatched new and delete.
[[gnu::noinline]] void* operator new(size_t bytes) {
  const bool fails = dtsdf::allocations_left == 0;
  if (dtsdf::allocations_left >= 0) --dtsdf::allocations_left;
  void* const memory = fails ? nullptr : std::malloc(bytes > 0 ? bytes : 1);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
/// Without this operator, the operator new[] of a sanitizer would bypass operator new above.
[[gnu::noinline]] void* operator new[](size_t bytes) { return operator new(bytes); }
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, size_t) noexcept { std::free(memory); }
