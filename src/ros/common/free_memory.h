/// Returns freed memory to the system.
#pragma once

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace dtsdf {

/// The C library keeps freed memory in per-thread pools. Mesh blocks are allocated on one thread
/// and freed on another, so within hours the process would hold three times the memory that it
/// uses. Takes milliseconds, or longer if much memory is free.
inline void returnFreeMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace dtsdf
