/// Gives memory that was freed back to the system.
#pragma once

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace dtsdf {

/// Blocks of meshes are made on the map's thread and freed by the output's; images and messages
/// come and go on others. The C library keeps what is freed in a pool for each thread: in hours a
/// process comes to hold three times what it uses. Takes milliseconds, more where much is free.
inline void returnFreeMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace dtsdf
