/// Returns freed memory to the system.
#pragma once

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace dtsdf {

/// Mesh blocks are allocated on the map's thread and freed on the output's; images and messages use
/// others. The C library pools freed memory per thread, so within hours the process would hold
/// three times what it uses. Takes milliseconds, longer if much is free.
inline void returnFreeMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace dtsdf
