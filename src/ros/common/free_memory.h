/// Returns freed memory to the system.
#pragma once

#include <malloc.h>

namespace dtsdf {

/// The C library keeps freed memory in per-thread pools. Mesh blocks are allocated on one thread
/// and freed on another, so within hours the process would hold three times the memory that it
/// uses. Takes milliseconds, or longer if much memory is free.
inline void returnFreeMemory() { malloc_trim(0); }

}  // namespace dtsdf
