/// Repeats write(2) until all bytes are written.
#pragma once

#include <sys/types.h>

#include <cerrno>
#include <cstddef>

namespace dtsdf {

/// @param write write(2) or a function with the same contract. @return 0, or an errno value.
template <class Write>
int writeAll(int descriptor, const void* data, size_t bytes, const Write& write) {
  const auto* next = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = write(descriptor, next, bytes);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return written < 0 ? errno : ENOSPC;
    next += written;
    bytes -= static_cast<size_t>(written);
  }
  return 0;
}

}  // namespace dtsdf
