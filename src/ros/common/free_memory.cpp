#include "ros/common/free_memory.h"

#include <utility>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace dtsdf {
namespace {

constexpr double kRate_hz = 1.0 / 30.0;

}  // namespace

void returnFreeMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

FreeMemory::FreeMemory(SteadyClock clock) : clock_(std::move(clock)), pace_(kRate_hz) {}

void FreeMemory::step() {
  const SteadyTime now = clock_();
  if (!pace_.isDue(now)) return;
  pace_.begin(now);
  returnFreeMemory();
}

}  // namespace dtsdf
