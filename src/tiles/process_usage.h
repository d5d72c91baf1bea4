/// What this process has taken of the machine so far.
#pragma once

#include <sys/resource.h>
#include <sys/time.h>

#include <cstddef>

namespace dtsdf {

/// The most memory at once, in bytes.
inline size_t peakBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<size_t>(usage.ru_maxrss) * 1024;
}

/// Of all threads: on a machine with other work it tells more than the time on the wall.
inline double processorSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace dtsdf
